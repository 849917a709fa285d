"""dvc.lock taken apart for jobs, and put together again."""

from __future__ import annotations

from pathlib import Path

import pytest
from dvc.repo import Repo

from facefolds_core.cluster.lockfile import parts_of, put_together

STAGE = """\
  {name}:
    cmd: python x.py
    outs:
    - path: data/{name}
      hash: md5
      md5: {md5}
      size: 1
"""
HEAD = "schema: '2.0'\nstages:\n"
CONFIGURE = STAGE.format(name="configure", md5="00a")


def stage(name: str, md5: str) -> str:
    return STAGE.format(name=name, md5=md5)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    Repo.init(str(tmp_path), no_scm=True)
    return tmp_path


def test_a_part_has_the_stages_of_its_subject_and_of_none(root: Path) -> None:
    anna, bert = stage("train@anna", "'123'"), stage("train@anna@bert", "456a")
    (root / "dvc.lock").write_text(HEAD + CONFIGURE + anna + bert)
    found = parts_of(root, ["anna", "bert", "carl"])
    assert found == {"anna": HEAD + CONFIGURE + anna, "bert": HEAD + CONFIGURE + bert, "carl": HEAD + CONFIGURE}


def test_where_nothing_is_recorded_parts_are_empty(root: Path) -> None:
    assert parts_of(root, ["anna"]) == {"anna": ""}
    put_together(root, ["", ""])
    assert not (root / "dvc.lock").exists()


def test_parts_replace_what_they_speak_of_and_nothing_else(root: Path) -> None:
    kept, old, new = stage("train@dora", "1b"), stage("train@anna", "2b"), stage("train@anna", "3b")
    (root / "dvc.lock").write_text(HEAD + CONFIGURE + old + kept)
    put_together(root, [HEAD + CONFIGURE + new, HEAD + stage("train@bert", "'0123'")])
    assert (root / "dvc.lock").read_text() == HEAD + CONFIGURE + new + kept + stage("train@bert", "'0123'")
