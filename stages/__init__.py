"""The pipeline's stages, each a command."""

import os
import sys
from types import TracebackType

# Threads of torch and numba (libgomp) that wait for each other sleep instead of spinning: measured as fast on idle
# cores, and five times as fast where other work shares them. OpenBLAS (numpy, scipy) has one thread: its threads spin,
# too, and our systems of equations are made of blocks far too small to be shared. To be set before torch and numpy are
# imported (docs/research/performance.md#beside-other-work).
os.environ.setdefault("GOMP_SPINCOUNT", "0")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Ctrl+C while a command still imports its libraries: a line, not where in them it was."""
    if issubclass(kind, KeyboardInterrupt):
        sys.stderr.write("\ninterrupted\n")
    else:
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _hook
