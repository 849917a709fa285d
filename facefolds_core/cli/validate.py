"""Check an asset and say what is wrong with it: `facefolds validate data/<subject>/asset`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.manifest_file import MANIFEST_NAME, parse_manifest
from facefolds_core.asset.validation import summary, validate_asset
from facefolds_core.errors import report_user_errors


def command(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset: it holds manifest.json; or a .glb with a video.")],
) -> None:
    """Check an asset's manifest, checksums, meshes and every frame of its video; exit status 1 if anything is wrong."""
    with report_user_errors("validate"):
        glb = asset.suffix.lower() == ".glb"
        problems = check_glb(asset) if glb else validate_asset(asset)
        if problems:
            typer.echo(f"{asset}: not a sound asset", err=True)
            for problem in problems:
                typer.echo(f"  {problem}", err=True)
            raise typer.Exit(1)
        said = "Its layers and video are; gltf-validator says whether the rest is glTF."
        typer.echo(f"{asset}: sound. {said if glb else summary(parse_manifest(asset / MANIFEST_NAME))}")
