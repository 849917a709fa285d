"""What the cells of the matrix say: losses against the clean case, the table, the rows worth a word."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.stress_cells import CLEAN, Cell
from bench.stress_film import EXTREMES
from bench.stress_hazards import HAZARDS, Hazard
from facefolds_core.errors import UserError

EXTREME = Hazard("extreme", "extreme views", (60, 75, 85), "{} degrees")
"""The clean case seen from farther aside: no training of its own."""

ROWS: tuple[Hazard, ...] = (*HAZARDS, EXTREME)


@dataclass(frozen=True)
class Loss:
    """One field of the heat map.

    Attributes:
        mean: dB lost against the clean case of the same seed, mean over seeds; None where every one failed.
        least, most: over seeds.
        seeds: that were run and have their clean case.
        failed, astray: seeds that ended with an error; seeds that ended but did not converge.
        worst: the held-out view that lost most, mean over seeds, and what it lost; "" if none.
        worst_loss: dB.
    """

    mean: float | None
    least: float
    most: float
    seeds: int
    failed: int
    astray: int
    worst: str
    worst_loss: float


def loss_of(cells: Sequence[Cell], hazard: Hazard, strength: float, preset: str) -> Loss | None:
    """None where nothing was measured."""
    clean = {c.seed: c for c in cells if c.hazard == CLEAN.key and c.preset == preset and c.views}
    if hazard.key == EXTREME.key:
        return _extreme(list(clean.values()), strength)
    found = [c for c in cells if (c.hazard, c.strength, c.preset) == (hazard.key, strength, preset) and c.seed in clean]
    if not found:
        return None
    whole = [c for c in found if c.views]
    views = {
        name: float(np.mean([clean[c.seed].views[name] - c.views[name] for c in whole]))
        for name in (whole[0].views if whole else ())
    }
    worst = max(views, key=lambda name: views[name]) if views else ""
    lost = [_inner(clean[c.seed]) - _inner(c) for c in whole]
    astray = sum(not c.converged for c in whole)
    return _loss(lost, len(found), len(found) - len(whole), astray, worst, views.get(worst, 0.0))


def _extreme(clean: list[Cell], azimuth: float) -> Loss | None:
    if not clean:
        return None
    names = [name for name, a in EXTREMES if abs(a) == azimuth]
    views = {name: float(np.mean([_inner(c) - c.views[name] for c in clean])) for name in names}
    worst = max(views, key=lambda name: views[name])
    lost = [_inner(c) - float(np.mean([c.views[name] for name in names])) for c in clean]
    return _loss(lost, len(clean), 0, 0, worst, views[worst])


def _loss(lost: list[float], seeds: int, failed: int, astray: int, worst: str, worst_loss: float) -> Loss:
    if not lost:
        return Loss(None, 0.0, 0.0, seeds, failed, astray, worst, worst_loss)
    return Loss(float(np.mean(lost)), min(lost), max(lost), seeds, failed, astray, worst, worst_loss)


def _inner(cell: Cell) -> float:
    assert cell.inner is not None
    return cell.inner


def table(cells: Sequence[Cell], presets: Sequence[str]) -> str:
    """Markdown: one line a hazard and preset.

    Raises:
        UserError: if no clean case was measured.
    """
    parts = []
    for preset in presets:
        clean = [c for c in cells if c.hazard == CLEAN.key and c.preset == preset and c.views]
        if not clean:
            continue
        values = [_inner(c) for c in clean]
        seconds = [c.seconds for c in cells if c.preset == preset and c.views]
        parts.append(
            f"`{preset}`: clean {np.mean(values):.2f} dB (seeds {', '.join(f'{v:.2f}' for v in values)}; a flat "
            f"silhouette has {clean[0].flat:.2f}); {np.mean(seconds):.0f} s of processor time a training. dB lost:"
        )
        lines = [
            "| | weak | middle | strong | seeds | worst view, at the strongest measured |",
            "|---|---|---|---|---|---|",
        ]
        lines += [line for hazard in ROWS if (line := _line(cells, hazard, preset))]
        parts.append("\n".join(lines))
    if not parts:
        raise UserError("nothing measured yet", remedy="run `python -m bench.stress`")
    return "\n\n".join(parts)


def _line(cells: Sequence[Cell], hazard: Hazard, preset: str) -> str:
    losses = [loss_of(cells, hazard, strength, preset) for strength in hazard.strengths]
    if not any(losses):
        return ""
    fields = [
        f"{hazard.label(strength)}: {cell_text(loss, spread=True)}"
        for strength, loss in zip(hazard.strengths, losses, strict=True)
    ]
    seeds = sorted({loss.seeds for loss in losses if loss})
    last = next(loss for loss in reversed(losses) if loss)
    worst = f"{last.worst}: {last.worst_loss:.1f}" if last.worst else "-"
    return f"| {hazard.title} | {' | '.join(fields)} | {'-'.join(map(str, seeds))} | {worst} |"


def cell_text(loss: Loss | None, spread: bool = False) -> str:
    """ "1.23", with "*" where a seed did not converge, "failed" where none ended; "(0.9..1.4)" for the spread."""
    if loss is None:
        return "-"
    if loss.mean is None:
        return "failed"
    text = f"{loss.mean + 0.0:.1f}".replace("-0.0", "0.0") + ("*" if loss.astray or loss.failed else "")
    if spread and loss.seeds - loss.failed > 1:
        text += f" ({loss.least:.1f} to {loss.most:.1f})"
    return text
