"""One frame as binary glTF 2.0 (a file, .glb): most programs open it."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.reader import AssetLevel


def export(out: Path, level: AssetLevel, subject: str) -> str:
    """Write the first frame, with plain meshes; the stage `compress` has settings for more."""
    write_glb(out, level, subject)
    return f"{level.num_layers} layers, frame 0"
