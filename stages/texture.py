"""Texture frames at R^t x R^t: data/<subject>/resampled."""

from __future__ import annotations

import typer

from facefolds_core.config import read_stage
from facefolds_core.export.textures import resample_store
from facefolds_core.files import atomic_folder
from facefolds_core.params import TextureParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def texture(folders: SubjectFolders) -> str:
    size = read_stage(TextureParams, folders.config).resolution
    with atomic_folder(folders.resampled) as temporary:
        kept = folders.checkpoints / "resampled"
        source = resample_store(folders.samples / "textures.arrow", temporary / "textures.arrow", size, kept)
    if size > source.height:
        typer.echo(
            f"texture: warning: texture.resolution {size} is above sample.resolution {source.height}; "
            "enlarging adds texels but no detail",
            err=True,
        )
    return f"{len(source.keys())} textures, {source.height} x {source.width} to {size} x {size}, in {folders.resampled}"


if __name__ == "__main__":
    run_stage("texture", texture, __doc__ or "")
