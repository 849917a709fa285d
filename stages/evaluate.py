"""Score the shipped files, and the model they came from, on the held-out cameras."""

from __future__ import annotations

from facefolds_core.pipeline.evaluate import evaluate
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("evaluate", evaluate, __doc__ or "")
