"""What a metric of films is given, and what becomes of its answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.params import EvaluateParams
from facefolds_core.scoring.cvvdp import Screening, mean_jod
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.images import MASK_MARGIN
from facefolds_core.scoring.perceptual import Perceptual
from tests.scoring.fakes import FRAMES, flat_asset, flat_scene, half_mask, tiny_model


def count_frames(film: np.ndarray, truth: np.ndarray, fps: float) -> float:
    return float(len(film))


def test_it_sees_the_subject_alone_cropped_to_its_box() -> None:
    seen: list[tuple[int, ...]] = []

    def distance(film: np.ndarray, truth: np.ndarray, fps: float) -> float:
        seen.append(film.shape)
        return float(np.abs(film.astype(int) - truth).max())

    screening = Screening(distance, 60)
    truth, weight = np.full((40, 40, 3), 0.5), np.zeros((40, 40))
    weight[20:24, 20:24] = 1
    wrong = np.where(weight[..., None] > 0, truth, 0.0)  # beside the subject only
    for _ in range(3):
        screening.add({"model": wrong, "asset": wrong}, truth, weight)
    assert screening.judge(30) == {"model": 0, "asset": 0}
    assert set(seen) == {(3, 4 + 2 * MASK_MARGIN, 4 + 2 * MASK_MARGIN, 3)}


@pytest.mark.parametrize(("given", "most", "judged"), [(5, 3, 3), (5, 60, 5), (1, 60, None), (0, 60, None)])
def test_so_many_frames_are_judged_and_one_is_no_film(given: int, most: int, judged: int | None) -> None:
    screening = Screening(count_frames, most)
    picture = np.zeros((8, 8, 3))
    for _ in range(given):
        screening.add({"model": picture, "asset": picture}, picture, np.ones((8, 8)))
    assert screening.judge(30).get("asset") == judged


def test_the_mean_is_over_the_cameras_that_have_it() -> None:
    assert mean_jod([{"model": 8.0, "asset": 6.0}, {}, {"model": 10.0, "asset": 7.0}]) == {"model": 9.0, "asset": 6.5}
    assert mean_jod([{}]) == {}


def test_it_is_in_the_evaluation_where_there_is_one(tmp_path: Path) -> None:
    scene = flat_scene(tmp_path, masks={k: half_mask() for k in range(FRAMES)})
    perceptual = Perceptual(None, None, (), count_frames)
    found = evaluate(scene, tiny_model(), flat_asset(), EvaluateParams(), perceptual)
    assert {name: change.cvvdp for name, change in found.changes["holdout"].items()} == {
        "model": FRAMES,
        "diffuse": None,
        "asset": FRAMES,
        "asset_diffuse": None,
    }
