"""Rows of what `dvc exp show --json` says, cut down to what is read."""

from __future__ import annotations

from typing import Any

import pytest

from bench.experiments import runs_of
from facefolds_core.errors import UserError


def data(r: int, t: int, psnr: dict[str, float]) -> dict[str, Any]:
    params = {
        "subjects": {"actor": {"source": "actor", "texture": {"resolution": t}}, "anna": {"source": "multiface"}},
        "decimate": {"resolution": r},
        "texture": {"resolution": 512},
        "evaluate": {},
    }
    metrics: dict[str, Any] = {"data/anna/metrics.json": {"error": {"msg": "No storage files available"}}}
    for name, value in psnr.items():
        cost = {"mesh_bytes": r, "texture_bytes": t, "device": "cpu"}
        metrics[f"data/{name}/metrics.json"] = {"data": {"asset": {"psnr": value, "lpips": None}, "cost": cost}}
    return {"params": {"params.yaml": {"data": params}}, "metrics": metrics}


def experiment(name: str, state: str, values: dict[str, Any], error: str = "") -> dict[str, Any]:
    revision = {"rev": f"{name}-0123456789", "name": name, "data": values, "error": {"msg": error} if error else None}
    return {"revs": [revision], "executor": {"state": state}, "name": name}


SHOWN = [
    {"rev": "workspace", "name": None, "data": data(64, 256, {"actor": 25.0, "anna": 28.0}), "experiments": None},
    {
        "rev": "0123456789abcdef",
        "name": "main",
        "data": data(64, 256, {}),
        "experiments": [
            experiment("coarse", "success", data(16, 128, {"actor": 23.0, "anna": 28.0})),
            experiment("fine", "success", data(32, 256, {"actor": 24.0})),
            experiment("broken", "failed", data(16, 13, {}), "Experiment run failed"),
            experiment("late", "running", data(8, 256, {})),
            experiment("later", "queued", data(8, 128, {})),
        ],
    },
]


def test_a_row_has_the_overrides_that_differ_and_what_was_measured() -> None:
    runs, pending = runs_of(SHOWN)
    actor = [run for run in runs if run.subject == "actor"]
    assert pending == 2
    assert [(run.experiment, dict(run.params), run.figures.get("psnr"), run.error) for run in actor] == [
        ("workspace", {"decimate.resolution": 64, "texture.resolution": 256}, 25.0, ""),
        ("coarse", {"decimate.resolution": 16, "texture.resolution": 128}, 23.0, ""),
        ("fine", {"decimate.resolution": 32, "texture.resolution": 256}, 24.0, ""),
        ("broken", {"decimate.resolution": 16, "texture.resolution": 13}, None, "Experiment run failed"),
    ]
    assert actor[1].figures == {"psnr": 23.0, "mesh_bytes": 16.0, "texture_bytes": 128.0, "bytes": 144.0}


def test_a_section_counts_where_a_subject_has_no_override() -> None:
    anna = [run for run in runs_of(SHOWN)[0] if run.subject == "anna" and run.figures]
    assert [dict(run.params) for run in anna] == [{"decimate.resolution": 64}, {"decimate.resolution": 16}]


@pytest.mark.parametrize("shown", [{"a": 1}, [1], [{"name": "main"}], None])
def test_something_else_is_refused(shown: object) -> None:
    with pytest.raises(UserError, match="not what `dvc exp show"):
        runs_of(shown)
