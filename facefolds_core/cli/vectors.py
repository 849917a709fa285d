"""Pictures that a player of assets must show: `facefolds vectors FOLDER`, and how near a player comes to them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import report_user_errors
from facefolds_core.packaging.vectors import compare, write_vectors

LEAST = 40.0
"""dB that a player should reach. 8 bits after each layer's blending leave 50 and more, chroma placed otherwise 40."""


def command(
    folder: Annotated[Path, typer.Argument(help="Where the vectors are, or are to be.")],
    check: Annotated[
        Path | None, typer.Option(help="Folder of a player's pictures, named as in views.json, to compare.")
    ] = None,
    least: Annotated[float, typer.Option(help="dB that each must reach.", min=0, max=99)] = LEAST,
) -> None:
    """Write tiny assets with the pictures that a player must show, or compare a player's pictures with them."""
    with report_user_errors("vectors"):
        if check is None:
            typer.echo(f"vectors: {write_vectors(folder)} pictures of two assets in {folder}")
            return
        found = compare(folder, check)
        for one in found:
            said = "missing, or of another size" if one.psnr is None else f"{one.psnr:.1f} dB"
            typer.echo(f"{one.file}: {said}")
        wrong = [one for one in found if one.psnr is None or one.psnr < least]
        typer.echo(f"vectors: {len(found) - len(wrong)} of {len(found)} reach {least:g} dB")
        if wrong:
            raise typer.Exit(1)
