"""Write an asset for Godot 3: `facefolds export-godot data/<subject>/asset OUT`; see docs/engines.md."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.asset import read_asset
from facefolds_core.cli.render import pick_level
from facefolds_core.engines.godot import write_godot
from facefolds_core.errors import report_user_errors


def command(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset: it holds manifest.json.")],
    out: Annotated[Path, typer.Argument(help="Folder to write; the add-on loads it. An earlier export is replaced.")],
    level: Annotated[str | None, typer.Option(help="Level of detail by name; the full one if left out.")] = None,
) -> None:
    """Write an asset as Godot 3 can read it: plain meshes with y up, a picture a frame."""
    with report_user_errors("godot_export"):
        found = read_asset(asset)
        chosen = pick_level(found, level)
        size = write_godot(out, chosen, found.manifest.subject)
        typer.echo(f"godot_export: {out}: {chosen.num_layers} layers, {chosen.num_frames} frames, {size / 1e6:.1f} MB")
