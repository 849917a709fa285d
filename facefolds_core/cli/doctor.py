"""Check that this machine has what pip cannot install, and that DVC's files are whole; say or mend what is wrong."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

from facefolds_core.cli.mending import mend
from facefolds_core.errors import report_user_errors

SYSTEM_LIBRARIES = {
    # shared object -> (who needs it, Debian/Ubuntu package, Fedora package)
    "libGL.so.1": ("pymeshlab", "libgl1", "mesa-libGL"),
    "libOpenGL.so.0": ("pymeshlab", "libopengl0", "libglvnd-opengl"),
}
OPTIONAL_LIBRARIES = {
    "libEGL.so.1": ("`facefolds render`", "libegl1 libgl1-mesa-dri", "mesa-libEGL mesa-dri-drivers"),
}


def missing_libraries(libraries: dict[str, tuple[str, str, str]] = SYSTEM_LIBRARIES) -> list[str]:
    """One line for each system library that cannot be loaded (Linux; elsewhere the wheels bring their own)."""
    if not sys.platform.startswith("linux"):
        return []
    lines = []
    for name, (user, debian, fedora) in libraries.items():
        try:
            ctypes.CDLL(name)
        except OSError:
            lines.append(f"{name} (for {user}): `apt-get install {debian}` (Debian, Ubuntu) or `dnf install {fedora}`")
    return lines


def command() -> None:
    with report_user_errors("doctor"):
        for line in mend(Path.cwd()):
            print(f"doctor: {line}")
    missing = missing_libraries()
    if missing:
        text = "\n  ".join(missing)
        sys.exit(f"doctor: system libraries are missing; install them and run the same command again:\n  {text}")
    optional = missing_libraries(OPTIONAL_LIBRARIES)
    if optional:
        print("doctor: not needed by the pipeline, but missing:\n  " + "\n  ".join(optional))
    else:
        print("doctor: all system libraries are here")
