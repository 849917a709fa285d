"""Find who stands where: the subject's Gaussians, and mattes of all pictures: data/<subject>/subject."""

from __future__ import annotations

from facefolds_core.pipeline.subject import subject
from stages.common import run_stage

if __name__ == "__main__":
    run_stage("subject", subject, __doc__ or "")
