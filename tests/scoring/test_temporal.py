"""What is explained of films whose change is known."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.scoring.temporal import Change, Film, Sums, change_of

FRAMES = 10
Array = np.ndarray


def truth() -> Array:
    """(FRAMES, 8, 8, 3) noise."""
    return np.random.default_rng(0).uniform(0, 1, (FRAMES, 8, 8, 3))


def change(pictures: Array, photos: Array, weights: Array | None = None, at: list[int] | None = None) -> Change:
    film = Film()
    for i, k in enumerate(range(FRAMES) if at is None else at):
        film.add(k, {"asset": pictures[i]}, photos[i], np.ones((8, 8)) if weights is None else weights[i])
    return change_of([film.sums()["asset"]])


@pytest.mark.parametrize(
    ("pictures", "explained"),
    [
        (truth(), 1),
        (truth() + 0.25, 1),
        *((np.full((FRAMES, 8, 8, 3), value), 0) for value in (0.0, 0.7)),  # a frozen film
        *((truth().mean(0) + s * (truth() - truth().mean(0)), e) for s, e in ((0.5, 0.75), (-1.0, -3.0), (2.0, 0.0))),
    ],
    ids=["itself", "constant error", "black", "grey", "half", "the reverse", "twice"],
)
def test_so_much_of_the_motion_explains_so_much_of_the_variance(pictures: Array, explained: float) -> None:
    found = change(pictures, truth())
    assert found.temporal == pytest.approx(explained, abs=1e-9)
    assert explained != 1 or found.flicker == pytest.approx(0, abs=1e-9)


def test_errors_count_where_and_when_the_photos_change() -> None:
    """A frozen film of one that changes in one half of the picture, in one frame, is as far off as that."""
    photos = np.full((FRAMES, 8, 8, 3), 0.5)
    photos[7, :, 4:] = 0.9
    frozen = np.full_like(photos, 0.5)
    mean, odd, usual = 0.54, 0.36**2, 0.04**2  # of the right half, and squared distances to it
    expected = odd * 0.4**2 / (odd + (FRAMES - 1) * usual)
    assert mean == pytest.approx(photos[:, 0, 7, 0].mean())
    assert change(frozen, photos).psnr_moving == pytest.approx(-10 * np.log10(expected))
    late = photos[[0, 0, 0, 7, 0, 0, 0, 0, 0, 0]]  # the error is the same, at the wrong time twice
    assert change(late, photos).psnr_moving < change(photos + 0.01, photos).psnr_moving  # type: ignore[operator]


def test_the_change_of_the_photos_is_their_deviation_over_time() -> None:
    assert change(truth(), truth()).truth_change == pytest.approx(np.sqrt(truth().var(0).mean()))


def test_frames_apart_are_no_pair() -> None:
    blinking = truth() + 0.1 * (np.arange(FRAMES) % 2)[:, None, None, None]
    found = change(blinking, truth(), at=[0, 1, *range(3, 11)])  # 1 and 3 are no neighbours: the error is not taken
    assert found.flicker == pytest.approx(0.1)
    assert change(blinking[:2], truth()[:2], at=[0, 5]).flicker is None


def test_what_is_uncovered_once_does_not_count() -> None:
    weights = np.ones((FRAMES, 8, 8))
    weights[4, :, 4:] = 0  # the right half shows the room in one frame
    wrong = truth()
    wrong[:, :, 4:] = 0
    assert change(wrong, truth(), weights).temporal == pytest.approx(1)


def test_one_frame_and_a_still_life_have_no_variance_to_explain() -> None:
    assert change(truth()[:1], truth()[:1], at=[0]) == Change(None, None, None, None)
    still = np.repeat(truth()[:1], FRAMES, 0)
    assert change(still, still).temporal is None


def test_cameras_are_summed_not_averaged() -> None:
    found = change_of([Sums(left=1, truth=10, values=1, pairs=1), Sums(left=89, truth=90, values=1, pairs=1)])
    assert found.temporal == pytest.approx(0.1)
