"""A stop watch for training: it can stand still while something else is done, and it can count processor time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from bench.results import ClockKind


class Clock:
    """Seconds since it was made, without the pauses.

    Args:
        source: a rising number of seconds.
    """

    def __init__(self, source: Callable[[], float]) -> None:
        self._source = source
        self._since = source()
        self._before = 0.0
        self._still = False

    @property
    def seconds(self) -> float:
        return self._before if self._still else self._before + self._source() - self._since

    def set(self, seconds: float) -> None:
        """Go on from this reading."""
        self._before, self._since = seconds, self._source()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Stand still; a pause within a pause changes nothing."""
        before = self._still
        self._before, self._still = self.seconds, True
        try:
            yield
        finally:
            self._since, self._still = self._source(), before


def time_source(kind: ClockKind, threads: int) -> Callable[[], float]:
    """Wall time, or this process's processor time divided by `threads`."""
    if kind == "wall":
        return time.perf_counter
    return lambda: time.process_time() / threads


def milestones(clock: Clock, budgets: Sequence[float], step: Callable[[], None]) -> Iterator[list[float]]:
    """Call `step` until the last of `budgets` has passed.

    Yields:
        after a step that passed some of them: those, in rising order. The clock stands still until the next one is
        asked for.
    """
    left = sorted(budgets)
    while left:
        step()
        passed = [budget for budget in left if budget <= clock.seconds]
        if passed:
            left = left[len(passed) :]
            with clock.paused():
                yield passed
