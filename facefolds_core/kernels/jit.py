"""numba for all kernels: one arithmetic, and a cache on disk that is never stale. Nothing else here calls `numba.njit`.

**One arithmetic.** Kernels are compiled without fast-math. numba optimises what a parallel kernel calls twice, once
alone and once where it is linked in; a process that compiles runs the first, one that loads from the cache the second.
Freed to reassociate and to contract, LLVM rounds the two differently, and a first run differed from later ones. With
IEEE arithmetic every optimisation keeps every bit, so that it also does not matter what a CPU offers.

**The cache's key.** numba's own names the kernel's file, its bytecode, the types of its arguments, numba's version, and
the CPU with its features. It misses what is built in from other files. Ours adds `fingerprint`: everything that the
kernel compiles, functions and constants, wherever they come from.
"""

# numba has no types:
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import hashlib
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import EllipsisType
from typing import Any, TypeVar, cast, overload

import llvmlite
import numba
import numpy as np
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

F = TypeVar("F", bound=Callable[..., Any])
Code = Callable[..., Any]


@overload
def kernel(function: Code) -> Code: ...
@overload
def kernel(*, parallel: bool = False, nogil: bool = False) -> Callable[[Code], Code]: ...
def kernel(function: Code | None = None, *, parallel: bool = False, nogil: bool = False) -> Any:
    """Compile an entry point and keep the machine code on disk.

    Args:
        parallel: run its `prange` on numba's threads.
        nogil: let other Python threads run meanwhile.
    """

    def decorate(function: Code) -> Any:
        built: Any = numba.njit(error_model="numpy", parallel=parallel, nogil=nogil)(function)
        if isinstance(built, Dispatcher):  # not where NUMBA_DISABLE_JIT is set
            with suppress(RuntimeError):  # no folder can be written to: compile in each process
                cast(Any, built)._cache = _Cache(built)
        return built

    return decorate if function is None else decorate(function)


def compiled(function: F) -> F:
    """Compile a function that kernels call."""
    return cast(F, numba.njit(error_model="numpy")(function))


def inlined(function: Code) -> Code:
    """Compile a small function into each place where a kernel calls it."""
    return cast(Code, numba.njit(error_model="numpy", inline="always")(function))


def fingerprint(function: Any) -> str:
    """SHA-256 of what compiling a kernel builds in: bytecode, constants, options, of itself and of all that it calls.

    Raises:
        TypeError: if it uses a global of a kind that this function cannot judge.
    """
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__} {np.__version__}".encode())
    for part in _parts(function, (), set()):
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def _parts(value: Any, names: tuple[str, ...], seen: set[Any]) -> Iterator[bytes]:
    """What there is to say of a value that a kernel uses; `names` are the attributes that may be read of a module."""
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic | EllipsisType):
        yield f"{type(value).__name__} {value!r}".encode()
    elif isinstance(value, tuple | frozenset):
        items = sorted(value, key=repr) if isinstance(value, frozenset) else value
        yield f"{type(value).__name__} {len(value)}".encode()
        for item in items:
            yield from _parts(item, names, seen)
    elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
        yield f"{value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    elif id(value) in seen or (id(value), names) in seen:
        yield b"seen"
    elif isinstance(value, Dispatcher):
        seen.add(id(value))
        for option in sorted(value.targetoptions):
            yield f"{option} {value.targetoptions[option]!r}".encode()
        yield from _parts(value.py_func, names, seen)
    elif isinstance(value, types.FunctionType) and _ours(value.__module__):
        seen.add(id(value))
        yield from _function_parts(value, seen)
    elif isinstance(value, types.ModuleType):
        seen.add((id(value), names))
        yield value.__name__.encode()
        for name in names:
            if hasattr(value, name):
                yield name.encode()
                yield from _parts(getattr(value, name), names, seen)
    elif isinstance(value, types.CodeType):
        yield from _code_parts(value, seen)
    elif callable(value) and hasattr(value, "__name__"):  # of numpy, numba or Python: their versions are in the key
        yield f"{getattr(value, '__module__', '')}.{value.__name__}".encode()
        if str(value.__module__).startswith(__package__):  # an intrinsic: what it builds, no bytecode says
            yield Path(str(sys.modules[value.__module__].__file__)).read_bytes()
    else:
        raise TypeError(f"a kernel uses a global of type {type(value).__name__}: make it a number, a tuple, an array")


def _function_parts(function: types.FunctionType, seen: set[Any]) -> Iterator[bytes]:
    """Bytecode, defaults and closure of a Python function, and the globals that it names."""
    code = function.__code__
    names = tuple(sorted(set(names_of(code))))
    yield from _code_parts(code, seen)
    yield from _parts(function.__defaults__ or (), names, seen)
    for cell in function.__closure__ or ():
        yield from _parts(cell.cell_contents, names, seen)
    for name in names:
        if name in function.__globals__:
            yield name.encode()
            yield from _parts(function.__globals__[name], names, seen)


def _code_parts(code: types.CodeType, seen: set[Any]) -> Iterator[bytes]:
    yield code.co_code
    yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)).encode()
    for constant in code.co_consts:
        yield from _parts(constant, (), seen)


def names_of(code: types.CodeType) -> Iterator[str]:
    """Globals and attributes that a function names, functions inside it included."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from names_of(constant)


def _ours(module: str | None) -> bool:
    """Not of a library whose version is in the key, or of Python, whose version names the cache's files."""
    return (module or "").split(".")[0] not in ("numpy", "numba", "math", "builtins")


class _Files(IndexDataCacheFile):
    """numba numbers the files of one kernel: two processes that compile it for two types at once may both write the
    first, and one then loads the other's code. Here the key names the file."""

    def save(self, key: Any, data: Any) -> None:
        name = self._data_name(0).replace(".0.nbc", f".{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc")
        overloads = self._load_index()
        overloads[key] = name
        self._save_data(name, data)
        self._save_index(overloads)


class _Cache(FunctionCache):
    """numba's cache, with `fingerprint` in the key; a full disk does not keep a kernel from running."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        super().__init__(dispatcher.py_func)
        self._dispatcher = dispatcher
        self._cache_file = _Files(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), fingerprint(self._dispatcher))

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):
            super().save_overload(sig, data)
