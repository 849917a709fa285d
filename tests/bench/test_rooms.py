"""Rooms: what is withheld, what is kept, what is not measured again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from bench import rooms
from bench.results import Found, Store
from bench.run import Project
from facefolds_core.captures.actor import make_rig
from facefolds_core.files import write_json
from facefolds_core.params import CaptureParams
from facefolds_core.pictures import open_picture
from tests.bench.test_commands import invoke


@pytest.mark.parametrize("count", [8, 12, 22])
def test_cameras_that_are_left_are_spread_and_none_is_held_out(count: int) -> None:
    left_out = rooms.aside(count)
    rig = {camera.name: camera for camera in make_rig(CaptureParams()).cameras}
    assert len(left_out) == 22 - count and not {"A011", "A023"} & set(left_out)
    kept = [rig[name].centre[0] for name in rig if name not in {*left_out, "A011", "A023"}]
    assert np.ptp(kept) > 1700  # mm: the outermost to both sides are kept


def _measured(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Stand-ins for stages and pictures; the subjects that were run."""
    ran = list[dict[str, Any]]()

    def stages(project: Project, *_: str) -> None:
        ran.append(yaml.safe_load((project.root / "params.yaml").read_text())["subjects"]["actor"])
        cost = {"mesh_bytes": 1000, "texture_bytes": 2000}
        write_json(project.folders.metrics, {"asset": dict.fromkeys(rooms.FIGURES, 20.0), "cost": cost})

    monkeypatch.setattr(Project, "run", stages)
    monkeypatch.setattr(rooms, "read_asset", lambda _: None)
    monkeypatch.setattr(rooms, "strip", lambda *_: np.zeros((4, 4, 3), np.uint8))
    return ran


def test_plates_are_withheld_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = _measured(monkeypatch)
    for name in ("KRT", "plates"):
        (tmp_path / "captures" / "studio" / name).mkdir(parents=True)
    for name in ("studio", "studio, no plates"):
        rooms.run(name, tmp_path, tmp_path / "captures")
    assert [sorted(p.name for p in Path(subject["path"]).iterdir()) for subject in ran] == [["KRT", "plates"], ["KRT"]]


def test_what_was_measured_is_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = _measured(monkeypatch)
    for only in ("plain room", "plain room; clutter", "nowhere"):
        said = invoke(rooms.main, str(tmp_path), "--only", only)
    assert said.exit_code != 0 and "no such room" in said.output
    assert [subject["capture"].get("clutter") for subject in ran] == [None, 1.0]
    assert [one.room for one in Store(tmp_path / "rooms.json", "rooms", Found).read()] == ["plain room", "clutter"]


def _strips(folder: Path, *rooms_: str) -> None:
    for room in rooms_:
        Image.new("RGB", (4, 4)).save(rooms.strip_of(folder, room))


def test_a_strip_that_will_be_missing_is_said_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = _measured(monkeypatch)
    _strips(tmp_path, "actor", "clutter")
    said = invoke(rooms.main, str(tmp_path), "--only", "plain room", "--write")
    assert said.exit_code != 0 and "actor_8-cameras.jpg" in said.output and "actor, 8 cameras" in said.output
    assert not ran


def test_a_strip_that_is_about_to_be_drawn_is_not_missed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran, root = _measured(monkeypatch), tmp_path / "root"
    (root / "bench").mkdir(parents=True)
    (root / "bench" / "RESULTS.md").write_text("\n".join(rooms.MARKS))
    (root / "docs" / "images").mkdir(parents=True)
    monkeypatch.setattr(rooms, "ROOT", root)
    _strips(tmp_path, "actor", "actor, 8 cameras")
    said = invoke(rooms.main, str(tmp_path), "--only", "clutter", "--write")
    assert said.exit_code == 0, said.output
    assert len(ran) == 1 and open_picture(root / "docs" / "images" / "rooms.jpg").size == (4, 12)


def test_a_room_that_was_measured_elsewhere_is_not_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = _measured(monkeypatch)
    _strips(tmp_path, "actor", "actor, 8 cameras")
    Store(tmp_path / "rooms.json", "rooms", Found).add(Found(room="clutter"))
    said = invoke(rooms.main, str(tmp_path), "--only", "clutter; plain room", "--write")
    assert said.exit_code != 0 and "clutter.jpg" in said.output and not ran
