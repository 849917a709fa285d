"""The training log: dvclive's folder of text files, which never leaves the machine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dvclive.live import Live

from facefolds_core.errors import disk_error, is_disk_error


class Log(Live):
    """dvclive's; an error of the disk names the folder, where dvclive's own names nothing."""

    def log_metric(self, *args: Any, **options: Any) -> None:
        with self._named():
            super().log_metric(*args, **options)

    def make_summary(self, *args: Any, **options: Any) -> None:
        with self._named():
            super().make_summary(*args, **options)  # type: ignore[no-untyped-call]

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            if is_disk_error(error) and error.filename is None:
                raise disk_error(error, self.dir) from None
            raise


def open_log(folder: Path, resume: bool = False) -> Live:
    """dvclive's log in `folder`: no experiment, no report, no dvc.yaml, nothing sent anywhere.

    Args:
        folder: of the log.
        resume: go on with the log that is there.
    """
    # A user's token for DVC Studio must not make dvclive send the log there.
    os.environ["DVC_STUDIO_OFFLINE"] = "true"
    return Log(dir=str(folder), resume=resume, save_dvc_exp=False, dvcyaml=None, report=None, monitor_system=False)


def log_metrics(live: Live, step: int, values: Mapping[str, float]) -> None:
    """One line for each name in the log."""
    live.step = step
    for name, value in values.items():
        live.log_metric(name, value)
