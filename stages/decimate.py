"""Each surface with at most R^m x R^m vertices, and texture coordinates, for all levels: data/<subject>/meshes."""

from __future__ import annotations

from facefolds_core.pipeline.decimate import decimate
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("decimate", decimate, __doc__ or "")
