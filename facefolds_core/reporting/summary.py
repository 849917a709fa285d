"""One page over all subjects: state, score, bytes, seconds. `facefolds run` writes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from facefolds_core.files import write_text
from facefolds_core.paths import SubjectFolders
from facefolds_core.reporting import words
from facefolds_core.reporting.build import REPORT_NAME
from facefolds_core.reporting.facts import read_mapping
from facefolds_core.sweeps.experiments import figures_of

SUMMARY_NAME = "summary.html"


@dataclass(frozen=True)
class Row:
    """A subject's line, in words."""

    name: str
    state: str
    score: str
    bytes: str
    seconds: str
    error: str
    report: str | None


def row_of(data: Path, name: str, state: str, seconds: float | None = None, error: str = "") -> Row:
    """A line from what lies in the subject's folder.

    Args:
        state: "done", "cached", "failed", "scored", ...
        seconds: that the job took; None for all of its stages' last runs together.
    """
    folders = SubjectFolders(data / name)
    figures = figures_of(read_mapping(folders.metrics) or {})
    if seconds is None:
        timings = [read_mapping(path) or {} for path in folders.timing("x").parent.glob("*.json")]
        seconds = sum(float(timing.get("seconds", 0)) for timing in timings)
    return Row(
        name=name,
        state=state,
        score=words.number(figures.get("psnr_subject", figures.get("psnr"))),
        bytes=words.size(figures.get("bytes")),
        seconds=words.duration(seconds),
        error=error,
        report=f"{name}/{REPORT_NAME}" if (folders.root / REPORT_NAME).is_file() else None,
    )


def write_summary(data: Path, rows: Sequence[Row]) -> Path:
    """Write `summary.html` into the folder of all subjects; returns its path."""
    environment = Environment(
        loader=PackageLoader("facefolds_core.reporting", "page"), autoescape=True, undefined=StrictUndefined
    )
    assert environment.loader is not None
    css = Markup(environment.loader.get_source(environment, "report.css")[0])
    path = data / SUMMARY_NAME
    write_text(path, environment.get_template("summary.html.j2").render(css=css, rows=rows))
    return path
