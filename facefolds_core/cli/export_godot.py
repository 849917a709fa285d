"""`facefolds export-godot data/<subject>/asset OUT`: `facefolds export godot` by its older name."""

from __future__ import annotations

import typer

from facefolds_core.cli.export import Asset, Level, Out, export
from facefolds_core.errors import report_user_errors


def command(asset: Asset, out: Out, level: Level = None) -> None:
    """Write an asset as Godot 3 can read it: plain meshes with y up, a picture a frame."""
    with report_user_errors("godot_export"):
        typer.echo(f"godot_export: {out}: {export('godot', asset, out, level)}")
