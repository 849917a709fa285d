"""The table of a sweep, read again: as users do with other programs, the library only writes it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from facefolds_core.cluster.table import NAMES, Run


def read_runs(path: Path) -> list[Run]:
    if path.suffix == ".csv":
        types = dict.fromkeys(NAMES, pa.string())
        texts = pa_csv.ConvertOptions(null_values=[""], strings_can_be_null=True, column_types=types)
        table = pa_csv.read_csv(path, convert_options=texts)
    else:
        table = pa_parquet.read_table(path)
    return [_run(row) for row in table.to_pylist()]


def _run(row: dict[str, Any]) -> Run:
    named = {name: row.pop(name) or "" for name in NAMES}
    there = {name: value for name, value in row.items() if value is not None}
    params = {name: json.loads(v) if isinstance(v, str) else v for name, v in there.items() if "." in name}
    return Run(**named, params=params, figures={name: float(v) for name, v in there.items() if "." not in name})
