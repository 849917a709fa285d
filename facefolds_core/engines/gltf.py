"""The whole sequence as one .glb: layers, video, sound by EXT_layered_volumetric_video, a still for other viewers."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.asset.reader import AssetLevel, read_asset


def export(out: Path, level: AssetLevel, subject: str) -> str:
    """See `write_layered`; the still is the first frame, of the asset's coarsest level."""
    asset = read_asset(level.folder)
    size = write_layered(out, level, subject, fallback=asset.levels[0], sound=asset.manifest.audio)
    return f"{level.num_layers} layers, {level.num_frames} frames, {size / 1e6:.2f} MB"
