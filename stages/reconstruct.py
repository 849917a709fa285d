"""Triangle surfaces of the layers from their samples: data/<subject>/surfaces."""

from __future__ import annotations

from facefolds_core.pipeline.reconstruct import reconstruct
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("reconstruct", reconstruct, __doc__ or "")
