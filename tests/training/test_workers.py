"""Segments fitted in processes of their own."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import psutil
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json
from facefolds_core.training.segments import workers
from facefolds_core.training.segments.base import Base
from facefolds_core.training.segments.forecast import forecast, processes_for
from facefolds_core.training.segments.loop import base_of
from facefolds_core.training.segments.plan import Segment, plan_take
from facefolds_core.training.segments.workers import Fitting, fit_in_processes
from tests.training.takes import params

pytestmark = pytest.mark.slow


class Fit:
    """The segments of a take, fitted in processes."""

    def __init__(self, take: tuple[Scene, Path], processes: int = 2) -> None:
        self.processes = processes
        scene, folder = take
        self.place = folder / "checkpoints" / "take"
        self.plan = plan_take(scene, params(), forecast(scene, params()).key_frames or 1)
        self.base: Base = base_of(self.plan, scene, params(), self.place, folder / "log")
        self.fitting = Fitting(scene, params(), self.base.folder, self.place)
        self.done = list[Segment]()

    def run(self, tell: Callable[[Segment], object] = lambda segment: None) -> None:
        def told(segment: Segment) -> None:
            self.done.append(segment)
            tell(segment)

        fit_in_processes(self.fitting, self.base, self.plan.segments, self.processes, 1, told)


def processes() -> list[psutil.Process]:
    """Of this one's, those that fit segments."""
    return [one for one in psutil.Process().children() if "popen_loky" in " ".join(one.cmdline())]


def files(folder: Path) -> dict[str, bytes]:
    """Of a model and its log, without times and numbers of processes."""
    found = {
        str(path.relative_to(folder)): path.read_bytes()
        for part in ("model", "log")
        for path in sorted((folder / part).rglob("*"))
        if path.is_file() and path.name not in ("training.json", "params.json")
    }
    ran = read_json(folder / "model" / "params.json")
    del ran["segments"]["processes"]
    found["model/params.json"] = repr(ran).encode()
    assert {"model/segments/00002.safetensors", "log/plots/metrics/segment_psnr.tsv"} <= found.keys()
    return found


def test_what_a_lost_process_had_is_fitted_again(take: tuple[Scene, Path], unfitted: tuple[Scene, Path]) -> None:
    killed: list[int] = []

    def kill(_: Segment) -> None:
        if not killed:
            killed.append(len(processes()))
            for process in processes():
                process.kill()

    fit = Fit(unfitted)
    fit.run(kill)
    assert killed == [2]
    assert sorted(segment.number for segment in fit.done) == [0, 1, 2]
    made = {path.name: path.read_bytes() for path in fit.place.glob("segment-*")}
    assert made == {path.name: path.read_bytes() for path in (take[1] / "checkpoints" / "take").glob("segment-*")}
    assert not list(fit.place.glob("rays-*"))


def test_processes_that_are_lost_again_and_again_end_the_training(
    unfitted: tuple[Scene, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = Fit(unfitted)
    monkeypatch.setattr(workers, "_begin", partial(os._exit, 7))
    with pytest.raises(UserError, match="a worker process was lost") as caught:
        fit.run()
    assert "processes: 1" in str(caught.value) and "1, 2, 3" in str(caught.value)


def test_an_error_ends_all_processes(unfitted: tuple[Scene, Path]) -> None:
    def interrupt(_: Segment) -> None:
        raise KeyboardInterrupt

    fit = Fit(unfitted)
    with pytest.raises(KeyboardInterrupt):
        fit.run(interrupt)
    assert not processes()


def test_what_a_user_can_mend_comes_back(unfitted: tuple[Scene, Path]) -> None:
    fit = Fit(unfitted, processes=1)
    (fit.base.folder / "surroundings.safetensors").write_bytes(b"")
    with pytest.raises(UserError, match="surroundings"):
        fit.run()


def test_processes_are_as_many_as_work_and_memory_allow(
    take: tuple[Scene, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = take[0]
    monkeypatch.setattr("numba.get_num_threads", lambda: 8)
    long, texels = params(steps=1000), 10**5
    room = psutil.virtual_memory()._replace(available=10**12)
    monkeypatch.setattr("psutil.virtual_memory", lambda: room)
    assert processes_for(scene, long, texels, 20, 240) == 8
    assert processes_for(scene, long, texels, 3, 36) == 3
    assert processes_for(scene, params(steps=1), texels, 20, 20) == 1
    assert processes_for(scene, params(processes=5), 1, 20, 20) == 5
    room = room._replace(available=2 * 10**9)
    assert processes_for(scene, long, texels, 20, 240) == 2
    assert processes_for(scene, long, 10**8, 20, 240) == 1
