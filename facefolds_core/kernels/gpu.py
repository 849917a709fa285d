"""Kernels on NVIDIA GPUs: the bodies that `jit` compiles for CPUs, compiled again by numba-cuda (the extra `cuda`).

An entry point is a plain function under `@entry`: one thread takes one ray, texel or voxel, and calls the body that the
CPU's kernel calls, with arrays of its own. `jit.add` and `jit.add4`, with which bodies add to sums that others add to
as well, are atomic here; so the order of sums, and with it their last bits, differ from run to run. Constants of an
entry's module that its caller knows better (`LAYERS`, the size of a local array) are given when it is run.

This module, and those of entries (`*_gpu.py`), are imported where a GPU is used: the extra may be missing. With
NUMBA_ENABLE_CUDASIM=1 all of it runs in numba's simulator, slowly, without a GPU.
"""

# numba has no types:
# mypy: disable-error-code="no-untyped-call,untyped-decorator,attr-defined"

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numba import config, cuda
from numba.core.dispatcher import Dispatcher
from numpy.typing import NDArray

from facefolds_core.kernels.jit import add, add4, names_of

THREADS = 128
"""Of a block."""

Array = NDArray[Any]

_most = [0]


class Entry:
    """A function that runs on a GPU, compiled when it is first asked for.

    Attributes:
        function: as it stands in its module.
    """

    def __init__(self, function: Callable[..., None]) -> None:
        self.function = function
        self._built: dict[tuple[tuple[str, int], ...], Any] = {}

    def rebuilt(self, **constants: int) -> types.FunctionType:
        """The function with everything that it calls made for the GPU, and with these constants of its module."""
        assert isinstance(self.function, types.FunctionType)
        return _rebuilt(self.function, constants, {})

    def run(self, count: int, *arguments: Any, **constants: int) -> None:
        """Start `count` threads. Arrays are those of `to_gpu`; numbers must have the width that the body expects."""
        key = tuple(sorted(constants.items()))
        if key not in self._built:
            self._built[key] = cuda.jit(self.rebuilt(**constants))
        if count:
            self._built[key][-(-count // THREADS), THREADS](*arguments)


def entry(function: Callable[..., None]) -> Entry:
    """Make a function an entry point on GPUs; its first statement asks `cuda.grid(1)` which one of all it is."""
    return Entry(function)


def available() -> bool:
    """Whether numba-cuda finds a GPU, or the simulator stands in for one."""
    return bool(cuda.is_available())


def name() -> str:
    """Of the GPU."""
    if config.ENABLE_CUDASIM:
        return "simulated GPU"
    found = cuda.get_current_device().name
    return found.decode() if isinstance(found, bytes) else str(found)


def most_bytes() -> int:
    """Of the GPU's memory in use, by whatever used it, when it was asked for here; 0 in the simulator."""
    return _most[0]


def _measure() -> None:
    if not config.ENABLE_CUDASIM:
        free, total = cuda.current_context().get_memory_info()
        _most[0] = max(_most[0], int(total - free))


def to_gpu(array: Array) -> Any:
    """A copy on the GPU."""
    copy = cuda.to_device(np.ascontiguousarray(array))
    _measure()
    return copy


def empty(shape: int | tuple[int, ...], dtype: Any = np.float32) -> Any:
    """An array on the GPU, not written yet."""
    array = cuda.device_array(shape, dtype)
    _measure()
    return array


def zeros(shape: int | tuple[int, ...], dtype: Any = np.float32) -> Any:
    """An array on the GPU."""
    return to_gpu(np.zeros(shape, dtype))


def _rebuilt(
    function: types.FunctionType, constants: Mapping[str, int], made: dict[types.FunctionType, Any]
) -> types.FunctionType:
    """A copy of a function whose globals, and what it encloses, are what they are on a GPU."""
    own = {"__name__": function.__module__, "__builtins__": __builtins__}
    for word in set(names_of(function.__code__)):
        if word in function.__globals__:
            own[word] = constants.get(word, _there(function.__globals__[word], made))
    cells = tuple(types.CellType(_there(cell.cell_contents, made)) for cell in function.__closure__ or ())
    return types.FunctionType(function.__code__, own, function.__name__, function.__defaults__, cells)


def _there(value: Any, made: dict[types.FunctionType, Any]) -> Any:
    """What stands on a GPU for a value that a function uses; all but compiled functions stay what they are."""
    if value is add:
        return _atomic
    if value is add4:
        return _atomic4
    if not isinstance(value, Dispatcher):
        return value
    function: types.FunctionType = value.py_func
    if function not in made:
        copy = _rebuilt(function, {}, made)
        made[function] = copy if config.ENABLE_CUDASIM else cuda.jit(device=True)(copy)
    return made[function]


@cuda.jit(device=True)
def _atomic(array: Any, at: Any, value: Any) -> None:
    cuda.atomic.add(array, at, value)


@cuda.jit(device=True)
def _atomic4(array: Any, at: Any, v0: Any, v1: Any, v2: Any, v3: Any) -> None:
    a0, a1, a2, a3 = at + (0,), at + (1,), at + (2,), at + (3,)  # noqa: RUF005 - numba knows no (*at, 0)
    cuda.atomic.add(array, a0, v0)
    cuda.atomic.add(array, a1, v1)
    cuda.atomic.add(array, a2, v2)
    cuda.atomic.add(array, a3, v3)
