"""Stages let waiting threads sleep, and OpenBLAS has one thread, unless the environment says otherwise."""

from __future__ import annotations

import pytest

from facefolds_core.system.processes import THREADS, with_threads
from tests.processes import printed

SPIN, BLAS = "GOMP_SPINCOUNT", "OPENBLAS_NUM_THREADS"


@pytest.mark.parametrize("package", ["stages", "bench"])
@pytest.mark.parametrize(("given", "expected"), [({}, "0 1"), ({SPIN: "1000", BLAS: "2"}, "1000 2")])
def test_the_environment_has_the_last_word(package: str, given: dict[str, str], expected: str) -> None:
    code = f"import {package}, os; print(os.environ[{SPIN!r}], os.environ[{BLAS!r}])"
    assert printed(code, **{SPIN: None, BLAS: None, **given}) == expected


def test_no_stage_imports_numpy_before_the_threads_are_set() -> None:
    code = "import stages, sys; print([name for name in ('numpy', 'scipy', 'torch') if name in sys.modules])"
    assert printed(code) == "[]"


def test_shares_of_a_machine_leave_openblas_one_thread() -> None:
    assert with_threads(3) == dict.fromkeys(THREADS, "3") | {"OPENBLAS_NUM_THREADS": "1"}
