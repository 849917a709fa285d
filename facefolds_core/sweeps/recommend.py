"""Which configuration of a sweep to take: the best within a budget, or the smallest that is good enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from facefolds_core.errors import UserError
from facefolds_core.sweeps.experiments import VALIDATE
from facefolds_core.sweeps.frontier import frontier
from facefolds_core.sweeps.table import Run

INDIFFERENT = 0.05
"""dB. Nobody sees less: among configurations within it of the best, the smallest is taken."""


_HELD_OUT = ("psnr_over_plate", "psnr_subject", "psnr_found")
JUDGES = (*(f"{VALIDATE}{name}" for name in _HELD_OUT), *_HELD_OUT)
"""Figures that tell a good run from a bad one, the best first: on the cameras for validation, as long as there are any,
since the held-out ones are to stay unseen."""


@dataclass(frozen=True)
class Budget:
    """At most so much; None is no limit. The fields are named after the figures of a run.

    Attributes:
        bytes: of meshes, video and reflection together.
        triangles: of all layers.
        gpu_bytes: docs/reference/metrics.md.
        video_bits_per_second: of the texture video.
    """

    bytes: float | None = None
    triangles: float | None = None
    gpu_bytes: float | None = None
    video_bits_per_second: float | None = None

    def limits(self) -> dict[str, float]:
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}


@dataclass(frozen=True)
class _Point:
    run: Run
    bytes: float
    quality: float


def recommend(runs: Sequence[Run], budget: Budget, psnr: float | None = None) -> Run:
    """The run to take, from the frontier of quality (`judged_by`) against bytes of those within the budget.

    Without `psnr` it is the best one, or a smaller one that is at most INDIFFERENT worse. With it, the smallest one
    that reaches it.

    Args:
        runs: of one subject; failed ones are passed over.
        psnr: dB that must be reached.

    Raises:
        UserError: if there is no limit and no quality, nothing measured, or nothing that satisfies them; it names the
            nearest.
    """
    limits = budget.limits()
    if not limits and psnr is None:
        raise UserError("neither a budget nor a quality", remedy="give at least one of them")
    key = judged_by(runs)
    points = [
        _Point(run, size, db) for run in runs if (size := run.figure("bytes")) and (db := run.figure(key)) is not None
    ]
    within = [p for p in points if all(_cost(p.run, name) <= limit for name, limit in limits.items())]
    if not within:
        raise _nothing_within(points, limits)
    front = [within[i] for i in frontier([(p.bytes, p.quality) for p in within])]
    wanted = front[-1].quality - INDIFFERENT if psnr is None else psnr
    for point in front:
        if point.quality >= wanted:
            return point.run
    best = front[-1]
    raise UserError(
        "no measured configuration is good enough" + (" within the budget" if limits else ""),
        expected=f"{psnr:.2f} dB",
        found=f"at most {best.quality:.2f} dB ({best.run.experiment}, {best.bytes:.0f} bytes)",
        remedy="ask for less, allow more, or add finer configurations to the sweep",
    )


def judged_by(runs: Sequence[Run]) -> str:
    """The figure by which runs are compared: the best of `JUDGES` that all of them have.

    Raises:
        UserError: if nothing was measured, or only what cannot tell a good run from a bad one: PSNR of the whole frame
            rewards whoever paints the room, and each model's own matte is its own judge.
    """
    measured = [run for run in runs if run.figure("bytes")]
    if not measured:
        raise UserError("nothing measured", found=f"{len(runs)} rows, none with scores", remedy="run the sweep first")
    for name in JUDGES:
        if all(run.figure(name) is not None for run in measured):
            return name
    lacking = [run.experiment for run in measured if all(run.figure(name) is None for name in JUDGES)]
    raise UserError(
        "these runs cannot be told apart: it is not known where the subject is in the scored pictures",
        expected="masks or mattes of the scored cameras, or clean plates",
        found=f"PSNR of the whole frame alone ({lacking[0]}), which rewards painted rooms"
        if lacking
        else "no score that all of them have",
        remedy="add them to the capture, or name mattes (`subjects.NAME.mattes`; docs/guide/subjects.md), run "
        "the sweep again and collect it",
    )


def _cost(run: Run, name: str) -> float:
    value = run.figure(name)
    return float("inf") if value is None else value


def _nothing_within(points: list[_Point], limits: dict[str, float]) -> UserError:
    least = {name: min(points, key=lambda p: _cost(p.run, name)) for name in limits}
    found = "; ".join(f"{name} {_cost(p.run, name):.0f} at least ({p.run.experiment})" for name, p in least.items())
    return UserError(
        "no measured configuration is within the budget",
        expected=", ".join(f"{name} at most {limit:.0f}" for name, limit in limits.items()),
        found=found,
        remedy="allow more, or add coarser configurations to the sweep",
    )
