"""One `jit` for all kernels: compiled code on disk is never stale, and a first run computes what later ones do."""

from __future__ import annotations

import ast
import math
import textwrap
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.kernels import jit
from facefolds_core.kernels.jit import fingerprint, kernel
from tests.processes import printed

NUMBA_COMPILERS = {"njit", "jit", "vectorize", "guvectorize", "cfunc", "stencil", "generated_jit", "experimental"}


def run_python(folder: Path, code: str) -> str:
    """The last line that `code` prints in a process of its own, with numba's cache in `folder`."""
    return printed(textwrap.dedent(code), folder=folder, NUMBA_CACHE_DIR=str(folder / "cache")).splitlines()[-1]


KERNEL = """
from facefolds_core.kernels.jit import compiled, kernel
from mini import constants
from mini.constants import FACTOR, TABLE, scaled

@kernel
def run(x):
    return scaled(x) * FACTOR + constants.OFFSET + TABLE[1]
"""
CONSTANTS = """
import numpy as np
from facefolds_core.kernels.jit import {decorator}
from mini.deeper import POWER

FACTOR, OFFSET = {factor}, {offset}
TABLE = np.array([0.0, {entry}])

@{decorator}
def scaled(x):
    return {body}
"""
BEFORE = {"decorator": "compiled", "factor": 2.0, "offset": 100.0, "entry": 0.0, "body": "x ** POWER"}


@pytest.mark.slow
@pytest.mark.parametrize("decorator", ["compiled", "kernel", "inlined"])
def test_an_edit_of_an_imported_module_is_compiled(tmp_path: Path, decorator: str) -> None:
    """A function, constants taken by name and through their module, an array, and what the imported module imports.

    Each alone, or, as decorators share the key, all at once.
    """
    package = tmp_path / "mini"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "run.py").write_text(KERNEL)

    def answer(power: float = 1.0, **changes: object) -> str:
        (package / "constants.py").write_text(CONSTANTS.format(**{**BEFORE, "decorator": decorator, **changes}))
        (package / "deeper.py").write_text(f"POWER = {power}")
        report = "print(run(3.0), sum(run.stats.cache_hits.values()))"
        return run_python(tmp_path, f"from mini.run import run\n{report}")

    assert answer() == "106.0 0"
    assert answer() == "106.0 1"  # from the cache
    if decorator != "kernel":
        assert answer(factor=3.0, offset=200.0, entry=0.5, body="x + POWER", power=2.0) == "215.5 0"
        return
    assert answer(body="x ** POWER + 1") == "108.0 0"
    assert answer(factor=3.0) == "109.0 0"
    assert answer(offset=200.0) == "206.0 0"
    assert answer(entry=0.5) == "106.5 0"
    assert answer(power=2.0) == "118.0 0"


def test_options_and_libraries_are_in_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    def function(x: float) -> float:
        return math.sqrt(x)

    both = {fingerprint(kernel(function)), fingerprint(kernel(parallel=True)(function))}
    for module, version in ((jit.numba, "0.0.1"), (jit.llvmlite, "0.0.1"), (np, "0.0.1")):
        monkeypatch.setattr(module, "__version__", version)
        both.add(fingerprint(kernel(function)))
    assert len(both) == 5


def test_kernels_run_where_no_cache_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file")
    code = """
    from pathlib import Path
    from facefolds_core.kernels.jit import kernel
    from facefolds_core.export.hold_kernel import pieces
    import numpy as np
    x = np.array([[1.0], [3.0]])
    pieces(x, 9.0, np.empty(3), np.empty(2, np.int64))
    print(x[:, 0])
    """
    assert run_python(tmp_path, code) == "[2. 2.]"


def test_nothing_else_compiles(project_root: Path) -> None:
    """Every kernel goes through `jit.py`: nothing but `prange` and threads is taken from numba."""
    found = []
    for folder in ("facefolds_core", "stages", "bench", "docs"):
        for path in (project_root / folder).rglob("*.py"):
            if path.name == "jit.py":
                continue
            for node in ast.walk(ast.parse(path.read_text())):
                named = (node.attr,) if isinstance(node, ast.Attribute) else ()
                if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("numba"):
                    named = tuple(alias.name for alias in node.names)
                if NUMBA_COMPILERS & set(named):
                    found.append(f"{path.relative_to(project_root)}:{node.lineno}")
    assert found == []
