"""Mono's compiler and HLSL's, and what they say of the Unity package."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "engines" / "unity" / "com.facefolds.player"
STUBS = Path(__file__).parent / "unity"
SHADERS = PACKAGE / "Runtime" / "Resources" / "Facefolds"


def missing(*programs: str) -> str | None:
    """What is not installed, in words; None if all is there."""
    packages = {"mcs": "mono-mcs", "mono": "mono-runtime", "glslangValidator": "glslang-tools"}
    packages["spirv-cross"] = "spirv-cross"
    lacking = [packages[name] for name in programs if shutil.which(name) is None]
    return f"no {', '.join(lacking)}: apt-get install {' '.join(lacking)}" if lacking else None


def run(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120, check=False)


def compiled(sources: Sequence[Path], out: Path) -> str:
    """mcs's complaints, warnings among them; empty where there are none."""
    target = "exe" if out.suffix == ".exe" else "library"
    done = run("mcs", "-nologo", "-warnaserror", f"-target:{target}", f"-out:{out}", *sources)
    return done.stdout + done.stderr if done.returncode else ""


def core() -> list[Path]:
    """The plain part of the package."""
    return sorted((PACKAGE / "Runtime" / "Core").glob("*.cs"))


def spirv(shader: Path, place: Path, defines: Sequence[str]) -> list[str]:
    """Compiles to `vert.spv` and `frag.spv`; complaints of a compiler of HLSL, by stage, empty where there are none."""
    code = re.search(r"HLSLPROGRAM(.*?)ENDHLSL", shader.read_text(), re.S)
    assert code is not None
    entries = dict(re.findall(r"#pragma (vertex|fragment) (\w+)", code[1]))
    source = place / "shader.hlsl"
    source.write_text(re.sub(r"#pragma.*", "", code[1]))
    complaints = []
    for kind, stage in (("vertex", "vert"), ("fragment", "frag")):
        words = ["-D", "-V", "-S", stage, "-e", entries[kind], "--auto-map-bindings", "--auto-map-locations"]
        flags = [f"-I{SHADERS}", f"-I{STUBS}", *(f"-D{name}" for name in defines)]
        done = run("glslangValidator", *words, *flags, "-o", place / f"{stage}.spv", source)
        if done.returncode:
            complaints.append(done.stdout + done.stderr)
    return complaints
