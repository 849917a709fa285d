"""A base that is cut off goes on from its last checkpoint, to the same files."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.track import Track
from facefolds_core.model.tensor_files import write_tensors
from facefolds_core.params import ReflectionParams, SegmentParams
from facefolds_core.training import patience
from facefolds_core.training.explicit.checkpoints import STATE
from facefolds_core.training.explicit.reflection import GlossParams
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.segments.loop import base_of
from facefolds_core.training.segments.plan import TakePlan, plan_take
from tests.geometry.test_track import about
from tests.scenes import make_scene
from tests.training.test_segments import FRAMES, params

pytestmark = pytest.mark.slow

STEPS = 30
"""Of the base: 10 of geometry at a quarter of its texels, 8 at half, 12 at all of them."""

OFTEN = {"checkpoint_seconds": 0.0}


@pytest.fixture(autouse=True)
def at_any_price(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checkpoints as often as asked for, however long they take."""
    monkeypatch.setattr(SegmentParams, "checkpoint_share", 1.0)


@contextmanager
def counted(most: int = 1000) -> Iterator[list[int]]:
    """The steps that are done meanwhile, frames of the base; a kill before number `most`."""
    done: list[int] = []
    step: Callable[..., float] = TextureState.step

    def counting(self: TextureState, *arguments: object) -> float:
        if len(done) == most:
            raise KeyboardInterrupt
        done.append(int(arguments[3]))  # type: ignore[call-overload]
        return step(self, *arguments)

    with patch.object(TextureState, "step", counting):
        yield done


def make(scene: Scene, plan: TakePlan, folder: Path, **segments: object) -> dict[str, bytes]:
    """Train the base; its files, but for the times."""
    base = base_of(plan, scene, params(**segments), folder, folder / "log")
    files = [path for path in sorted(base.folder.rglob("*")) if path.is_file() and path.name != "training.json"]
    return {str(path.relative_to(base.folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, TakePlan, dict[str, bytes]]:
    """A take, and its base trained in one go."""
    folder = tmp_path_factory.mktemp("base")
    scene = make_scene(folder / "scene", size=32, frames=FRAMES, surface_radius=0.33, mattes=True)
    plan = plan_take(scene, params(), 2)
    with counted() as steps:
        found = make(scene, plan, folder / "take")
    assert len(steps) == STEPS and "log/plots/metrics/psnr.tsv" in found
    return scene, plan, found


@pytest.mark.parametrize("after", [4, 15, 25])
def test_a_base_that_is_cut_off_goes_on_where_it_was(
    after: int, whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    scene, plan, expected = whole
    with counted(most=after), pytest.raises(KeyboardInterrupt):
        make(scene, plan, tmp_path, **OFTEN)
    with counted() as left:
        assert make(scene, plan, tmp_path, **OFTEN) == expected
    assert len(left) == STEPS - after
    assert [path.name for path in tmp_path.glob("begun-*")] == []


@pytest.mark.parametrize("turns", [False, True])
def test_a_base_with_a_reflection_goes_on_where_it_was(
    turns: bool, whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    """Cut off in the round of geometry after its first fit, and after it was decided that there is one, or of a head
    that turns that there is a smooth one."""
    scene, plan, _ = whole
    turned = Track.of([about((0, 0, 1), 5.0 * k) for k in range(FRAMES)], np.zeros((FRAMES, 3)))
    scene = replace(scene, poses=turned) if turns else scene
    lit = params(**OFTEN).model_copy(
        update={"reflection": ReflectionParams(texels=4, environment_texels=4, begin="rounds")}
    )

    def base(folder: Path) -> bytes:
        made = base_of(plan, scene, lit, folder, folder / "log")
        assert made.textures.reflection is not None
        return (made.folder / "model.safetensors").read_bytes()

    def gain(_: object, __: object, asked: GlossParams) -> float:
        return float(not turns or asked.gloss_smoothness > GlossParams().gloss_smoothness)

    with patch("facefolds_core.training.explicit.gloss.gain_on_cameras", gain):
        expected = base(tmp_path / "whole")
        for after in (8, 25):
            with counted(most=after), pytest.raises(KeyboardInterrupt):
                base(tmp_path / f"{after}")
            with counted() as left:
                assert base(tmp_path / f"{after}") == expected
            assert len(left) == STEPS - after


def test_it_is_not_written_more_often_than_asked(
    whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    scene, plan, _ = whole
    with counted(most=20), pytest.raises(KeyboardInterrupt):
        make(scene, plan, tmp_path, checkpoint_seconds=1000.0)
    assert list(tmp_path.glob("begun-*")) == []


@pytest.mark.parametrize("name", [STATE, "frame_alpha.npy"])
def test_a_damaged_checkpoint_is_none(
    name: str, whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    scene, plan, expected = whole
    with counted(most=20), pytest.raises(KeyboardInterrupt):
        make(scene, plan, tmp_path, **OFTEN)
    path = next(tmp_path.glob("begun-*")) / name
    path.write_bytes(path.read_bytes()[:200])
    with counted() as steps:
        assert make(scene, plan, tmp_path, **OFTEN) == expected
    assert len(steps) == STEPS


def test_it_makes_room_for_the_base_where_the_disk_is_full(
    whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    scene, plan, expected = whole
    tries: list[bool] = []

    def write(*arguments: Any) -> None:
        tries.append(any(tmp_path.glob("begun-*")))
        assert len(tries) < 3
        if tries[-1]:
            raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path))
        write_tensors(*arguments)

    with patch("facefolds_core.training.segments.base.write_tensors", write), patch.object(patience, "EVERY", 0.0):
        assert make(scene, plan, tmp_path, **OFTEN) == expected
    assert tries == [True, False]


def test_none_stays_beside_a_base_that_is_there(
    whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path
) -> None:
    """It was killed after it had written the base."""
    scene, plan, files = whole
    for name, content in files.items():
        path = tmp_path / f"base-{plan.base}" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    (tmp_path / f"begun-base-{plan.base}").mkdir()
    assert make(scene, plan, tmp_path) == files
    assert not any(tmp_path.glob("begun-*"))


@pytest.mark.parametrize("before", [0, 1])
def test_another_base_than_before_is_said(
    before: int, whole: tuple[Scene, TakePlan, dict[str, bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A changed frame that is chosen as a key frame trains all others anew, too."""
    scene, plan, _ = whole
    for number in range(before):
        (tmp_path / f"base-{number}").mkdir()
    training = "facefolds_core.training.segments.loop.train_base"
    with patch(training, side_effect=KeyboardInterrupt), pytest.raises(KeyboardInterrupt):
        base_of(plan, scene, params(), tmp_path, tmp_path / "log")
    assert ("train.segments.named" in capsys.readouterr().out) == bool(before)
