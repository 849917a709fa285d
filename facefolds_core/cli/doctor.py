"""Check that this machine has what pip cannot install, and that DVC's files are whole; say or mend what is wrong.

With a path: say what capture lies there, and what the pipeline would make of it.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.cli.mending import mend
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.reading import is_there

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


def command(
    path: Annotated[
        Path | None, typer.Argument(help="A folder or file: say what it is, and how it would be used.")
    ] = None,
) -> None:
    """Say which system libraries are missing, and mend what a killed DVC leaves. With a path: what capture lies there,
    what of it would be used and what not, and the lines for params.yaml."""
    if path is not None:
        with report_user_errors("doctor"):
            _appraise(path)
        return
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


def _appraise(path: Path) -> None:
    if not is_there(path):
        raise UserError("nothing there", file=path, remedy="correct the path")
    try:
        from facefolds_core.captures.appraisal import appraise  # here: without a path the base is enough
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("facefolds_core"):
            raise
        remedy = "pip install 'facefolds[train]'"
        raise UserError(f"the package {error.name} is missing", remedy=remedy) from None
    for line in appraise(path):
        typer.echo(line)
