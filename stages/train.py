"""Train the model on the normalised scene: data/<subject>/model."""

from __future__ import annotations

from facefolds_core.pipeline.train import train
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("train", train, __doc__ or "")
