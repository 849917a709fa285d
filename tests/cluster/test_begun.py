"""A base that is trained as a job leaves its checkpoint where the next worker finds it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from facefolds_core.cluster.job import Job, _make_part
from facefolds_core.cluster.project import snapshot


@dataclass
class Shell:
    """Notes the words of a command, which fails."""

    said: list[str] = field(default_factory=list)

    def python(self, module: str, *words: str) -> tuple[int, str]:
        self.said += words
        return 1, ""


@pytest.mark.parametrize(("part", "push", "there"), [("base", False, True), ("base", True, False), ("3", False, False)])
def test_in_a_cache_that_is_shared(part: str, push: bool, there: bool, tmp_path: Path) -> None:
    shell: Any = Shell()
    job = Job("anna.base", "anna", "subject@anna", None, (), part=part)
    assert _make_part(shell, tmp_path, job, push, tmp_path / "begun")[0] == 1
    assert shell.said == ["--subject", "anna", "--part", part, *(["--begun", str(tmp_path / "begun")] if there else [])]


def test_a_folder_of_each_project_and_subject(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name / ".dvc").mkdir(parents=True)
        (tmp_path / name / ".dvc" / "config").write_text(
            f"[core]\n    no_scm = true\n[cache]\n    dir = {tmp_path}/c\n"
        )
    places = {
        snapshot(tmp_path / name, run, False).begun(subject)
        for name in ("a", "b")
        for subject in ("anna", "ben")
        for run in ("first", "second")
    }
    assert len(places) == 4
    assert all(place.is_relative_to(tmp_path / "c") for place in places)
