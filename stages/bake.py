"""Texture frames that ship, held where a change would not show: data/<subject>/textures."""

from __future__ import annotations

from facefolds_core.pipeline.bake import bake
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("bake", bake, __doc__ or "")
