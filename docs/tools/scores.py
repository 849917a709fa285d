"""The README's table of scores and costs, so that no figure is typed by hand.

python -m docs.tools.scores            prints it, from data/<subject>/metrics.json
python -m docs.tools.scores --write    replaces it in README.md
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bench.tables import markdown, number, replace_between, size, spaced
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.terminal import HEADLINE_WORDS

README = ("<!-- results: written by docs/tools/scores.py -->", "<!-- end of results -->")
BYTES = ("mesh_bytes", "texture_bytes", "reflection_bytes")


def readme_table(data: Path) -> str:
    """What was filmed and held out, what `headline` says of asset and model, and what the asset costs; one line a
    subject, each from its metrics.json, scene/scene.json and model/training.json."""
    files = sorted(data.glob("*/metrics.json"))
    if not files:
        raise UserError("no results", file=data, expected="<subject>/metrics.json", remedy="run `make repro` first")
    head = ["subject", "PSNR, dB", "over", "inside", "what moves", "high SSIM", "cameras, frames, pixels"]
    head += ["held out (degrees from front)", "triangles", "meshes + video (+ reflection)", "training"]
    return markdown(head, [_readme_row(path) for path in files])


def _readme_row(path: Path) -> list[str]:
    metrics, scene = read_json(path), read_json(path.parent / "scene" / "scene.json")
    key, cost = metrics["headline"], metrics["cost"]
    preset = read_json(path.parent / "model" / "training.json")["preset"]
    held = {c["name"]: _from_front(c["w2c"]) for c in scene["cameras"] if c["split"] == "holdout"}
    largest = max(scene["cameras"], key=lambda camera: camera["width"] * camera["height"])
    filmed = [len(scene["cameras"]), len(scene["frame_ids"]), f"{largest['height']} x {largest['width']}"]
    names = ", ".join(f"{name} ({angle:.0f})" for name, angle in held.items())
    angles = [f"{value:.0f}" for value in (min(held.values()), max(held.values()))] if held else []
    return [
        f"`{path.parent.name}`" + ("" if preset == "fast" else f", {preset}"),
        f"**{number(metrics['asset'][key], 2)}**",
        HEADLINE_WORDS[key],
        number(metrics["asset"].get("psnr_interior"), 2),
        number(metrics["asset"].get("psnr_moving"), 2),
        number(metrics["asset"].get("ssim_high"), 3),
        ", ".join(map(str, filmed)),
        names if len(held) < 4 else f"{len(held)} ({' to '.join(angles)})",
        spaced(cost["triangles"]),
        " + ".join(size(cost[name]) for name in BYTES if cost.get(name)),
        f"{cost['train_seconds']:.0f} s",
    ]


def _from_front(w2c: Sequence[Sequence[float]]) -> float:
    """Degrees between the direction in which a camera stands and the front, +x."""
    centre = -np.array(w2c)[:, :3].T @ np.array(w2c)[:, 3]
    return float(np.degrees(np.arccos(centre[0] / np.linalg.norm(centre))))


def main(
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    write: Annotated[bool, typer.Option("--write", help="Replace the table in README.md.")] = False,
) -> None:
    """Print (or write into README.md) the table of scores and costs."""
    with report_user_errors("scores"):
        text = readme_table(data)
        if write:
            replace_between(Path("README.md"), *README, text)
        typer.echo("scores: written into README.md" if write else text)


if __name__ == "__main__":
    typer.run(main)
