"""params.yaml is changed where it must be and nowhere else."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.config.params_file import load_params
from facefolds_core.errors import UserError
from facefolds_core.params import CompressParams, DecimateParams
from facefolds_core.sweeps.edit import set_for_subject


@pytest.fixture
def params(project_root: Path, tmp_path: Path) -> Path:
    path = tmp_path / "params.yaml"
    place = "    path: facefolds_core/captures/actor\n"
    text = (project_root / "params.yaml").read_text()
    assert place in text
    path.write_text(text.replace(place, f"{place}    texture: {{resolution: 256}} # its own\n"))
    return path


def test_only_the_values_change(params: Path) -> None:
    before = params.read_text().splitlines()
    set_for_subject(params, "actor", {"decimate.resolution": 24, "texture.resolution": 200, "compress.video.crf": 30})
    after = params.read_text().splitlines()
    added = ["    decimate: {resolution: 24}", "    compress: {video: {crf: 30}}"]
    expected = [line.replace("texture: {resolution: 256}", "texture: {resolution: 200}") for line in before]
    assert [line for line in after if line not in added] == expected
    assert all(line in after for line in added)
    read = load_params(params)
    assert isinstance(decimate := read.stage("decimate", "actor"), DecimateParams) and decimate.resolution == 24
    assert isinstance(compress := read.stage("compress", "actor"), CompressParams) and compress.video.crf == 30


def test_a_second_time_changes_nothing(params: Path) -> None:
    set_for_subject(params, "actor", {"decimate.resolution": 24})
    once = params.read_text()
    set_for_subject(params, "actor", {"decimate.resolution": 24})
    assert params.read_text() == once


@pytest.mark.parametrize(
    ("subject", "values", "says"),
    [
        ("nobody", {"decimate.resolution": 24}, "no subject named"),
        ("actor", {"decimate.resolution": 2}, "do not fit"),
        ("actor", {"decimate.colour": 2}, "do not fit"),
    ],
)
def test_a_mistake_leaves_the_file_alone(subject: str, values: dict[str, int], says: str, params: Path) -> None:
    before = params.read_text()
    with pytest.raises(UserError, match=says):
        set_for_subject(params, subject, values)
    assert params.read_text() == before
    assert [path.name for path in params.parent.iterdir()] == ["params.yaml"]
