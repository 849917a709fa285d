"""The gate: what is withheld, what is measured again, what it lets pass and what not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from bench import gate
from bench.gate import Found, falls
from bench.results import Store
from bench.run import Project
from facefolds_core.captures.actor import make_rig
from facefolds_core.files.writing import write_json
from facefolds_core.params import CaptureParams
from tests.assets import make_asset
from tests.bench.test_commands import invoke

GOOD = {name: 20.0 if sign > 0 else 0.05 for name, (sign, _, _) in gate.TOLERANCES.items()}


@pytest.mark.parametrize("count", [8, 12, 22])
def test_cameras_that_are_left_are_spread_and_none_is_held_out(count: int) -> None:
    left_out = gate.aside(count)
    rig = {camera.name: camera for camera in make_rig(CaptureParams()).cameras}
    assert len(left_out) == 22 - count and not {"A011", "A023"} & set(left_out)
    kept = [rig[name].centre[0] for name in rig if name not in {*left_out, "A011", "A023"}]
    assert np.ptp(kept) > 1700  # mm: the outermost to both sides are kept


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[dict[str, Any]]:
    """Stand-ins for stages, pictures, processes and the file of what is kept; the subjects that were run."""
    ran = list[dict[str, Any]]()

    def stages(project: Project, *_: str) -> None:
        ran.append(yaml.safe_load((project.root / "params.yaml").read_text())["subjects"]["actor"])
        cost = {"mesh_bytes": 1000, "texture_bytes": 2000, "reflection_bytes": 0}
        metrics = {"headline": "psnr_any", "asset": GOOD, "asset_diffuse": GOOD}
        write_json(project.folders.metrics, {**metrics, "training_views": {"worst": {"psnr": 20.0}}, "cost": cost})

    monkeypatch.setattr(Project, "run", stages)
    monkeypatch.setattr(gate, "read_asset", lambda _: None)
    monkeypatch.setattr(gate, "strip", lambda *_: np.zeros((4, 4, 3), np.uint8))
    monkeypatch.setattr(gate, "apart", gate.run)
    monkeypatch.setattr(gate, "KEPT", tmp_path / "kept.json")
    return ran


def test_plates_are_withheld_by_name(tmp_path: Path, ran: list[dict[str, Any]]) -> None:
    for name in ("KRT", "plates"):
        (tmp_path / "captures" / "studio" / name).mkdir(parents=True)
    for name in ("studio", "studio, no plates"):
        gate.run(name, tmp_path, tmp_path / "captures")
    assert [sorted(p.name for p in Path(subject["path"]).iterdir()) for subject in ran] == [["KRT", "plates"], ["KRT"]]


@pytest.mark.parametrize(("commits", "times"), [(("a", "a"), 1), (("a", "b"), 2), (("a+", "a+"), 2)])
def test_other_code_is_measured_again(
    tmp_path: Path, ran: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch, commits: tuple[str, str], times: int
) -> None:
    for commit in commits:
        monkeypatch.setattr(gate, "commit_name", lambda commit=commit: commit)
        assert invoke(gate.main, str(tmp_path), "--only", "clutter").exit_code == 0
    assert len(ran) == times


def test_a_fall_fails_aloud_until_it_is_accepted(tmp_path: Path, ran: list[dict[str, Any]]) -> None:
    better = {**GOOD, "psnr_moving": 30.0}
    Store(gate.KEPT, "gate", Found).add(Found(case="clutter", scores=better))
    said = invoke(gate.main, str(tmp_path), "--only", "clutter")
    assert said.exit_code == 1
    assert "WORSE  clutter: psnr_moving: 30.00 to 20.00" in said.output
    assert invoke(gate.main, str(tmp_path), "--only", "clutter", "--accept").exit_code == 0
    assert invoke(gate.main, str(tmp_path), "--only", "clutter").exit_code == 0


def test_captures_that_are_missing_are_skipped_aloud(tmp_path: Path, ran: list[dict[str, Any]]) -> None:
    said = invoke(gate.main, str(tmp_path), "--only", "clutter", "--captures", str(tmp_path / "none"))
    assert "skipped: mugsy: no mugsy in" in said.output
    assert "no such name" in invoke(gate.main, str(tmp_path), "--only", "nowhere").output


@pytest.mark.parametrize("name", gate.TOLERANCES)
def test_each_score_may_be_worse_by_its_tolerance_alone(name: str) -> None:
    sign, most, _ = gate.TOLERANCES[name]
    kept = Found(case="actor", scores=GOOD)
    for share, worse in ((0.9, []), (1.1, [name]), (-9.0, [])):
        found = Found(case="actor", scores={**GOOD, name: GOOD[name] - sign * share * most})
        assert [line.split(":")[0] for line in falls(kept, found)] == worse
    assert list(falls(kept, Found(case="actor", scores={**GOOD, name: None}))) != []


@pytest.mark.parametrize("name", gate.SHARES)
def test_each_cost_may_grow_by_its_tolerance_alone(name: str) -> None:
    kept = Found(case="actor", bytes=1000, cpu_seconds=1000, peak_bytes=1000)
    grown = kept.model_copy(update={name: round(1000 * gate.SHARES[name]) + 1})
    assert [line.split(":")[0] for line in falls(kept, grown)] == [name]
    assert list(falls(kept, kept)) == []


def test_a_row_a_colour_a_column_an_azimuth(tmp_path: Path) -> None:
    white, red = (1.0, 1.0, 1.0), (1.0, 0.0, 0.0)
    seen = gate.strip(make_asset(tmp_path / "asset"), [-30, 0, 30], [white, red], (24, 32), 30.0)
    assert seen.shape == (2 * 32, 3 * 24, 3)
    assert (seen[0, ::24] == 255).all() and (seen[32, ::24] == (255, 0, 0)).all()  # corners show what is behind
    shown = (seen[:32].min(-1) < 250).reshape(32, 3, 24)
    assert shown.any((0, 2)).all() and not shown[:, :, 0].any()  # in each picture, and whole
    assert np.array_equal(seen[:32, ..., 0], seen[32:, ..., 0])  # red is behind both
