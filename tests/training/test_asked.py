"""Whether there is a room with parallax is asked of cameras that its fit did not see."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact
from facefolds_core.frame_store import write_frames
from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume import search
from facefolds_core.training.volume.asked import left_out, room_gain
from tests.scenes import OPAQUE, make_scene, render

SMALL = {"levels": [{"resolution": 16, "iterations": 40}], "rays": 1024}
PARAMS = ExplicitParams.model_validate({"volume": SMALL})


def _before_a_wall(folder: Path) -> Scene:
    """A sphere, and a striped wall 0.8 units behind it."""
    scene = make_scene(folder, OPAQUE, cameras=13, frames=1)

    def images() -> Iterator[tuple[int, int, np.ndarray]]:
        for i, camera in enumerate(scene.cameras):
            origins, directions = camera.rays()
            away = (-0.8 - origins[..., 0]) / np.minimum(directions[..., 0], -0.05)
            place = (origins + away[..., None] * directions)[..., 1:]
            wall = 0.5 + 0.4 * np.stack([np.sin(5 * place[..., 0]), np.cos(5 * place[..., 1]), place[..., 0] * 0], -1)
            shown, alpha = render(camera, OPAQUE, 0)
            picture = shown.reshape(wall.shape) + (1 - alpha.reshape(*wall.shape[:2], 1)) * wall
            yield i, 0, np.round(255 * picture.clip(0, 1)).astype(np.uint8)

    write_frames(folder / "frames.arrow", (scene.height, scene.width, 3), images())
    return scene


def test_a_near_wall_is_shown_better_with_a_room(tmp_path: Path) -> None:
    assert room_gain(_before_a_wall(tmp_path / "wall"), PARAMS, tqdm(disable=True, total=0)) > 0.5


@pytest.mark.parametrize(("cameras", "count"), [(3, 1), (9, 1), (13, 2), (25, 4)])
def test_those_that_are_left_out_lie_among_the_others(tmp_path: Path, cameras: int, count: int) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, cameras=cameras, size=4, frames=1)
    train, out = scene.indices("train"), left_out(scene, 6)
    assert len(out) == count and set(out) <= set(train)
    assert cameras == 3 or (train[0] not in out and train[-1] not in out)


def test_never_all_cameras_are_left_out_and_one_or_two_are_not_asked(tmp_path: Path) -> None:
    assert len(left_out(make_scene(tmp_path / "four", OPAQUE, cameras=5, size=4, frames=1), 1)) == 3
    for cameras in (2, 3):  # one of them is held out
        scene = make_scene(tmp_path / str(cameras), OPAQUE, cameras=cameras, size=4, frames=1)
        assert room_gain(scene, PARAMS, tqdm(disable=True, total=0)) == 0


@pytest.mark.parametrize(("gain", "kind"), [(-0.5, "room_not_fitted"), (0.5, "room_gains")])
def test_there_is_a_room_where_it_gains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gain: float, kind: str
) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, frames=1)
    monkeypatch.setattr(search, "room_gain", lambda *_: gain)
    params = PARAMS.model_copy(update={"room": PARAMS.room.model_copy(update={"needed_below": 100.0})})
    asked: list[Fact] = [*search.find_subject(scene, params, tqdm(disable=True, total=0))[1]]
    assert [note.values["gain"] for note in asked if note.kind == kind] == [gain]
    params = PARAMS.model_copy(update={"room": PARAMS.room.model_copy(update={"needed_below": 0.0})})
    asked = [*search.find_subject(scene, params, tqdm(disable=True, total=0))[1]]
    assert not any(note.kind.startswith("room_") for note in asked)
