"""The pipeline's stages, each a command."""

import os
import sys
from types import TracebackType

# Threads of torch (libgomp) that wait for each other sleep instead of spinning: measured as fast on idle cores, and
# five times as fast where other work shares them (docs/research/performance.md). To be set before torch is
# imported.
os.environ.setdefault("GOMP_SPINCOUNT", "0")


def _hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Ctrl+C while a command still imports its libraries: a line, not where in them it was."""
    if issubclass(kind, KeyboardInterrupt):
        sys.stderr.write("\ninterrupted\n")
    else:
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _hook
