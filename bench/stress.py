"""Where methods fail: hazards in three strengths, measured as what they cost on clean held-out views of the actor.

Every cell is a training; what is measured is kept in bench/results/stress.json as soon as it is there, and what is
there is not measured again. Then a heat map, pictures of the worst cells, and the tables in docs/limits.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bench.common import words
from bench.markers import replace_between
from bench.stress_cells import CUT, RESULTS, Cell, keep_cell, plan_cells, read_cells, run_cell
from bench.stress_draw import draw_heat_map, draw_worst
from bench.stress_tables import table
from facefolds_core.errors import report_user_errors
from facefolds_core.files import write_text

HEAT_MAP = Path("docs/images/stress.png")
WORST = Path("docs/images/stress_worst.jpg")
PAGE = Path("docs/limits.md")
START, END = "<!-- written by bench/stress.py -->", "<!-- end of what bench/stress.py writes -->"
SEEDS = {"fast": 3, "paper": 1}
"""Of each preset, without --seeds: with these the matrix takes less than an hour on two idle cores."""


def describe(cell: Cell) -> str:
    """One line for the terminal."""
    what = f"{cell.preset}, {cell.hazard} {cell.strength:g}, seed {cell.seed}"
    if cell.inner is None:
        return f"{what}: failed: {cell.failure}"
    return f"{what}: {cell.inner:.2f} dB after {cell.seconds:.1f} s" + ("" if cell.converged else ", not converged")


def main(
    only: Annotated[str, typer.Option(help="Rows, comma-separated: the keys in bench/stress_hazards.py.")] = "",
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = ",".join(CUT),
    seeds: Annotated[int, typer.Option(help="How many; 0 is 3 of fast and 1 of paper.")] = 0,
    draw_only: Annotated[bool, typer.Option("--draw-only", help="Only draw and print.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Measure again what is there.")] = False,
    data: Annotated[Path, typer.Option(help="Folder for films and pictures.")] = Path("data/actor/bench/stress"),
    results: Annotated[Path, typer.Option(help="File that cells are added to.")] = RESULTS,
) -> None:
    """Measure the matrix, draw it, print its tables and write them into docs/limits.md."""
    with report_user_errors("stress"):
        chosen = words(presets)
        wanted = {preset: seeds or SEEDS.get(preset, 1) for preset in chosen}
        blanks = [c for c in plan_cells(words(only), chosen, max(wanted.values())) if c.seed < wanted[c.preset]]
        done = set() if force else {cell.key for cell in read_cells(results)}
        for blank in [] if draw_only else [blank for blank in blanks if blank.key not in done]:
            cell = run_cell(blank, data / "films", data / "pictures")
            keep_cell(results, cell)
            typer.echo(f"stress: {describe(cell)}")
        cells = read_cells(results)
        text = table(cells, list(CUT))
        typer.echo(f"\n{text}")
        write_text(PAGE, replace_between(PAGE.read_text(encoding="utf-8"), START, END, text))
        draw_heat_map(cells, [preset for preset in CUT if any(c.preset == preset for c in cells)], HEAT_MAP)
        draw_worst(cells, "fast", data / "pictures", WORST)


if __name__ == "__main__":
    typer.run(main)
