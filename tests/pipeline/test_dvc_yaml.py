"""dvc.yaml: constant commands, and a digest of the code for every stage. What a change reruns: test_grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from facefolds_core.params import STAGE_SECTIONS

STAGES = ["configure", *STAGE_SECTIONS]


@pytest.fixture(scope="module")
def pipeline(project_root: Path) -> dict[str, dict[str, Any]]:
    stages = yaml.safe_load((project_root / "dvc.yaml").read_text())["stages"]
    return {name: stage.get("do", stage) for name, stage in stages.items()}


def test_the_stages_are_all_there(pipeline: dict[str, dict[str, Any]]) -> None:
    assert list(pipeline) == STAGES


@pytest.mark.parametrize("stage", STAGES)
def test_commands_are_constant(stage: str, pipeline: dict[str, dict[str, Any]]) -> None:
    """Whatever params.yaml has would be read by a shell."""
    assert pipeline[stage]["cmd"] == f"python -m stages.{stage}"


@pytest.mark.parametrize("stage", STAGES[1:])
def test_a_stage_depends_on_its_code_and_on_what_it_is_told(stage: str, pipeline: dict[str, dict[str, Any]]) -> None:
    deps = pipeline[stage]["deps"]
    assert f"data/.code/{stage}.json" in deps
    assert f"data/.config/${{key}}/{stage}.json" in deps
    assert not [dep for dep in deps if dep.startswith(("stages", "facefolds_core"))]


@pytest.mark.parametrize("stage", STAGES[1:])
def test_no_stage_can_write_elsewhere(stage: str, pipeline: dict[str, dict[str, Any]], project_root: Path) -> None:
    """Both are the same file where a key leads out of data/ (.dvcignore)."""
    assert f"data/.timings/${{key}}/{stage}.json" in pipeline[stage]["outs"]
    assert f"data/.config/${{key}}/{stage}.json" in pipeline[stage]["deps"]
    assert f"{stage}.json" in (project_root / ".dvcignore").read_text().splitlines()


def test_configure_sees_all_code_and_parameters(pipeline: dict[str, dict[str, Any]]) -> None:
    assert pipeline["configure"]["deps"] == ["facefolds_core", "stages"]
    assert pipeline["configure"]["params"] == [{"params.yaml": None}]
