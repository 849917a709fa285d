"""Sample the model: N grids of R x R surface points with normals, and their texture frames: data/<subject>/samples."""

from __future__ import annotations

from facefolds_core.pipeline.sample import sample
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("sample", sample, __doc__ or "")
