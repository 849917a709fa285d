"""Jobs: what a cell sets, where relative paths lead, what jobs lose to each other, what a killed DVC leaves."""

from __future__ import annotations

import os
from datetime import date
from pathlib import Path

import pytest

from facefolds_core.cluster.job import ATTEMPTS, repro
from facefolds_core.cluster.jobs import links_of, sweep_jobs
from facefolds_core.cluster.project import drop_empty_runs
from facefolds_core.config.params_file import load_params
from facefolds_core.errors import UserError


@pytest.mark.parametrize(
    ("keys", "linked"),
    [
        ("path: ../capture", ["../capture"]),
        ("path: ../capture, mattes: mine/mattes", ["../capture", "mine/mattes"]),
        ("path: /capture, mattes: /mattes", []),
        ("path: facefolds_core/captures/actor, mattes: mine", ["mine"]),
    ],
)
def test_captures_and_named_mattes_are_linked(tmp_path: Path, keys: str, linked: list[str]) -> None:
    (tmp_path / "params.yaml").write_text(f"subjects:\n  anna: {{source: transforms, {keys}}}\n")
    links = links_of(load_params(tmp_path / "params.yaml"), tmp_path, "anna")
    assert links == tuple((one, str((tmp_path / one).resolve())) for one in linked)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Whose two subjects share a value."""
    text = """
subjects:
  anna: {source: actor, path: a, compress: {video: &same {crf: 20, preset: fast}}} # with a comment
  bert: {source: actor, path: b, compress: {video: *same}}
"""
    (tmp_path / "params.yaml").write_text(text)
    return tmp_path


def test_a_cells_values_are_overrides_of_its_subject_alone(project: Path, tmp_path: Path) -> None:
    before = load_params(project / "params.yaml")
    cell = {"compress.video.crf": 30, "decimate.resolution": 24, "train.textures.learning_rate": 2e-05}
    (job,) = sweep_jobs(before, project, ["anna"], "evaluate", [cell])
    assert (job.name, job.target) == ("anna-000", "evaluate@anna")
    (tmp_path / "job.yaml").write_text(str(job.params))
    after = load_params(tmp_path / "job.yaml")
    own = {"textures": {"learning_rate": 2e-05}}
    compress, decimate = {"video": {"crf": 30, "preset": "fast"}}, {"resolution": 24}
    assert after.sections == before.sections and after.subjects["bert"] == before.subjects["bert"]
    changed = {"compress": compress, "decimate": decimate, "train": own}
    assert after.subjects["anna"] == before.subjects["anna"].model_copy(update=changed)


@pytest.mark.parametrize(
    ("subject", "values", "says"),
    [
        ("nobody", {"decimate.resolution": 24}, "no subject named"),
        ("anna", {"decimate.resolution": 2}, r"(?s)a cell of the sweep .*decimate \(for subject anna\).*auto"),
        ("anna", {"decimate.colour": 2}, "(?s)a cell of the sweep .*a key: resolution, uv"),
        ("anna", {"decimate": date(2026, 1, 1)}, "(?s)a cell of the sweep .*subjects.anna.decimate"),
        ("anna", {"train.lr_texture": 2}, "(?s)a cell of the sweep .*it is called `textures.learning_rate` now"),
    ],
)
def test_a_cell_that_does_not_fit_is_refused(subject: str, values: dict[str, object], says: str, project: Path) -> None:
    with pytest.raises(UserError, match=says):
        sweep_jobs(load_params(project / "params.yaml"), project, [subject], "evaluate", [values])


LOST = "ERROR: failed to reproduce 'configure': [Errno 2] No such file: '/p/.dvc/cache/runs/47/475c/.4sh.tmp'\n"
EMPTY = (
    "ERROR: failed to reproduce 'configure': join() argument must be str, bytes, or os.PathLike object,"
    " not 'NoneType'\n"
)
DAMAGED = "WARNING: corrupted cache file '../cache/runs/47/475c/.4sh.tmp'.\nERROR: failed: 'evaluate@bad'\n"


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        ([(1, LOST), (0, "done\n")], (0, LOST + "done\n", 2)),
        ([(1, EMPTY), (0, "done\n")], (0, EMPTY + "done\n", 2)),
        ([(1, DAMAGED), (0, "")], (1, DAMAGED, 1)),  # other failures are not repeated
        ([(0, LOST), (1, "")], (0, LOST, 1)),
        ([(1, LOST)] * (ATTEMPTS + 1), (1, LOST * ATTEMPTS, ATTEMPTS)),  # it ends
    ],
)
def test_a_record_that_was_lost_to_another_job_is_made_again(
    answers: list[tuple[int, str]], expected: tuple[int, str, int]
) -> None:
    left = list(answers)
    status, log = repro(lambda *_: left.pop(0), ["repro", "evaluate@a"])
    assert (status, log, len(answers) - len(left)) == expected


def test_only_empty_folders_that_stay_so_are_removed(tmp_path: Path) -> None:
    full, empty, new = (tmp_path / "runs" / "68" / name for name in ("full", "empty", "new"))
    for folder in (full, empty, new):
        folder.mkdir(parents=True)
    (full / "entry").write_text("x")
    for folder in (full, empty):
        os.utime(folder, (0, 0))
    drop_empty_runs(tmp_path)
    assert sorted(path.name for path in (tmp_path / "runs" / "68").iterdir()) == ["full", "new"]
    drop_empty_runs(tmp_path / "none")
