"""`facefolds scores`: the words at the end of a run."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from facefolds_core.cli import app
from facefolds_core.files.writing import write_json
from tests.scoring.test_terminal import metrics


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["scores", *arguments])


def write(data: Path, name: str) -> None:
    write_json(data / name / "metrics.json", metrics(subject=name))


def test_every_subject_has_its_lines(tmp_path: Path) -> None:
    for name in ("anna", "ben"):
        write(tmp_path, name)
    done = call("--data", str(tmp_path))
    assert done.exit_code == 0
    for name in ("anna", "ben"):
        assert f"{name}: {tmp_path / name / 'asset'}, 0.50 MB, 29.00 dB of the subject" in done.output


def test_one_may_be_named(tmp_path: Path) -> None:
    for name in ("anna", "ben"):
        write(tmp_path, name)
    assert "ben:" not in call(str(tmp_path / "anna")).output


@pytest.mark.parametrize("text", ["{}", "[]", "{"])
def test_garbled_scores_are_an_error_with_a_remedy(tmp_path: Path, text: str) -> None:
    (tmp_path / "anna").mkdir()
    (tmp_path / "anna" / "metrics.json").write_text(text)
    done = call("--data", str(tmp_path))
    assert done.exit_code == 1 and "metrics.json" in done.output and "dvc repro" in done.output


def test_nothing_made_yet_is_said(tmp_path: Path) -> None:
    assert "no subject has been evaluated yet" in call("--data", str(tmp_path)).output
