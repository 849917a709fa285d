"""Takes that are too long to be trained at once: a base, and each frame alone against it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.writing import read_json
from facefolds_core.geometry.track import Track
from facefolds_core.model import load_model
from facefolds_core.model.segmented import SegmentedTextures
from facefolds_core.params import train_params
from facefolds_core.training.segments.frames import FrameFitter
from facefolds_core.training.segments.loop import base_of, fit_take
from facefolds_core.training.segments.plan import plan_take
from tests.training.takes import FRAMES, filmed, params, train

pytestmark = pytest.mark.slow


def same(one: Path, other: Path) -> bool:
    """Whether two models' frames are equal bit for bit."""
    textures = [load_model(folder).textures for folder in (one, other)]
    pairs = [zip(*(t.frame(k) for t in textures), strict=True) for k in range(FRAMES)]  # type: ignore[operator]
    return all(torch.equal(a, b) for pair in pairs for a, b in pair)


@contextmanager
def counted(most: int = 1000) -> Iterator[list[int]]:
    """The frames that are fitted meanwhile; a kill before number `most`."""
    fitted: list[int] = []
    fit: Callable[..., object] = FrameFitter.fit

    def counting(self: FrameFitter, frame: int, *rest: object) -> object:
        if len(fitted) == most:
            raise KeyboardInterrupt
        fitted.append(frame)
        return fit(self, frame, *rest)

    with patch.object(FrameFitter, "fit", counting):
        yield fitted


def error_of(scene: Scene, model: Path, frame: int, shown: int) -> float:
    """Mean squared difference of a held-out picture from what the model shows of frame `shown`."""
    index = scene.indices("holdout")[0]
    rays = [np.ascontiguousarray(a.reshape(-1, 3)) for a in scene.cameras[index].rays()]
    origins, directions = (torch.from_numpy(a).float() for a in rays)
    rgb = load_model(model).render(origins, directions, float(shown), False).rgb.numpy()
    return float(np.square(rgb - scene.open_frames().image(index, frame).reshape(-1, 3) / 255).mean())


def test_each_frame_is_shown_best_by_its_own_textures(take: tuple[Scene, Path]) -> None:
    scene, folder = take
    for k in (0, 2, 4):
        assert error_of(scene, folder / "model", k, k) < error_of(scene, folder / "model", k, (k + 2) % FRAMES)


def test_the_model_holds_base_and_segments_and_is_linear_between_frames(take: tuple[Scene, Path]) -> None:
    folder = take[1] / "model"
    assert train_params(read_json(folder / "params.json")) == params(processes=1)
    assert sorted(p.name for p in (folder / "segments").iterdir()) == [f"{i:05d}.safetensors" for i in range(3)]
    textures = load_model(folder).textures
    assert isinstance(textures, SegmentedTextures) and textures.lengths == (2, 2, 1)
    assert textures.frame_colour.numel() == 0
    uv, directions = torch.zeros(2, 2), torch.tensor([[-1.0, 0, 0]] * 2)
    both = textures.shade(uv, torch.zeros(2, dtype=torch.long), torch.tensor([1.5, 4.0]), directions)
    alone = [textures.shade(uv[:1], torch.zeros(1, dtype=torch.long), torch.tensor([t]), None) for t in (1.5, 4.0)]
    torch.testing.assert_close(both.rgb, torch.cat([one.rgb for one in alone]))


def test_a_killed_training_loses_the_segment_in_progress_only(unfitted: tuple[Scene, Path]) -> None:
    scene, folder = unfitted
    with counted(most=3) as before, pytest.raises(KeyboardInterrupt):
        train(scene, folder)
    with counted() as after:
        train(scene, folder)
    assert (before, after) == ([0, 1, 2], [2, 3, 4])


def test_what_was_taken_up_is_what_is_made_in_one_go(take: tuple[Scene, Path], take_again: tuple[Scene, Path]) -> None:
    scene, folder = take_again
    shutil.rmtree(folder / "checkpoints")
    train(scene, folder)
    assert same(folder / "model", take[1] / "model")


def test_frames_do_not_depend_on_their_segments(take: tuple[Scene, Path], take_again: tuple[Scene, Path]) -> None:
    scene, folder = take_again
    with counted() as fitted:
        train(scene, folder, frames=3)
    assert fitted == []  # dealt anew, trained no more
    for path in (folder / "checkpoints" / "take").glob("segment-*"):
        path.unlink()
    with counted() as fitted:
        train(scene, folder, frames=5)
    assert fitted == [0, 1, 2, 3, 4]
    assert same(folder / "model", take[1] / "model")


def test_a_changed_frame_trains_itself_alone(take_again: tuple[Scene, Path]) -> None:
    scene, folder = take_again
    keys = load_keys(folder)
    changed = next(k for k in range(FRAMES) if k not in keys)
    store = FrameStore(scene.folder / "frames.arrow")

    def brighter(camera: int, k: int) -> NDArray[np.uint8]:
        image = store.image(camera, k).copy()
        return image + np.uint8(1) * (image < 255) if k == changed else image

    rows = [(camera, k, brighter(camera, k)) for camera, k in store]
    write_frames(scene.folder / "frames.arrow", (store.height, store.width, 3), rows)
    with counted() as fitted:
        train(scene, folder)
    assert fitted == [changed]


def load_keys(folder: Path) -> list[int]:
    """Key frames of a trained model; frames of these scenes are named by their numbers."""
    return [int(name) for name in read_json(folder / "model" / "fit.json")["key_frames"]]


def test_a_model_is_saved_after_its_segments_have_gone_from_where_they_were_made(
    take: tuple[Scene, Path], take_again: tuple[Scene, Path]
) -> None:
    scene, folder = take_again
    fitted = fit_take(scene, params(), folder / "checkpoints", folder / "log")
    shutil.rmtree(folder / "checkpoints")
    fitted.save(folder / "saved")
    assert same(folder / "saved", take[1] / "model")
    assert {p.name for p in (folder / "saved").iterdir()} == {p.name for p in (take[1] / "model").iterdir()}


@pytest.mark.parametrize("keep", [0, 100, -8])
def test_a_damaged_segment_is_named(keep: int, take_again: tuple[Scene, Path]) -> None:
    path = take_again[1] / "model" / "segments" / "00001.safetensors"
    content = path.read_bytes()
    path.unlink()  # it is a link
    path.write_bytes(content[:keep])
    with pytest.raises(UserError, match=r"00001\.safetensors"):
        load_model(take_again[1] / "model")


@pytest.mark.parametrize("before", [0, 1])
def test_another_base_than_before_is_said(
    before: int, take: tuple[Scene, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A changed frame that is chosen as a key frame trains all others anew, too."""
    scene, _ = take
    for number in range(before):
        (tmp_path / f"base-{number}").mkdir()
    training = "facefolds_core.training.segments.loop.train_base"
    with patch(training, side_effect=KeyboardInterrupt), pytest.raises(KeyboardInterrupt):
        base_of(plan_take(scene, params(), 2), scene, params(), tmp_path, tmp_path / "log")
    assert ("another one than before" in capsys.readouterr().out) == bool(before)


def test_a_head_that_turns_is_fitted_frame_by_frame_too(tmp_path: Path) -> None:
    """Its rays meet other texels in each frame. It is the sphere itself, said to have shifted by next to nothing."""
    scene = filmed(tmp_path / "scene")
    shifts = np.outer(np.linspace(-1e-4, 1e-4, FRAMES), [0, 1, 0])
    scene = replace(scene, poses=Track.of([np.eye(3)] * FRAMES, shifts))
    with counted() as fitted:
        model = train(scene, tmp_path)
    assert fitted == list(range(FRAMES))
    assert error_of(scene, model, 0, 0) < error_of(scene, model, 0, 2)
