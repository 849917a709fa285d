"""One file that plays by itself: `facefolds export-html data/<subject>/asset --out face.html`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.asset import read_asset
from facefolds_core.asset.single_page import write_single_page
from facefolds_core.cli.export import Asset, Level
from facefolds_core.cli.render import pick_level
from facefolds_core.errors import report_user_errors
from facefolds_core.serving.player import find_player


def command(
    asset: Asset,
    out: Annotated[Path, typer.Option(help="HTML file to write. An earlier one is replaced.")],
    level: Level = None,
) -> None:
    """Write an asset and the player into one HTML file: a double click plays it, without a server."""
    with report_user_errors("export-html"):
        found = read_asset(asset)
        entry = pick_level(found, level).entry
        size = write_single_page(out, found.folder, found.manifest, entry, find_player())
        typer.echo(f"export-html: {out}: level {entry.name}, {size / 2**20:.1f} MiB")
