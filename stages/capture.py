"""Generate the embedded actor in data/<subject>/capture; for other sources, note where the capture is."""

from __future__ import annotations

from facefolds_core.pipeline.capture import capture
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("capture", capture, __doc__ or "")
