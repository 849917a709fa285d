"""A library that makes its caller real-time does not leave it so."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.video import Picture, encode_video
from facefolds_core.params import VideoCodec
from facefolds_core.system.scheduling import kept_scheduling

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux only")
REAL_TIME = {1, 2}  # SCHED_FIFO and SCHED_RR; a driver's own thread may have another (Mesa's cache: SCHED_BATCH)
needs_root = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root's threads change")


def policies() -> set[int]:
    return {os.sched_getscheduler(int(thread.name)) for thread in Path("/proc/self/task").iterdir()}


@needs_root
def test_this_thread_and_new_ones_are_as_before() -> None:
    end = threading.Event()
    with kept_scheduling():
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        thread = threading.Thread(target=end.wait)
        thread.start()
        assert os.SCHED_FIFO in policies()
    assert not policies() & REAL_TIME
    end.set()
    thread.join()


@needs_root
def test_an_error_does_not_leave_it_changed() -> None:
    with pytest.raises(ZeroDivisionError), kept_scheduling():
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
        raise ZeroDivisionError
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


@pytest.mark.parametrize("name", ["h264", "vp9", "av1"])
def test_no_encoder_changes_it(name: str, tmp_path: Path) -> None:
    seen: set[int] = set()

    def pictures() -> Iterator[Picture]:
        for _ in range(3):
            yield np.full((96, 64), 128, np.uint8)
            seen.update(policies())

    codec = CODECS[name]
    options = codec.options(VideoCodec(codec=name), 40)
    encode_video(tmp_path / "film", pictures(), (64, 64), Fraction(30), codec, options)
    assert not (seen | policies()) & REAL_TIME
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
