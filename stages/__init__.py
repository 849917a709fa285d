"""The pipeline's stages, each a command."""

import os

# Threads of torch (libgomp) that wait for each other sleep instead of spinning: measured as fast on idle cores, and
# five times as fast where other work shares them (docs/performance.md). To be set before torch is imported.
os.environ.setdefault("GOMP_SPINCOUNT", "0")
