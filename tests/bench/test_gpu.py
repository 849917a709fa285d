"""The benchmark of a GPU, on the processor."""

from pathlib import Path

import pytest

from bench import gpu
from facefolds_core.params import MlpParams
from tests.scenes import make_scene


def test_the_first_steps_are_not_timed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter(range(0, 10_000))
    steps: list[float] = []
    monkeypatch.setattr(gpu.time, "perf_counter", lambda: float(next(now)))
    monkeypatch.setattr(gpu.loop, "train_step", lambda *_: steps.append(0.0))
    params = MlpParams(model="mlp", preset="quick", device="cpu", manifold_start="sphere", manifold_width=8)
    step, memory = gpu.timed(make_scene(tmp_path, size=8, frames=1), params, seconds=4)
    assert memory > 0
    timed = len(steps) - gpu.WARM
    assert timed >= 1
    assert step == pytest.approx((timed + 1) / timed)  # the clock is read once a timed step, and at the end
