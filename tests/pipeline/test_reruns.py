"""What a change of code or of params.yaml reruns, by the real `dvc repro` on the stage `capture`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.pipeline.tiny import TinyProject

PARAMS = """\
subjects:
  one: {source: multiface, path: mine}
  two: {source: multiface, path: mine}
"""


@pytest.fixture(scope="module")
def project(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> TinyProject:
    """Run once."""
    tiny = TinyProject(project_root, tmp_path_factory.mktemp("reruns"), PARAMS, own_code=True)
    (tiny.root / "mine").mkdir()
    (tiny.root / "mine" / "KRT").write_text("`capture` only notes where it is")
    assert ran(tiny) == ["capture@one", "capture@two", "configure"]
    return tiny


def ran(project: TinyProject) -> list[str]:
    output = project.done("dvc", "repro", "capture@one", "capture@two")
    return sorted(re.findall(r"^Running stage '(.+)':", output, flags=re.MULTILINE))


def change(project: TinyProject, name: str, old: str, new: str) -> None:
    path = project.root / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_a_comment_in_params_reruns_nothing(project: TinyProject) -> None:
    project.write_params(PARAMS + "# a comment\n")
    assert ran(project) == []


def test_another_subjects_key_reruns_that_subject(project: TinyProject) -> None:
    project.write_params(PARAMS.replace("two: {", "two: {fps: 25, "))
    assert ran(project) == ["capture@two", "configure"]


def test_words_and_code_that_the_stage_does_not_use_rerun_configure_alone(project: TinyProject) -> None:
    change(project, "stages/capture.py", '"""Generate the embedded', '"""Generate (in other words) the embedded')
    change(project, "facefolds_core/geometry/cameras.py", "from __future__", "# a comment\nfrom __future__")
    change(project, "facefolds_core/pipeline/train.py", "PSNR {report", "psnr {report")
    assert ran(project) == ["configure"]


def test_code_that_it_uses_does(project: TinyProject) -> None:
    change(project, "facefolds_core/pipeline/capture.py", "a note of", "noted")
    assert ran(project) == ["capture@one", "capture@two", "configure"]
