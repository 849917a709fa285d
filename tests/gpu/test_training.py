"""A training on a GPU, or in the simulator of one, gives what the CPU gives; see `trainings.py`."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.training import device

pytest.importorskip("numba_cuda", reason="the extra `cuda` is not installed: training on GPUs is not tested")


@pytest.mark.slow
def test_a_training_gives_the_same_model(tmp_path: Path, project_root: Path) -> None:
    own = {} if os.environ.get("FACEFOLDS_GPU") else {"NUMBA_ENABLE_CUDASIM": "1"}
    command = [sys.executable, "-m", "tests.gpu.trainings", str(tmp_path)]
    done = subprocess.run(command, cwd=project_root, env={**os.environ, **own}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    cpu, cuda = (dict(np.load(tmp_path / f"{name}.npz")) for name in ("cpu", "cuda"))
    assert np.abs(cpu["textures.layers"][..., :3]).max() > 0.01, "nothing was learnt: nothing is compared"
    assert not np.array_equal(cpu["textures.layers"], cuda["textures.layers"]), "both are the CPU's"
    for name, values in cpu.items():
        # Worst seen: 9e-5, of three logits: where gradients are small, a step of Adam is mostly its sign.
        np.testing.assert_allclose(cuda[name], values, atol=3e-4, err_msg=name)


def test_cuda_without_the_extra_or_without_a_gpu_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from facefolds_core.kernels import gpu

    monkeypatch.setattr(gpu, "available", lambda: False)
    with pytest.raises(UserError, match="nvidia-smi"):
        device.choose("cuda")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UserError, match="pip install"):
        device.choose("cuda")
    assert not device.choose("auto").gpu and not device.choose("cpu").gpu
