"""Every kernel on a GPU, or in numba's simulator of one, does what the CPU's does."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba_cuda", reason="the extra `cuda` is not installed: kernels for GPUs are not tested")

from facefolds_core.kernels import gpu
from tests.gpu.problems import PROBLEMS


@pytest.fixture(scope="module")
def on_gpu(tmp_path_factory: pytest.TempPathFactory, project_root: Path) -> Mapping[str, np.ndarray]:
    """By problem and argument. FACEFOLDS_GPU=1 asks for a real GPU."""
    out = tmp_path_factory.mktemp("gpu") / "found.npz"
    own = {} if os.environ.get("FACEFOLDS_GPU") else {"NUMBA_ENABLE_CUDASIM": "1"}
    command = [sys.executable, "-m", "tests.gpu.problems", str(out)]
    done = subprocess.run(command, cwd=project_root, env={**os.environ, **own}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return dict(np.load(out))


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_gpu_computes_what_the_cpu_does(name: str, on_gpu: Mapping[str, np.ndarray]) -> None:
    problem = PROBLEMS[name]()
    for key, expected in problem.expected().items():
        assert not np.array_equal(expected, problem.arguments[key]), f"{key} is not changed: nothing is compared"
        np.testing.assert_allclose(
            on_gpu[f"{name}: {key}"], expected.astype(float), atol=problem.outputs[key], rtol=1e-6
        )


def test_every_entry_has_a_problem(project_root: Path) -> None:
    tried = {id(make().entry) for make in PROBLEMS.values()}
    files = [path.relative_to(project_root) for path in (project_root / "facefolds_core").rglob("*_gpu.py")]
    modules = [importlib.import_module(".".join(path.with_suffix("").parts)) for path in files]
    entries = {f"{m.__name__}.{k}": v for m in modules for k, v in vars(m).items() if isinstance(v, gpu.Entry)}
    assert len(entries) >= len(tried) > 0
    assert [name for name, entry in entries.items() if id(entry) not in tried] == []
