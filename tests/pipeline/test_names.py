"""Subjects' names and paths through the real `dvc repro`: none is run by a shell, none leads anywhere else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from facefolds_core.params import STAGE_SECTIONS
from tests.hostile.damage import fingerprint
from tests.pipeline.tiny import TinyProject


@pytest.fixture(scope="module")
def project(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> TinyProject:
    """Beside folders that names might lead to."""
    root = tmp_path_factory.mktemp("names")
    for folder in ("outside", "project/precious", "project"):
        for name in ("capture", "config", "timings"):
            write_precious(root / folder / name)
    return TinyProject(project_root, root / "project")


def write_precious(folder: Path) -> Path:
    """A file that must stay as it is."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "kept.txt").write_text("precious")
    return folder / "kept.txt"


def with_subject(project: TinyProject, name: str, path: str = "facefolds_core/captures/actor") -> None:
    sections: dict[str, object] = {section: {} for section in STAGE_SECTIONS}
    source = "actor" if path.startswith("facefolds_core") else "multiface"
    project.write_params(json.dumps({"subjects": {name: {"source": source, "path": path}}, **sections}))


def kept(project: TinyProject) -> dict[str, str]:
    """All but what DVC, git and `configure` write for themselves, and compiled code."""
    skip = ("project/.dvc/", "project/.git/", "project/data", "project/dvc.lock", "project/params.yaml")
    found = fingerprint(project.root.parent)
    return {n: d for n, d in found.items() if not n.startswith(skip) and "__pycache__" not in n}


@pytest.mark.parametrize(
    ("name", "targets"),
    [
        ("a;touch X;echo", []),
        ("../precious", ["capture@../precious"]),
        pytest.param("$(touch X)", ["capture@$(touch X)"], marks=pytest.mark.nightly),
        pytest.param("../../outside", [], marks=pytest.mark.nightly),
    ],
)
def test_dvc_runs_and_touches_nothing(project: TinyProject, name: str, targets: list[str]) -> None:
    """Of some names; tests/core/test_names.py refuses more, without DVC."""
    with_subject(project, name)
    before = kept(project)
    status, output = project.repro(*targets)
    assert status != 0
    assert "not a name for a subject" in output or "is ignored by .dvcignore" in output
    assert kept(project) == before


@pytest.mark.parametrize("name", ["../precious", pytest.param("a/../../../outside", marks=pytest.mark.nightly)])
def test_not_even_where_errors_are_to_be_ignored(project: TinyProject, name: str) -> None:
    """DVC deletes the outputs of a stage before it runs it: .dvcignore keeps them from being outputs."""
    with_subject(project, name)
    before = kept(project)
    project.repro("--ignore-errors")
    project.repro("--single-item", f"capture@{name}")
    assert kept(project) == before


def test_nor_far_outside(project: TinyProject) -> None:
    """Past the project's folder .dvcignore says nothing: there an output is a dependency, too, which DVC refuses."""
    path = write_precious(project.root.parents[1] / "farther" / "capture")
    with_subject(project, "a/../../../../../x/../farther")
    status, output = project.repro("--ignore-errors")
    assert status != 0
    assert "as both a dependency and an output" in output
    assert path.read_text() == "precious"


def test_nor_does_an_experiment(project_root: Path, tmp_path: Path) -> None:
    write_precious(tmp_path / "outside" / "capture")
    tiny = TinyProject(project_root, tmp_path / "project", own_code=True)
    (tiny.root / ".dvc" / "config").write_text("[core]\n    analytics = false\n")
    (tiny.root / ".gitignore").write_text("/data/*\n__pycache__\n")
    commit = ("git", "-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "--quiet", "--message", "start")
    for command in (("git", "init", "--quiet"), ("git", "add", "--all"), commit):
        tiny.done(*command)
    before = kept(tiny)
    status, output = tiny.run("dvc", "exp", "run", "-S", "+subjects={../../outside:{source:actor,path:x}}")
    assert status != 0
    assert "not a name for a subject" in output or "is ignored by .dvcignore" in output
    assert kept(tiny) == before


@pytest.mark.parametrize("path", ["data/good", pytest.param("-rf", marks=pytest.mark.nightly)])
def test_paths_that_are_none(project: TinyProject, path: str) -> None:
    with_subject(project, "good", path)
    status, output = project.repro()
    assert status != 0
    assert "subjects.good.path" in output or "as both a dependency and an output" in output
    assert "Traceback" not in output


def test_the_name_reaches_the_stage(project: TinyProject) -> None:
    project.write_params(
        "subjects: {good_1: {source: actor, path: facefolds_core/captures/actor}}\n"
        "capture: {cameras: 3, frames: 1, height: 16, width: 16}\n"
    )
    project.done("dvc", "repro", "capture@good_1")
    assert (project.root / "data" / "good_1" / "capture" / "KRT").exists()
