"""Pictures that a player of assets must show: `facefolds vectors FOLDER`, and how near a player comes to them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import report_user_errors
from facefolds_core.packaging.vectors import Agreement, compare, write_vectors

LEAST = 40.0
"""dB that a player should reach. 8 bits after each layer's blending leave 50 and more, chroma placed otherwise 40."""


def command(
    folder: Annotated[Path, typer.Argument(help="Where the vectors are, or are to be.")],
    check: Annotated[
        Path | None, typer.Option(help="Folder of a player's pictures, named as in views.json, to compare.")
    ] = None,
    least: Annotated[float, typer.Option(help="dB that each must reach.", min=0, max=99)] = LEAST,
    points: Annotated[
        bool, typer.Option("--points", help="Pictures that are right with one ray a pixel suffice.")
    ] = False,
) -> None:
    """Write tiny assets with the pictures that a player must show, or compare a player's pictures with them."""
    with report_user_errors("vectors"):
        if check is None:
            typer.echo(f"vectors: {write_vectors(folder)} pictures of two assets in {folder}")
            return
        found = compare(folder, check)
        for one in found:
            typer.echo(f"{one.file}: {words_of(one, least)}")
        reached = [one for one in found if one.reaches(least)]
        rest = [one for one in found if not one.reaches(least) and one.reaches(least, points=True)]
        more = f", {len(rest)} more with one ray a pixel" if rest else ""
        typer.echo(f"vectors: {len(reached)} of {len(found)} reach {least:g} dB{more}")
        if not all(one.reaches(least, points) for one in found):
            raise typer.Exit(1)


def words_of(one: Agreement, least: float) -> str:
    """How near a picture comes; where it misses `least` dB, also to what one ray a pixel sees."""
    if one.psnr is None:
        return "missing, or of another size"
    return f"{one.psnr:.1f} dB" + ("" if one.reaches(least) else f"; to one ray a pixel {one.points:.1f} dB")
