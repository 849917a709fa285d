"""Fixtures that every test may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def project_root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def captures_folder() -> Path:
    """The shared captures (never part of the repository); skips, aloud, where they are missing."""
    folder = Path(os.environ.get("FACEFOLDS_CAPTURES", ROOT.parent / "shared" / "captures"))
    if not folder.is_dir():
        pytest.skip(f"no captures at {folder}; set FACEFOLDS_CAPTURES to their folder to run this test")
    return folder
