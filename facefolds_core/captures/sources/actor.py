"""The embedded actor: `capture` has written it as a Multiface capture, with masks."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.sources.multiface import read_multiface
from facefolds_core.params import CaptureParams, Subject


def read(root: Path, subject: Subject, params: CaptureParams) -> Capture:
    """As `read_multiface`, at the rate that the actor was filmed with."""
    return read_multiface(root, subject, params.frame_rate)
