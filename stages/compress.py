"""The asset that ships (Draco meshes, texture video, manifest), and one frame of it as GLB."""

from __future__ import annotations

from facefolds_core.pipeline.compress import compress
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("compress", compress, __doc__ or "")
