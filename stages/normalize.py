"""Read a capture and write it in the one convention: data/<subject>/scene/."""

from __future__ import annotations

from facefolds_core.pipeline.normalize import normalize
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("normalize", normalize, __doc__ or "")
