"""The page as a file: whole, self-contained, with a line for all that is missing; and the command."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.cli import app
from facefolds_core.cli.scores import evaluated_subjects
from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import read_json, write_json
from facefolds_core.reporting.build import make_report
from facefolds_core.scoring.films import FILMS
from facefolds_core.scoring.pictures import write_training_views
from facefolds_core.scoring.training_scores import METRICS, TrainingView, bad_views, warnings_of
from tests.reporting.tiny import FRAMES, LAYERS, make_subject


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> SubjectFolders:
    return make_subject(tmp_path_factory.mktemp("page") / "somebody")


@pytest.fixture
def copy(subject: SubjectFolders, tmp_path: Path) -> SubjectFolders:
    """The same, to spoil."""
    return SubjectFolders(shutil.copytree(subject.root.parent, tmp_path / "data") / "somebody")


def page_of(folders: SubjectFolders) -> str:
    return make_report(folders).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(subject: SubjectFolders) -> str:
    return page_of(subject)


def films_of(page: str) -> list[dict[str, Any]]:
    return list(json.loads(page.split('id="films-data">')[1].split("</script>")[0]))


def changed(folders: SubjectFolders, **values: object) -> str:
    """The page of other scores."""
    write_json(folders.metrics, read_json(folders.metrics) | values)
    return page_of(folders)


def test_everything_is_in_the_file(page: str) -> None:
    addresses = re.findall(r"""(?:src|href|srcset|action|poster)\s*=\s*["']?([^"'\s>]+)""", page)
    assert all(address.startswith(("data:", "#")) for address in addresses)
    assert not re.search(r"url\(|@import|https?://|<iframe|<object", page)
    assert page.count("data:image/webp") == 1 + LAYERS
    assert page.count("data:image/png") == 1  # where it is worst


def test_nothing_is_missing_and_nothing_is_no_number(page: str, subject: SubjectFolders) -> None:
    assert 'class="missing"' not in page
    assert not re.search(r">\s*(nan|None|inf)\b", page)
    assert str(subject.root) not in page


def test_figures_that_are_no_numbers_are_dashes(copy: SubjectFolders) -> None:
    for path in (copy.metrics, copy.timing("train")):
        path.write_text(re.sub(r"(\d+\.\d+|300)(?=[,\n])", "NaN", path.read_text()))
    page = page_of(copy)
    assert not re.search(r"\b(nan|None|inf)\b", re.sub(r"data:image[^\"]*|<script>.*</script>", "", page, flags=re.S))


def test_the_headline_says_over_which_pixels_it_is(copy: SubjectFolders) -> None:
    note = '<dd class="note">of the subject, the pixels of {}; held-out cameras</dd>'
    metrics = read_json(copy.metrics)
    assert metrics["matte"] == "true" and note.format("the masks") in page_of(copy)
    asset = metrics["asset"] | {"psnr_found": metrics["asset"]["psnr_subject"], "psnr_subject": None}
    page = changed(copy, asset=asset, headline="psnr_found", matte="found")
    assert "within the matte that was found, the pixels of the model&#39;s own opacity; held-out cameras" in page


def test_what_was_fitted_is_worded_and_words_from_files_are_escaped(page: str) -> None:
    assert "<li>texels: 1.5 pixels each" in page
    assert "level 3: &lt;diverged&gt;" in page


@pytest.mark.parametrize(
    ("gone", "command"),
    [
        ("scene", "dvc repro normalize@somebody"),
        ("evaluation", "dvc repro evaluate@somebody"),
        ("training", "dvc repro train@somebody"),
        ("../.config", "dvc repro configure"),
    ],
)
def test_what_is_missing_is_said_with_the_command_that_makes_it(copy: SubjectFolders, gone: str, command: str) -> None:
    shutil.rmtree(copy.root / gone)
    assert f"<code>{command}</code>" in page_of(copy)


def test_with_scores_and_asset_alone_there_is_a_page(copy: SubjectFolders) -> None:
    for path in copy.root.iterdir():
        if path.is_dir() and path != copy.asset:
            shutil.rmtree(path)
    shutil.rmtree(copy.config)
    assert page_of(copy).count('class="missing"') == 5


def test_without_masks_the_whole_frame_is_spoken_of(tmp_path: Path) -> None:
    assert "over the whole frame" in page_of(make_subject(tmp_path / "bare", masks=False))


def test_what_is_not_well_stands_at_the_head(page: str, copy: SubjectFolders) -> None:
    assert "not well" not in page
    warned = changed(copy, warnings=[fact("front_is_guessed").to_json()])
    assert "One thing is not well" in warned and "name a camera that faces the" in warned
    assert warned.index("not well") < warned.index('class="tiles"')


def test_bad_training_views_are_shown(copy: SubjectFolders) -> None:
    black, both = np.zeros((4, 4, 3)), zip("abcd", (30.0, 31.0, 30.0, 20.0), strict=True)
    views = [TrainingView(name, "0", dict.fromkeys(METRICS, psnr), black, black) for name, psnr in both]
    assert "see it badly" not in changed(copy, warnings=[one.to_json() for one in warnings_of(views)])
    write_training_views(copy.evaluation / "pictures", bad_views(views))
    text = page_of(copy)
    assert text.count("Training camera d: the photo, and the asset") == 1 and "Training camera a" not in text


def test_the_asset_has_one_size(page: str) -> None:
    """Meshes, video and reflection, as the scores count them."""
    assert '<dt>Size</dt><dd class="value">7\u00a0KB</dd>' in page


def test_a_figure_that_is_not_there_leaves_no_empty_tile(copy: SubjectFolders) -> None:
    cost = read_json(copy.metrics)["cost"]
    del cost["train_seconds"], cost["device"]
    tiles = changed(copy, cost=cost).split('class="tiles"')[1].split("</dl>")[0]
    assert "<dt>Triangles</dt>" in tiles and "<dt>Training</dt>" not in tiles
    assert 'class="value">–' not in tiles and 'class="note"></dd>' not in tiles


def test_the_film_of_every_held_out_camera_is_in_it(page: str) -> None:
    assert [(film["camera"], len(film["frames"])) for film in films_of(page)] == [("cam3", FRAMES)]
    assert page.index('id="compare"') < page.index("<video")


def test_frames_have_one_name_everywhere(page: str) -> None:
    """The capture's name, and the number that the player shows."""
    names = [f"{k:06d} ({k + 1} of {FRAMES})" for k in range(FRAMES)]
    assert films_of(page)[0]["labels"] == names
    assert f"Frame {names[FRAMES // 2]}, decoded" in page
    assert f"camera cam3, frame {names[0]};" in page  # the worst, at the head


def test_a_missing_asset_is_named(copy: SubjectFolders) -> None:
    shutil.rmtree(copy.asset)
    with pytest.raises(UserError) as error:
        make_report(copy)
    assert error.value.file == copy.asset


def test_a_damaged_sheet_and_other_films_are_refused(copy: SubjectFolders) -> None:
    write_json(copy.evaluation / FILMS, [{"camera": "a", "file": "../metrics.json", "fps": 30.0, "frames": []}])
    with pytest.raises(UserError, match="list of films"):
        make_report(copy)
    write_json(copy.evaluation / FILMS, [])
    (copy.evaluation / "contact_sheet.png").write_text("no picture")
    with pytest.raises(UserError, match="damaged"):
        make_report(copy)


def test_the_worst_patch_is_named(copy: SubjectFolders) -> None:
    page = changed(copy, worst_patch={"psnr": 12.5, "camera": "cam3", "frame": "000001"})
    assert "camera cam3, frame 000001 (2 of 3); 12.50 dB in the square" in page


def test_the_command_finds_the_subjects_that_have_scores(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no subject has been evaluated"):
        evaluated_subjects(None, tmp_path)
    write_json(tmp_path / "b" / "metrics.json", {})
    write_json(tmp_path / "a" / "metrics.json", {})
    (tmp_path / "c").mkdir()
    assert [found.root.name for found in evaluated_subjects(None, tmp_path)] == ["a", "b"]


def test_the_command_says_where_the_page_lies(copy: SubjectFolders) -> None:
    done = CliRunner().invoke(app, ["report", "--data", str(copy.root.parent)])
    assert done.exit_code == 0
    assert str(copy.root / "report.html") in done.output
