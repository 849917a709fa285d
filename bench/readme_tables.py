"""Write the tables of the README from data/<subject>/metrics.json, so that no figure is typed by hand.

python -m bench.readme_tables            prints them
python -m bench.readme_tables --write    replaces the part of README.md between the markers
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from bench.markers import replace_between
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import read_json, write_text

START, END = "<!-- results: written by bench/readme_tables.py -->", "<!-- end of results -->"

# FaceFolds, its tables of comparisons (row 1) and of mesh resolution (row 2, R^m = 32). It gives no training time.
PAPER_ROWS = [
    "| paper, 5 Multiface subjects, 768x500 | 25.49 | 0.788 | LPIPS 0.356 | | | | | 118 MiB | V100 |",
    "| paper, 002914589, R^m = 32 | 29.12 | 0.831 | LPIPS 0.291 | | | | 9 962 | 170 KB + 5.9 MB | V100 |",
]
HEADER = [
    "| | PSNR | SSIM | perceptual | PSNR of the subject: asset | diffuse | model "
    "| triangles | mesh + video | trained on, for |",
    "|---|---|---|---|---|---|---|---|---|---|",
]


def number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.0f} KB"


def row(subject: str, preset: str, metrics: dict[str, Any]) -> str:
    """One table row of a subject's metrics.json: the asset over the whole frame, then all three over the subject."""
    asset, cost = metrics["asset"], metrics["cost"]
    lpips, st_lpips = asset.get("lpips"), asset.get("st_lpips")
    perceptual = f"LPIPS {lpips:.3f}" if lpips is not None else f"ST-LPIPS {number(st_lpips, 3)}"
    cells = [
        f"ours, `{subject}`, {preset}",
        number(asset["psnr"], 2),
        number(asset["ssim"], 3),
        perceptual,
        *(number(metrics[variant].get("psnr_subject"), 2) for variant in ("asset", "diffuse", "model")),
        f"{cost['triangles']:,}".replace(",", " "),
        f"{size(cost['mesh_bytes'])} + {size(cost['texture_bytes'])}",
        f"{cost['device']}, {cost['train_seconds']:.0f} s",
    ]
    return "| " + " | ".join(cells) + " |"


def tables(data: Path) -> str:
    files = sorted(data.glob("*/metrics.json"))
    if not files:
        raise UserError("no results", file=data, expected="<subject>/metrics.json", remedy="run `make repro` first")
    rows = []
    for path in files:
        preset = read_json(path.parent / "model" / "training.json")["preset"]
        rows.append(row(path.parent.name, f"preset `{preset}`", read_json(path)))
    return "\n".join([*HEADER, *PAPER_ROWS, *rows])


def main(
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    write: Annotated[bool, typer.Option("--write", help="Replace the tables in README.md.")] = False,
) -> None:
    """Print (or write into README.md) the tables of scores and costs, ours beside the paper's."""
    with report_user_errors("readme_tables"):
        text = tables(data)
        if not write:
            typer.echo(text)
            return
        readme = Path("README.md")
        write_text(readme, replace_between(readme.read_text(encoding="utf-8"), START, END, text))
        typer.echo(f"readme_tables: tables written into {readme}")


if __name__ == "__main__":
    typer.run(main)
