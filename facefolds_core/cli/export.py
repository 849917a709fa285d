"""Write an asset for another program: `facefolds export godot data/<subject>/asset OUT`; see docs/guide/engines.md."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.asset import read_asset
from facefolds_core.cli.render import pick_level
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.registry import EXPORTERS

Asset = Annotated[Path, typer.Argument(help="Folder of the asset: it holds manifest.json.")]
Out = Annotated[Path, typer.Argument(help="File or folder to write. An earlier export is replaced.")]
Level = Annotated[str | None, typer.Option(help="Level of detail by name; the full one if left out.")]


def command(
    program: Annotated[str, typer.Argument(help=f"What for: {', '.join(EXPORTERS.names)}.")],
    asset: Asset,
    out: Out,
    level: Level = None,
) -> None:
    """Write an asset as another program can read it."""
    with report_user_errors("export"):
        typer.echo(f"export: {out}: {export(program, asset, out, level)}")


def export(program: str, asset: Path, out: Path, level: str | None) -> str:
    """What was written, in words.

    Raises:
        UserError: for an asset that is damaged, a level or a program that there is not, and what the exporter refuses.
    """
    if program not in EXPORTERS.names:
        raise UserError(
            "no such exporter",
            expected=f"one of {', '.join(EXPORTERS.names)}",
            found=program,
            remedy="`facefolds export --help` lists them",
        )
    found = read_asset(asset)
    words: str = EXPORTERS[program].export(out, pick_level(found, level), found.manifest.subject)
    return words
