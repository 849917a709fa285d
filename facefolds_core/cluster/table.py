"""The table of a sweep: one row a configuration of a subject, measured or failed, as Parquet or CSV.

Columns: `experiment`, `revision`, `subject`, `error` (strings); then one a parameter, whose name has a dot
("decimate.resolution"), null where the row leaves it as the subject has it; then one a measured figure, null where
there is none. Columns of parameters hold numbers where all their values are numbers, else JSON text ("null" where
somebody set that).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from facefolds_core.errors import UserError
from facefolds_core.files.writing import atomic_file

NAMES = ("experiment", "revision", "subject", "error")
SUFFIXES = (".parquet", ".csv")
VALIDATE = "validate_"
"""Before the name of a figure: on the cameras for validation, not on the held-out ones."""
MISSING = object()
"""In place of a value where a run lacks the key."""


@dataclass(frozen=True)
class Run:
    """One configuration of a subject.

    Attributes:
        experiment: its name.
        revision: of the experiment, "" for what lies in the working folder.
        subject: name in params.yaml.
        params: "section.key" -> value; what is left out is as the subject has it.
        figures: "psnr", "triangles", "bytes", ...
        error: why it failed, or "".
    """

    experiment: str
    subject: str
    revision: str = ""
    params: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, float] = field(default_factory=dict)
    error: str = ""


def figures_of(metrics: Mapping[str, Any]) -> dict[str, float]:
    """Scores of the asset and all costs of a metrics.json, those that are numbers; and `bytes`, all that ships.

    Scores on cameras for validation are named `validate_psnr_subject` and so on. Scores within the model's own matte
    are left out: each training has its own, so they tell nothing of which is better.
    """
    listed = dict(metrics.get("asset", {}))
    listed |= {f"{VALIDATE}{name}": value for name, value in metrics.get("validate", {}).get("asset", {}).items()}
    if metrics.get("matte") == "found":
        listed = {name: value for name, value in listed.items() if not name.endswith("_found")}
    listed |= metrics.get("cost", {})
    found = {name: float(v) for name, v in listed.items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
    if found:
        found["bytes"] = sum(found.get(name, 0.0) for name in ("mesh_bytes", "texture_bytes", "reflection_bytes"))
    return found


def write_runs(path: Path, runs: Sequence[Run]) -> None:
    """Write the table in the format that the suffix names.

    Raises:
        UserError: if it names none.
    """
    if path.suffix not in SUFFIXES:
        expected, found = " or ".join(SUFFIXES), path.suffix or "none"
        raise UserError("an unknown kind of table", file=path, expected=expected, found=found)
    columns: dict[str, pa.Array] = {name: pa.array([getattr(run, name) for run in runs], pa.string()) for name in NAMES}
    for name in _union(run.params for run in runs):
        # A null that somebody set is a value; a cell is only empty where the run lacks the key.
        values = [run.params.get(name, MISSING) for run in runs]
        columns[name] = _numbers(values) or pa.array(
            [None if v is MISSING else json.dumps(v) for v in values], pa.string()
        )
    for name in _union(run.figures for run in runs):
        columns[name] = pa.array([run.figures.get(name) for run in runs], pa.float64())
    with atomic_file(path) as temporary:
        table = pa.table(columns)
        if path.suffix == ".csv":
            pa_csv.write_csv(table, temporary)
        else:
            pa_parquet.write_table(table, temporary)


def _union(mappings: Any) -> list[str]:
    """Keys in the order in which they come first."""
    return list(dict.fromkeys(key for mapping in mappings for key in mapping))


def _numbers(values: list[Any]) -> pa.Array | None:
    """None if something else than numbers is among them; what is MISSING becomes null."""
    known = [value for value in values if value is not MISSING]
    values = [None if value is MISSING else value for value in values]
    if any(isinstance(value, bool) or not isinstance(value, (int, float)) for value in known):
        return None
    return pa.array(values, pa.int64() if all(isinstance(value, int) for value in known) else pa.float64())
