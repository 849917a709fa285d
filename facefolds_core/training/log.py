"""The training log: dvclive's folder of text files, which never leaves the machine."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from dvclive.live import Live


def open_log(folder: Path, resume: bool = False) -> Live:
    """dvclive's log in `folder`: no experiment, no report, no dvc.yaml, nothing sent anywhere.

    Args:
        folder: of the log.
        resume: go on with the log that is there.
    """
    # A user's token for DVC Studio must not make dvclive send the log there.
    os.environ["DVC_STUDIO_OFFLINE"] = "true"
    return Live(dir=str(folder), resume=resume, save_dvc_exp=False, dvcyaml=None, report=None, monitor_system=False)


def log_metrics(live: Live, step: int, values: Mapping[str, float]) -> None:
    """One line for each name in the log."""
    live.step = step
    for name, value in values.items():
        live.log_metric(name, value)
