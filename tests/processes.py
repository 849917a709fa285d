"""Python in a process of its own: what has been imported, compiled or set here does not count there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def printed(code: str, *arguments: str, folder: Path = ROOT, **settings: str | None) -> str:
    """What code that ends well prints, run in a folder, which it imports from, too; settings of None are taken away."""
    environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}", **settings}
    given = {name: value for name, value in environment.items() if value is not None}
    command = [sys.executable, "-B", "-c", code, *arguments]
    done = subprocess.run(command, cwd=folder, env=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()
