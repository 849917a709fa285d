"""Every kernel compiles to NVIDIA's assembler, without a GPU: typing and code generation, not results."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("numba_cuda", reason="the extra `cuda` is not installed: kernels for GPUs are not compiled")

import numba
from cuda.pathfinder import DynamicLibNotFoundError, load_nvidia_dynamic_lib
from numba import cuda
from numba.cuda import dispatcher

from tests.gpu.problems import PROBLEMS

try:
    for library in ("nvvm", "nvrtc"):
        load_nvidia_dynamic_lib(library)
except DynamicLibNotFoundError:
    pytest.skip("NVVM or NVRTC is missing (pip install 'numba-cuda[cu13]')", allow_module_level=True)


@pytest.fixture(params=[(8, 0), (9, 0)], ids=["sm_80", "sm_90"])
def target(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """numba asks the GPU in use what functions that are called are to be compiled for."""
    found = SimpleNamespace(compute_capability=request.param)
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: found)
    return request.param


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_kernel_compiles(name: str, target: tuple[int, int]) -> None:
    problem = PROBLEMS[name]()
    signature = numba.types.void(*[numba.typeof(value) for value in problem.arguments.values()])
    body = problem.entry.rebuilt(**problem.constants)
    ptx, _ = cuda.compile(body, signature, cc=target, output="ptx", device=False, abi="numba")
    assert f".target sm_{target[0]}{target[1]}" in ptx
    assert ".entry" in ptx
