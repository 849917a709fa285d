"""The fuzzers at any length: `python -m tests.hostile --count 300`. Exit status 1 if any found a defect."""

from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer


def main(
    count: Annotated[int, typer.Option(min=1, help="Damaged inputs (or kills) a fuzzer.")] = 300,
    seed: Annotated[int, typer.Option(help="Of all fuzzers.")] = 0,
    only: Annotated[str, typer.Option(help="One fuzzer, by its name.")] = "",
) -> None:
    """Run all fuzzers; print a row of counts for each, and every defect with how to repeat it."""
    names = [path.stem.removeprefix("fuzz_") for path in sorted(Path(__file__).parent.glob("fuzz_*.py"))]
    defects = []
    typer.echo("| fuzzer | tried | accepted | refused | crashed | hung | harmed | kept wrong |\n|" + "---|" * 8)
    for name in [name for name in names if only in ("", name)]:
        with tempfile.TemporaryDirectory() as folder:
            c = importlib.import_module(f"tests.hostile.fuzz_{name}").run(count, seed, Path(folder))
        row = [name, c.tried, c.accepted, c.refused, *map(len, (c.crashed, c.hung, c.harmed, c.kept_wrong))]
        typer.echo("| " + " | ".join(map(str, row)) + " |")
        defects += c.defects
    if defects:
        sys.exit("\n".join(defects))


if __name__ == "__main__":
    typer.run(main)
