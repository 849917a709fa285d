"""Markdown tables of what was measured, and their places between the markers of a document."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.hazard_rows import FILM, ROWS, Hazard, Loss, loss_of
from bench.results import ROOT, Cell, Row
from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json, write_text

PAPER: dict[str, list[dict[str, Any]]] = read_json(ROOT / "bench" / "results" / "paper.json")
"""Its ablations as printed (docs/research/ablations.md). `other_bytes` is what `disk` leaves out."""
AXES = {"layers": "layers N", "mesh": "R^m", "texture": "R^t"}
RATES = {"paper": "paper"} | {codec: f"ours, {codec}" for codec in ("h264", "vp9", "av1")} | {"h264x32": "ours32, h264"}
"""Series of bytes against accuracy -> in tables and charts."""


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([f"| {' | '.join(head)} |".replace("|  |", "| |"), "|---" * len(head) + "|", *lines])


def wide(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same of many columns, without spaces: nobody reads it as text."""
    return markdown(head, rows).replace(" | ", "|").replace("| ", "|").replace(" |", "|")


def replace_between(path: Path, start: str, end: str, text: str) -> None:
    """Write `text` between two markers of a document.

    Raises:
        UserError: if a marker is missing.
    """
    head, found, rest = path.read_text(encoding="utf-8").partition(start)
    _, closed, tail = rest.partition(end)
    if not found or not closed:
        raise UserError("no place for a table", file=path, expected=f"{start} ... {end}", remedy="put the markers back")
    write_text(path, f"{head}{start}\n{text}\n{end}{tail}")


def number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def size(count: float) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.0f} KB"


def spaced(count: int) -> str:
    return f"{count:,}".replace(",", " ")


def sweep_table(rows: Sequence[Row], sweep: str, subject: str) -> str:
    """A subject's cells of one sweep, the paper's printed row beside each."""
    own = {row.value: row for row in rows if (row.sweep, row.subject) == (sweep, subject)}
    paper = {point["value"]: point for point in PAPER[sweep]}
    disk = {"layers": "disk", "mesh": "disk (mesh)", "texture": "disk (texture)"}[sweep]
    head = [AXES[sweep], "PSNR of the subject", "SSIM", "ST-LPIPS"]
    head += ["triangles", "mesh", "texture", "GPU", "pictures a second", "seconds"]
    head += ["paper: PSNR", "SSIM", "LPIPS", "triangles", disk]
    lines = []
    for value in sorted({*own, *paper}, reverse=True):
        point = paper.get(value)
        theirs = [""] * 5
        if point:
            theirs = [f"{point['psnr']:.2f}", f"{point['ssim']:.3f}", f"{point['lpips']:.3f}"]
            theirs += [spaced(point["triangles"]), point["disk"]]
        lines.append([str(value), *_own_cells(own.get(value)), *theirs])
    return wide(head, lines)


def _own_cells(row: Row | None) -> list[str]:
    if row is None or row.failure:
        return ["not measured" if row is None else f"failed: {row.failure}", *[""] * 8]
    names = ("psnr", "ssim", "st_lpips")
    scores = [number(row.figures.get(f"{name}_subject"), 2 if name == "psnr" else 3) for name in names]
    taken = [row.figures.get(f"{what}_seconds", 0.0) for what in ("train", "export")]
    seconds = " + ".join(f"{seconds:.0f}" for seconds in taken if seconds)
    sizes = [size(row.figures[name]) for name in ("mesh_bytes", "texture_bytes", "gpu_bytes")]
    pictures = number(row.figures.get("pictures_a_second"), 1)
    return [*scores, spaced(int(row.figures["triangles"])), *sizes, pictures, seconds]


def hazard_tables(cells: Sequence[Cell]) -> str:
    """One table a subject and preset, one line a hazard.

    Raises:
        UserError: if no clean case was measured.
    """
    groups = dict.fromkeys((c.subject, c.preset) for c in cells if c.hazard == "clean" and c.psnr is not None)
    if not groups:
        raise UserError("nothing measured yet", remedy="run `python -m bench.hazards`")
    return "\n\n".join(_hazard_table(cells, *group) for group in sorted(groups, key=lambda g: (g[0] != FILM, g)))


def _hazard_table(cells: Sequence[Cell], subject: str, preset: str) -> str:
    own = [c for c in cells if (c.subject, c.preset) == (subject, preset)]
    clean = {c.seed: c for c in own if c.hazard == "clean" and c.psnr is not None}
    values = [c.psnr for _, c in sorted(clean.items()) if c.psnr is not None]
    seconds = np.mean([c.seconds for c in own if c.psnr is not None])
    flat = f"; a flat silhouette has {clean[min(clean)].flat:.2f}" if clean[min(clean)].flat else ""
    name = f"`{preset}`" if subject == FILM else f"`{preset}` on `{subject}`, its whole budget"
    text = f"{name}: clean {np.mean(values):.2f} dB (seeds {', '.join(f'{v:.2f}' for v in values)}{flat}); "
    text += f"{seconds:.0f} s of processor time a training."
    if subject == FILM:
        lines = [line for hazard in ROWS if (line := _hazard_line(own, hazard))]
        head = ["", "weak", "middle", "strong", "seeds", "worst view, at the strongest measured"]
        return f"{text} dB lost:\n\n{wide(head, lines)}"
    found = dict.fromkeys((c.hazard, c.strength) for c in own if c.hazard != "clean")
    known = {hazard.key: hazard for hazard in ROWS}
    named = [(known.get(key, Hazard(key, key, (0, 0, 0), "{} units")), strength) for key, strength in found]
    rows = [[h.title, h.label(strength), cell_text(loss_of(own, h, strength), True, 2)] for h, strength in named]
    return f"{text} dB lost:\n\n{markdown(['', 'strength', 'dB lost'], rows)}" if rows else text


def _hazard_line(cells: Sequence[Cell], hazard: Hazard) -> list[str]:
    losses = [loss_of(cells, hazard, strength) for strength in hazard.strengths]
    if not any(losses):
        return []
    pairs = zip(hazard.strengths, losses, strict=True)
    fields = [f"{hazard.label(strength)}: {cell_text(loss, spread=True)}" for strength, loss in pairs]
    seeds = sorted({loss.seeds for loss in losses if loss})
    last = next(loss for loss in reversed(losses) if loss)
    worst = f"{last.worst}: {last.worst_loss:.1f}" if last.worst else "-"
    return [hazard.title, *fields, "-".join(map(str, seeds)), worst]


def cell_text(loss: Loss | None, spread: bool = False, digits: int = 1) -> str:
    """ "1.2", with "*" where a seed did not converge, "failed" where none ended; "(0.9 to 1.4)" for the spread."""
    if loss is None or loss.mean is None:
        return "-" if loss is None else "failed"
    zero = number(0.0, digits)
    text = number(loss.mean, digits).replace(f"-{zero}", zero) + ("*" if loss.astray or loss.failed else "")
    if spread and loss.seeds - loss.failed > 1:
        text += f" ({number(loss.least, digits)} to {number(loss.most, digits)})"
    return text


def rate_tables(rows: Sequence[Row]) -> str:
    """Bytes of each series at the qualities of the first one's rows, and its PSNR at their bytes."""
    found = {name: [r for r in rows if r.sweep == name] for name in RATES}
    series = {name: own for name, own in found.items() if own}
    anchors = sorted(next(iter(series.values())), key=lambda row: -row.bytes)

    def smaller(anchor: Row, own: Sequence[Row]) -> str:
        found = interpolated(anchor.psnr, [(r.psnr, float(np.log(r.bytes))) for r in own])
        better = [r.bytes for r in own if r.psnr >= anchor.psnr]
        most = f"at most {min(better) / 1000:.0f} kB" if better else "out of reach"
        return most if found is None else f"{np.exp(found) / 1000:.0f} kB"

    def better(anchor: Row, own: Sequence[Row]) -> str:
        found = interpolated(float(np.log(anchor.bytes)), [(float(np.log(r.bytes)), r.psnr) for r in own])
        fewer = [r.psnr for r in own if r.bytes <= anchor.bytes]
        least = f"at least {max(fewer):.2f} dB" if fewer else "larger"
        return least if found is None else f"{found:.2f} dB"

    names = [RATES[name] for name in series]
    sizes = [[f"{a.psnr:.2f} dB", *(smaller(a, own) for own in series.values())] for a in anchors]
    qualities = [[f"{a.bytes / 1000:.0f} kB", *(better(a, own) for own in series.values())] for a in anchors]
    return markdown(["held-out PSNR", *names], sizes) + "\n\n" + markdown(["bytes", *names], qualities)


def interpolated(at: float, points: Sequence[tuple[float, float]]) -> float | None:
    """Linear between points (x, y); None beyond their ends."""
    ordered = sorted(points)
    if not ordered or not ordered[0][0] <= at <= ordered[-1][0]:
        return None
    return float(np.interp(at, [x for x, _ in ordered], [y for _, y in ordered]))
