"""DVC as it is, but for its end: `python -m facefolds_core.cluster.dvc repro ...` ends when who started it has ended.

A worker that is killed thus leaves nothing behind that goes on computing: the stages end with their DVC. Several
commands, `THEN` between them, run in one process, whatever becomes of the first ones: DVC takes a second to start.
"""

from __future__ import annotations

import sys
from itertools import groupby

from dvc.cli import main

from facefolds_core.system.processes import end_with_parent

THEN = "--then"

if __name__ == "__main__":
    end_with_parent()
    commands = [list(words) for is_then, words in groupby(sys.argv[1:], THEN.__eq__) if not is_then]
    sys.exit([main(command) for command in commands][-1])
