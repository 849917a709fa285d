"""Texture frames at R^t x R^t: data/<subject>/resampled."""

from __future__ import annotations

from facefolds_core.pipeline.texture import texture
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("texture", texture, __doc__ or "")
