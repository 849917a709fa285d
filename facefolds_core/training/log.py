"""The training log: dvclive's folder of text files, which never leaves the machine."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from dvclive.live import Live

from facefolds_core.training.patience import patiently


class _Log(Live):
    """dvclive's log; an error of the disk names the file."""

    def make_summary(self) -> None:
        try:
            super().make_summary()  # type: ignore[no-untyped-call]
        except OSError as error:  # of a write it names none
            error.filename = error.filename or self.metrics_file
            raise


def open_log(folder: Path, resume: bool = False) -> Live:
    """dvclive's log in `folder`: no experiment, no report, no dvc.yaml, nothing sent anywhere.

    Args:
        folder: of the log.
        resume: go on with the log that is there.
    """
    # A user's token for DVC Studio must not make dvclive send the log there.
    os.environ["DVC_STUDIO_OFFLINE"] = "true"
    return _Log(dir=str(folder), resume=resume, save_dvc_exp=False, dvcyaml=None, report=None, monitor_system=False)


def log_metrics(live: Live, step: int, values: Mapping[str, float]) -> None:
    """One line for each name in the log. A full disk is waited for (`patience`), and leaves no half lines."""
    live.step = step
    for name, value in values.items():
        path = Path(live.plots_dir) / "metrics" / f"{name}.tsv"
        size = path.stat().st_size if path.exists() else None
        patiently(partial(_log, live, name, value, path, size))


def _log(live: Live, name: str, value: float, path: Path, size: int | None) -> None:
    try:
        live.log_metric(name, value)
    except OSError as error:
        if path.exists():
            os.truncate(path, size or 0)
            if size is None:
                path.unlink()  # so that the header is written again
        error.filename = str(path)
        raise
