"""What earlier runs of a subject scored: kept beside the report, so that the next one can say what has changed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_json
from facefolds_core.paths import SubjectFolders
from facefolds_core.reporting.facts import read_metrics
from facefolds_core.reporting.verdicts import Row, verdicts

HISTORY_NAME, REFERENCE_NAME = "report_runs.json", "reference.json"
MOST_RUNS = 20
REMEDY = "delete it: the next report begins a new one"


@dataclass(frozen=True)
class Comparison:
    """This run beside another one.

    Attributes:
        name: of the other, in words.
        rows: metric by metric.
    """

    name: str
    rows: list[Row]

    @property
    def words(self) -> str:
        """The verdict in a line."""
        found = {
            word: [row["name"].split(",")[0] for row in self.rows if row["word"] == word]
            for word in ("better", "worse")
        }
        parts = [f"{word} in {', '.join(names)}" for word, names in found.items() if names]
        return f"{'; '.join(parts) or 'the same to the eye'}"


def compared(folders: SubjectFolders, metrics: dict[str, Any], made: str, reference: Path | None) -> list[Comparison]:
    """With the run before this one, and with a reference; notes this run.

    Args:
        made: when, in words.
        reference: metrics.json of another run; None for `reference.json` in the subject's folder, where there is one.

    Raises:
        UserError: if the notes or the reference are garbled.
    """
    found = []
    last = note_run(folders.root / HISTORY_NAME, metrics, made)
    if last is not None:
        found.append(Comparison(f"the run before ({last['made']})", verdicts(metrics, last["metrics"])))
    own = folders.root / REFERENCE_NAME
    reference = reference or (own if own.is_file() else None)
    if reference is not None:
        found.append(Comparison("the reference", verdicts(metrics, read_metrics(reference))))
    return [one for one in found if one.rows]


def _known(value: Any) -> Any:
    """JSON knows no NaN."""
    if isinstance(value, dict):
        return {key: _known(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_known(part) for part in value]
    return value if not isinstance(value, float) or math.isfinite(value) else None


def note_run(path: Path, metrics: dict[str, Any], made: str) -> dict[str, Any] | None:
    """Adds this run to the notes, unless it is the last of them; returns the one before it, None for the first.

    Raises:
        UserError: if the notes are garbled.
    """
    runs = read_json(path, REMEDY) if path.is_file() else []
    if not isinstance(runs, list) or not all(
        isinstance(run, dict) and isinstance(run.get("metrics"), dict) and isinstance(run.get("made"), str)
        for run in runs
    ):
        raise UserError("the notes of earlier runs are garbled", file=path, remedy=REMEDY)
    metrics = _known(metrics)
    if not runs or runs[-1]["metrics"] != metrics:
        runs = [*runs, {"made": made, "metrics": metrics}][-MOST_RUNS:]
        write_json(path, runs)
    return runs[-2] if len(runs) > 1 else None
