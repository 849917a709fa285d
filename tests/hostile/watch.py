"""A time limit for what runs in this process: opening a FIFO or an endless loop is interrupted by a signal."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType


class HungError(BaseException):
    """Not an `Exception`, so that nothing in between takes it for its own."""


def within(seconds: float, call: Callable[[], object]) -> Callable[[], object]:
    """`call`, which raises TimeoutError if it is not done in time. Main thread only."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise HungError

    def watched() -> object:
        before = signal.signal(signal.SIGALRM, interrupt)
        signal.setitimer(signal.ITIMER_REAL, seconds)
        try:
            return call()
        except HungError:
            raise TimeoutError(f"no end after {seconds} s") from None
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)

    return watched
