"""Segments shared out among processes of this machine: each is handed one at a time; a lost one's is run again."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path

from tqdm import tqdm

from facefolds_core.errors import UserError
from facefolds_core.system.processes import with_threads
from facefolds_core.training.segments.base import Base
from facefolds_core.training.segments.handed import Fitting, handed
from facefolds_core.training.segments.messages import Failed, FrameDone, SegmentDone
from facefolds_core.training.segments.plan import Segment

ROOT = Path(__file__).parents[3]
"""Where this package is imported from."""

GRACE = 5.0
"""Seconds that a process is waited for after it was asked to end."""


@dataclass
class Used:
    """What workers used.

    Attributes:
        rays: shaded.
        memory: bytes resident in all workers, each one's most.
        seconds: of processor.
    """

    rays: int = 0
    memory: int = 0
    seconds: float = 0.0


@dataclass
class _Worker:
    """Attributes:
    segment: that it works on; None if it has nothing to do.
    frames: of it that are done.
    last: what it said of the segment before.
    """

    process: subprocess.Popen[bytes]
    connection: Connection
    segment: Segment | None = None
    frames: int = 0
    last: SegmentDone | None = None


class Workers:
    """Processes that fit segments.

    Args:
        fitting: by what.
        base: of the take.
        count: of processes.
        threads: of each.
        tell_frames: hears how many more frames are done: fewer, where a worker is lost.
        tell_segment: hears of each segment that is done.
    """

    def __init__(
        self,
        fitting: Fitting,
        base: Base,
        count: int,
        threads: int,
        tell_frames: Callable[[int], object],
        tell_segment: Callable[[Segment], object],
    ) -> None:
        self.fitting, self.base, self.count, self.threads = fitting, base, count, threads
        self.tell_frames, self.tell_segment = tell_frames, tell_segment
        self.workers: list[_Worker] = []
        self.lost: Counter[int] = Counter()
        self.used = Used()

    def fit(self, segments: Sequence[Segment]) -> Used:
        """Fit them all.

        Raises:
            UserError: if a frame diverges, or two workers are lost on one segment.
        """
        waiting = deque(segments)
        with handed(self.fitting, self.base) as handles:
            try:
                while waiting or any(worker.segment for worker in self.workers):
                    while waiting and len(self.workers) < self.count:
                        self.workers.append(self._begin(handles))
                        self._hand_out(self.workers[-1], waiting)
                    for connection in wait([worker.connection for worker in self.workers]):
                        worker = next(one for one in self.workers if one.connection is connection)
                        self._hear(worker, waiting)
            finally:
                self._end_all()
        return self.used

    def _begin(self, handles: Sequence[int]) -> _Worker:
        """A process by a command of its own: multiprocessing's would import the user's script once more."""
        ours, theirs = Pipe()
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
        environment = {**os.environ, **with_threads(self.threads), "PYTHONPATH": path}
        numbers = [str(theirs.fileno()), str(handles[0])]
        process = subprocess.Popen(
            [sys.executable, "-m", "facefolds_core.training.segments.worker", *numbers],
            env=environment,
            stdin=subprocess.DEVNULL,
            pass_fds=[theirs.fileno(), *handles],
        )
        theirs.close()
        return _Worker(process, ours)

    def _hand_out(self, worker: _Worker, waiting: deque[Segment]) -> None:
        worker.segment, worker.frames = (waiting.popleft() if waiting else None), 0
        with suppress(OSError):  # it has ended, which is seen when it is listened to
            worker.connection.send(worker.segment)

    def _hear(self, worker: _Worker, waiting: deque[Segment]) -> None:
        try:
            said = worker.connection.recv()
        except (EOFError, OSError):
            self._bury(worker, waiting)
            return
        if isinstance(said, Failed):
            raise said.error
        if isinstance(said, FrameDone):
            worker.frames += 1
            self.tell_frames(1)
        elif isinstance(said, SegmentDone):
            assert worker.segment is not None
            worker.last = said
            self.used.rays += said.rays
            self.tell_segment(worker.segment)
            self._hand_out(worker, waiting)

    def _bury(self, worker: _Worker, waiting: deque[Segment]) -> None:
        """A worker has ended: in peace, or its segment is to be run again. There are fewer workers then, since the
        memory may have been too small for so many; one is always left."""
        code = worker.process.wait()
        self.workers.remove(worker)
        self._count(worker)
        segment = worker.segment
        if segment is None:
            return
        self.tell_frames(-worker.frames)
        self.lost[segment.number] += 1
        how = f"signal {-code}" if code < 0 else f"status {code}"
        if self.lost[segment.number] > 1:
            raise UserError(
                "a worker process was lost, and the one that took its segment, too",
                place=f"segment {segment.number + 1}",
                found=f"the last one ended with {how}" + ("; was memory used up?" if code == -9 else ""),
                remedy="run the same command again, which goes on from here; with `train.segments.processes: 1` "
                "segments are fitted in the training's own process",
            )
        self.count = max(1, self.count - 1)
        tqdm.write(
            f"train: worker process {worker.process.pid} was lost ({how}) in segment {segment.number + 1}: that is "
            f"run again; {self.count} at once from here on"
        )
        waiting.appendleft(segment)

    def _count(self, worker: _Worker) -> None:
        worker.connection.close()
        if worker.last is not None:
            self.used.memory += worker.last.memory
            self.used.seconds += worker.last.seconds
            worker.last = None

    def _end_all(self) -> None:
        """End what is left, whatever it does."""
        for worker in self.workers:
            self._count(worker)
            if worker.segment is not None:
                worker.process.terminate()
        for worker in self.workers:
            try:
                worker.process.wait(GRACE)
            except subprocess.TimeoutExpired:
                worker.process.kill()
                worker.process.wait()
        self.workers.clear()
