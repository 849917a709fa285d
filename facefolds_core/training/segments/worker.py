"""A process that fits segments, one after another, as its parent hands them out (workers.py).

    python -m facefolds_core.training.segments.worker CONNECTION FILE

Both are numbers of open files.
"""

from __future__ import annotations

import resource
import signal
import sys
import time
from multiprocessing.connection import Connection

from facefolds_core.errors import as_user_error
from facefolds_core.system.processes import end_with_parent
from facefolds_core.training.segments.fitting import fit_segment
from facefolds_core.training.segments.handed import taken
from facefolds_core.training.segments.messages import Failed, FrameDone, SegmentDone


def work(connection: Connection, handle: int) -> None:
    """Fit segments until None comes."""
    fitting, views, shine = taken(handle)
    fitter, cache = fitting.fitter(views, shine), fitting.cache()
    while (segment := connection.recv()) is not None:
        rays = fit_segment(segment, fitter, cache, lambda: connection.send(FrameDone()))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        connection.send(SegmentDone(rays, memory, time.process_time()))


def main() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C reaches the parent, too, which ends us
    end_with_parent()
    connection = Connection(int(sys.argv[1]))
    try:
        work(connection, int(sys.argv[2]))
    except (EOFError, BrokenPipeError):
        pass  # the parent has ended
    except Exception as error:
        users = as_user_error(error)
        if users is None:
            raise
        connection.send(Failed(users))


if __name__ == "__main__":
    main()
