"""What the sweeps measured: one JSON file that grows by one row a cell, and its tables beside the paper's."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from bench.markers import replace_between
from bench.paper import PAPER
from bench.results import read_entries
from facefolds_core.files import write_json

VERSION = 1
Name = Literal["layers", "mesh", "texture"]
AXES: dict[Name, str] = {"layers": "layers N", "mesh": "R^m", "texture": "R^t"}


class Row(BaseModel):
    """One cell, measured or failed.

    Attributes:
        sweep, subject, value: which cell.
        params: "section.key" -> value of what differs from the subject's configuration.
        key: digest of its configuration, code and data: a cell of the same key need not be measured again.
        commit: of the code, "+" if tracked files had been changed since.
        scores: of the shipped asset, docs/metrics.md; empty if it failed.
        cost: its sizes, docs/metrics.md; empty if it failed.
        pictures_a_second: that the OpenGL renderer draws, bench/drawing_speed.py; 0 where not measured.
        renderer: what drew them.
        train_seconds, export_seconds: processor seconds, on all threads together, of the stages that the sweep's axis
            concerns; 0 where they were not run for it.
        failure: the error's first line, or "".
        date: UTC, ISO 8601.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    sweep: Name
    subject: str
    value: Annotated[int, Field(ge=1)]
    params: dict[str, int]
    key: str
    commit: str
    machine: str
    scores: dict[str, float | None] = {}
    cost: dict[str, int] = {}
    pictures_a_second: Annotated[float, Field(ge=0)] = 0.0
    renderer: str = ""
    train_seconds: float = 0.0
    export_seconds: float = 0.0
    failure: str = ""
    date: str

    @property
    def bytes(self) -> int:
        return self.cost["mesh_bytes"] + self.cost["texture_bytes"]

    def cell(self) -> tuple[str, str, int]:
        return self.sweep, self.subject, self.value

    def score(self, name: str) -> float | None:
        """Of the subject where the capture has masks, else of the whole frame."""
        masked = self.scores.get("psnr_subject") is not None
        return self.scores.get(f"{name}_subject" if masked else name)


def read_rows(path: Path) -> list[Row]:
    """All rows, one a cell.

    Raises:
        UserError: if the file is not one of these.
    """
    return read_entries(path, "rows", VERSION, Row)


def add_row(path: Path, row: Row) -> None:
    """Keep it in place of the same cell's last one. The file is read again: others may have added to it."""
    kept = [other for other in read_rows(path) if other.cell() != row.cell()]
    rows = sorted([*kept, row], key=lambda r: (r.sweep, r.subject, -r.value))
    write_json(path, {"version": VERSION, "rows": [r.model_dump(mode="json") for r in rows]})


def size(count: float) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.0f} KB"


def table(rows: list[Row], sweep: Name, subject: str) -> str:
    """Markdown: a subject's cells of one sweep, the paper's printed row beside each."""
    own = {row.value: row for row in rows if (row.sweep, row.subject) == (sweep, subject)}
    paper = {point.value: point for point in PAPER[sweep]}
    disk = {"layers": "disk", "mesh": "disk (mesh)", "texture": "disk (texture)"}[sweep]
    header = (
        f"| {AXES[sweep]} | PSNR of the subject | SSIM | ST-LPIPS | whole frame: PSNR | SSIM | ST-LPIPS | triangles "
        f"| mesh | texture | GPU | pictures a second | seconds | paper: PSNR | SSIM | LPIPS | triangles | {disk} |"
    )
    lines = [header, "|---" * 18 + "|"]
    for value in sorted({*own, *paper}, reverse=True):
        lines.append(f"| {value} | " + " | ".join([*_ours(own.get(value)), *_published(sweep, value)]) + " |")
    return "\n".join(lines)


def _ours(row: Row | None) -> list[str]:
    if row is None:
        return ["not measured", *[""] * 11]
    if row.failure:
        return [f"failed: {row.failure}", *[""] * 11]
    cost = row.cost
    return [
        *(
            number(row.scores.get(f"{name}{region}"), 2 if name == "psnr" else 3)
            for region in ("_subject", "")
            for name in ("psnr", "ssim", "st_lpips")
        ),
        f"{cost['triangles']:,}".replace(",", " "),
        size(cost["mesh_bytes"]),
        size(cost["texture_bytes"]),
        size(cost["gpu_bytes"]),
        f"{row.pictures_a_second:.1f}" if row.pictures_a_second else "",
        " + ".join(f"{seconds:.0f}" for seconds in (row.train_seconds, row.export_seconds) if seconds),
    ]


def _published(sweep: Name, value: int) -> list[str]:
    for point in PAPER[sweep]:
        if point.value == value:
            triangles = f"{point.triangles:,}".replace(",", " ")
            return [f"{point.psnr:.2f}", f"{point.ssim:.3f}", f"{point.lpips:.3f}", triangles, point.disk]
    return [""] * 5


def number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def with_tables(text: str, rows: list[Row]) -> str:
    """The document with the tables of all subjects between each sweep's markers.

    Raises:
        UserError: if a marker is missing.
    """
    for sweep in AXES:
        start, end = f"<!-- {sweep}: written by bench/sweeps.py draw -->", f"<!-- end of {sweep} -->"
        subjects = sorted({row.subject for row in rows if row.sweep == sweep})
        tables = "\n\n".join(f"`{subject}`:\n\n{table(rows, sweep, subject)}" for subject in subjects)
        text = replace_between(text, start, end, tables)
    return text
