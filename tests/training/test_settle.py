"""Frames' colours in closed form: against a dense solution, in one frame alone, on any number of threads."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from facefolds_core.training.explicit import reference, settle
from facefolds_core.training.explicit.settle import RIDGE, settle_frame
from facefolds_core.training.explicit.state import TextureState
from tests.threads import on_threads
from tests.training.test_follow import Film, unlit

FRAME = 2


class FewRays(Film):
    """As few as are all looked at."""

    rays = 2500


def moving_film() -> Film:
    """Every frame has another pattern, as fine as texels."""
    film, rng = FewRays(), np.random.default_rng(7)
    codes = torch.from_numpy(film.source.views.codes.astype(np.int32))
    for frame in range(film.frames):
        pattern = torch.zeros(*film.shape, 1, 4)
        pattern[..., :3] = torch.from_numpy(rng.uniform(0.2, 0.8, (*film.shape, 1, 3)))
        film.truth[frame] = reference.look_up(codes, pattern)[:, 0, :3].numpy()
    film.images = np.rint(255 * film.truth)
    return film


def settled(film: Film) -> TextureState:
    state = film.state()
    settle_frame(state, film.source, film, FRAME, unlit)  # type: ignore[arg-type]
    return state


def dense(film: Film) -> np.ndarray:
    """(M, 3): the least of sum |C - I|^2 + RIDGE |x|^2, by its normal equations."""
    codes = torch.from_numpy(film.source.views.codes.astype(np.int32))
    size, columns = film.shape[0] * film.shape[1], []
    for texel in range(size):
        one = torch.zeros(size, 1, 4)
        one[texel, 0, 0] = 1
        columns.append(reference.look_up(codes, one.view(*film.shape, 1, 4))[:, 0, 0].numpy())
    matrix = np.stack(columns, 1).astype(np.float64)
    left = film.images[FRAME] / 255 - film.usual
    return np.linalg.solve(matrix.T @ matrix + RIDGE * np.eye(size), matrix.T @ left)


def test_many_iterations_find_the_least_squares(monkeypatch: pytest.MonkeyPatch) -> None:
    film = moving_film()
    monkeypatch.setattr(settle, "ITERATIONS", 60)
    found = settled(film).frame_colour[0, FRAME].numpy()
    np.testing.assert_allclose(found, dense(film), atol=2e-3)  # the layer's alpha is .9999


def test_the_usual_ones_come_near_to_it() -> None:
    film = moving_film()
    found, least = settled(film).frame_colour[0, FRAME].numpy(), dense(film)
    assert np.abs(found - least).mean() < 0.1 * np.abs(least).mean()


def test_other_frames_and_what_they_share_stay() -> None:
    film = moving_film()
    state, before = settled(film), film.state()
    others = [frame for frame in range(film.frames) if frame != FRAME]
    assert not state.frame_colour[0, others].any() and not state.gradient.any()
    for name in ("colour", "layers", "frame_alpha"):
        assert torch.equal(getattr(state, name), getattr(before, name))


def test_what_is_right_stays_as_it_is() -> None:
    film = Film()
    film.images[:] = np.rint(film.usual * 255)
    assert settled(film).frame_colour.abs().max() < 3e-3  # 8 bits


def test_it_does_not_depend_on_the_number_of_threads() -> None:
    found = []
    for threads in (1, 2):
        with on_threads(threads):
            found.append(settled(moving_film()).frame_colour.clone())
    assert torch.equal(*found)
