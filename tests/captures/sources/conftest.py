"""What the layouts' tests have in common."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest


@pytest.fixture
def copied(filmed: Path, tmp_path: Path) -> Path:
    """A copy, to be damaged, of the filmed actor in the layout of the test's module."""
    return Path(shutil.copytree(filmed, tmp_path / "copy"))
