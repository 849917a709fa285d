"""A tiny project that has been run once, by DVC; every test of this process may use it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pipeline.tiny import TinyProject


@pytest.fixture(scope="session")
def project(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> TinyProject:
    """Who changes its parameters or its files leaves the actor's results as they were."""
    tiny = TinyProject(project_root, tmp_path_factory.mktemp("tiny"))
    tiny.done("dvc", "repro", "evaluate@actor")
    return tiny
