"""All of them. `python -m tests.gpu.problems OUT` writes what a GPU, or the simulator, makes of them."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from tests.gpu import texture_problems, tracing_problems
from tests.gpu.problem import Problem

PROBLEMS: dict[str, Callable[[], Problem]] = {**texture_problems.PROBLEMS, **tracing_problems.PROBLEMS}

if __name__ == "__main__":
    found = {f"{name}: {key}": value for name, make in PROBLEMS.items() for key, value in make().on_gpu().items()}
    with open(sys.argv[1], "wb") as file:  # noqa: PTH123
        np.savez(file, **found)
