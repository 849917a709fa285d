"""DVC as it is, but for its end: `python -m facefolds_core.cluster.dvc repro ...` ends when who started it has ended.

A worker that is killed thus leaves nothing behind that goes on computing: the stages end with their DVC.
"""

from __future__ import annotations

import sys

from dvc.cli import main

from facefolds_core.processes import end_with_parent

if __name__ == "__main__":
    end_with_parent()
    sys.exit(main())
