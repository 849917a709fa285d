"""What is read, how it is said, and what is said of what is not there."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_text
from facefolds_core.reporting import charts, tables, words
from facefolds_core.reporting.facts import read_curves, read_facts, read_images
from facefolds_core.scoring.panels import ImageScore
from facefolds_core.scoring.report import write_per_image
from tests.reporting.tiny import FRAMES, make_subject, scores
from tests.scenes import look_at_origin


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> SubjectFolders:
    return make_subject(tmp_path_factory.mktemp("facts") / "spheres")


@pytest.mark.parametrize("name", [".", "nowhere"])
def test_a_wrong_folder_is_named_with_a_remedy(tmp_path: Path, name: str) -> None:
    with pytest.raises(UserError, match="dvc repro") as error:
        read_facts(SubjectFolders(tmp_path / name))
    assert error.value.file == tmp_path / name


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"asset": null, "cost": {}}'])
def test_garbled_scores_are_named(tmp_path: Path, text: str) -> None:
    write_text(tmp_path / "metrics.json", text)
    with pytest.raises(UserError) as error:
        read_facts(SubjectFolders(tmp_path))
    assert error.value.file == tmp_path / "metrics.json"


def test_scores_alone_are_enough_to_read(tmp_path: Path) -> None:
    write_text(tmp_path / "metrics.json", '{"asset": {}, "cost": {}}')
    facts = read_facts(SubjectFolders(tmp_path))
    assert (facts.images, facts.curves, facts.config) == ((), {}, {})
    assert all(seconds is None for seconds, _ in facts.stages.values())


def test_damaged_scores_of_pictures_are_named(folders: SubjectFolders, tmp_path: Path) -> None:
    copy = SubjectFolders(tmp_path)
    write_text(copy.metrics, folders.metrics.read_text())
    write_text(copy.evaluation / "per_image.parquet", "no parquet")
    with pytest.raises(UserError, match="damaged scores"):
        read_facts(copy)


def test_facts_are_those_of_the_files(folders: SubjectFolders) -> None:
    facts = read_facts(folders)
    image = facts.images[0]
    assert (image.camera, image.frame) == ("cam3", "000000")
    assert {name: value for name, value in image.values.items() if value} == {"psnr": 19.0, "psnr_subject": 24.0}
    assert facts.curves == {"psnr": [(0, 10), (2, 20)]}  # the header and NaN are left out
    assert facts.stages["train"][0] == 10
    assert facts.stages["compress"][1] == sum(path.stat().st_size for path in folders.asset.iterdir())
    assert facts.stages["bake"][1] is None


def test_a_curve_of_one_point_is_none(tmp_path: Path) -> None:
    write_text(tmp_path / "x.tsv", "step\tx\n0\t1\n")
    assert read_curves(tmp_path) == {}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (words.number(None), "–"),
        (words.number(math.nan), "–"),
        (words.number(math.inf), "–"),
        (words.number(-1.5, 1), "−1.5"),
        (words.count(93425), "93\u202f425"),
        (words.size(999), "999\u00a0bytes"),
        (words.size(231_000), "231\u00a0KB"),
        (words.size(2_451_088), "2.45\u00a0MB"),
        (words.duration(95.5), "96\u00a0s"),
        (words.duration(389), "6\u00a0min 29\u00a0s"),
        (words.duration(None), "–"),
        (words.percent(0.125), "12\u00a0%"),
    ],
)
def test_figures_as_people_read_them(found: str, expected: str) -> None:
    assert found == expected


def test_cameras_for_validation_are_not_in_the_heat_map(tmp_path: Path) -> None:
    checked = [replace(one, split="validate") for one in scores(True)]
    write_per_image([*scores(True), *checked], tmp_path / "per_image.parquet")
    assert len(read_images(tmp_path / "per_image.parquet")) == FRAMES


def test_a_heat_map_with_gaps() -> None:
    images = [
        ImageScore(camera, frame, "asset", {"psnr": psnr})
        for camera, frame, psnr in (("a", "0", 20.0), ("b", "1", None), ("b", "0", 21.0))
    ]
    heat = tables.heat_map(images, "psnr", {})
    assert heat["frames"] == ["0", "1"]
    assert (heat["low"], heat["high"]) == ("19.0", "22.0")  # at least 3 dB, about the middle
    assert [cell["value"] for cell in heat["rows"][1]["cells"]] == ["21.0", "–"]


@pytest.mark.parametrize("values", [(1.0, 1.0), (0.0, 1e-9), (-1e6, 1e6)])
def test_a_line_chart_of_any_range_is_finite(values: tuple[float, float]) -> None:
    svg = charts.line_chart([(0, values[0]), (1, values[1])])
    assert svg.startswith("<svg") and "nan" not in svg


def test_ink_is_read_on_any_colour() -> None:
    assert (charts.ink_on(0.0), charts.ink_on(1.0)) == ("#ffffff", "#000000")


def test_how_far_a_camera_stands_from_the_front() -> None:
    found = tables.degrees_from_front(look_at_origin("left", 30, 20, 8))
    expected = np.degrees(np.arccos(np.cos(np.radians(30)) * np.cos(np.radians(20))))
    assert found == pytest.approx(expected)
