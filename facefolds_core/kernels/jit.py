"""numba for all kernels: one arithmetic, and a cache on disk that is never stale. Nothing else here calls `numba.njit`.

**One arithmetic.** Kernels are compiled without fast-math. numba optimises what a parallel kernel calls twice, once
alone and once where it is linked in; a process that compiles runs the first, one that loads from the cache the second.
Freed to reassociate and to contract, LLVM rounds the two differently, and a first run differed from later ones. With
IEEE arithmetic every optimisation keeps every bit, so that it also does not matter what a CPU offers.

**The cache's key.** numba's own names the kernel's file, its bytecode, the types of its arguments, numba's version, and
the CPU with its features. It misses what is built in from other files. Ours adds `fingerprint`: the text of the
modules that the kernel's functions and constants can come from.
"""

# numba has no types:
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
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
    """SHA-256 of what compiling a kernel builds in: its options, and the text of its module and of all that this
    imports of its own package and of ours."""
    code = function.py_func if isinstance(function, Dispatcher) else function
    options = sorted(function.targetoptions.items()) if isinstance(function, Dispatcher) else []
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__} {np.__version__} {options!r}".encode())
    for name in sorted(_known(code.__module__)):
        digest.update(_text(name).encode())
    return digest.hexdigest()


def _known(module: str) -> set[str]:
    """The module and those of its package and of ours that it imports, directly or not."""
    found, left, packages = set[str](), [module], {module.split(".")[0], __name__.split(".")[0]}
    while left:
        name = left.pop()
        if name not in found and name.split(".")[0] in packages and _text(name):
            found.add(name)
            left += _imported(name)
    return found


@cache
def _text(module: str) -> str:
    file = getattr(sys.modules.get(module), "__file__", None)
    return Path(file).read_text(encoding="utf-8") if file else ""


@cache
def _imported(module: str) -> tuple[str, ...]:
    """Names of modules that it may import: of `from a import b`, both a and a.b."""
    found = list[str]()
    for node in ast.walk(ast.parse(_text(module))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(found)


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
