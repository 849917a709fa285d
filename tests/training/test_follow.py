"""Frames that lag behind what moves: which texels those are, and that a change in one frame and place is followed."""

from __future__ import annotations

import numpy as np
import torch

from facefolds_core.kernels import hit_codes
from facefolds_core.kernels.adam import decays
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit import follow_kernel, shading_kernel
from facefolds_core.training.explicit.follow import _apart, _met, follow, follow_frame, lagging, mean_errors
from facefolds_core.training.explicit.rates import ALPHA_RATE, BETAS
from facefolds_core.training.explicit.state import MIN_LIGHT, TextureState
from facefolds_core.training.explicit.targets import ALL_COLOURS
from facefolds_core.training.explicit.views import StillRays, Views
from tests.threads import each_of
from tests.training import reference
from tests.training.rays import one_each

PARAMS = ExplicitParams()
LAYERS, SHAPE, RAYS = 4, (9, 7), 600
RATES = np.array([PARAMS.follow.rate, PARAMS.follow.rate * ALPHA_RATE], np.float32)


def random_views(rays: int = RAYS) -> Views:
    rng = np.random.default_rng(0)
    codes = rng.integers(1, 65536, (rays, LAYERS, 2)).astype(np.uint16)
    codes[rng.random((rays, LAYERS)) < 0.2] = 0
    return one_each(codes)


def random_texture() -> np.ndarray:
    return np.random.default_rng(1).random((*SHAPE, LAYERS, 4), np.float32)


def test_light_on_chosen_texels_matches_the_reference() -> None:
    given = random_views().codes, random_texture(), np.random.default_rng(3).random(SHAPE) < 0.5
    found = follow_kernel.light_on(*given, MIN_LIGHT)
    expected = reference.light_on(
        torch.from_numpy(given[0].astype(np.int32)), *map(torch.from_numpy, given[1:]), MIN_LIGHT
    )
    torch.testing.assert_close(torch.from_numpy(found), expected, atol=1e-6, rtol=0)


def test_a_step_is_the_frames_part_of_one_of_all_and_leaves_other_texels() -> None:
    torch.manual_seed(0)
    m, own = SHAPE[0] * SHAPE[1], np.array([3, 4, 20])
    near = np.array([3, 4, 5, 20, 21])
    static = torch.rand(m, 3), torch.randn(m, LAYERS, 4)
    values = torch.randn(m, 3) * 0.1, torch.randn(m, LAYERS)
    moments = torch.rand(2, 3, 3), torch.rand(2, 3, LAYERS)
    texture = reference.activate(*static, *values)
    gradient = torch.zeros(m, LAYERS, 4)
    gradient[near] = torch.randn(len(near), LAYERS, 4)
    rates, correct = torch.tensor([0.02, 0.3]), torch.tensor([1.5, 2.0])
    compiled = [x.clone().numpy() for x in (*values, *moments, texture)]
    pushed = gradient.permute(1, 0, 2).contiguous().numpy()
    tail = rates.numpy(), correct.numpy(), decays(BETAS)
    follow_kernel.follow_step(own, near, *(x.numpy() for x in static), *compiled, pushed, *tail)
    frame = [torch.cat([value[own][None], moment]) for value, moment in zip(values, moments, strict=True)]
    still, all_rates = torch.zeros(3, 3, LAYERS, 4), torch.cat([torch.zeros(3), rates])
    correct = torch.cat([torch.ones(2), correct])
    reference.adam_step(torch.zeros(3, 3, 3), still, *frame, texture[own], gradient[own], all_rates, correct, BETAS)
    shown = reference.activate(*(part[own] for part in static), *(state[0] for state in frame))
    expected = *(state[0] for state in frame), *(state[1:] for state in frame), shown
    found = *(part[own] for part in compiled[:2]), *compiled[2:4], compiled[4][own]
    for a, b in zip(found, expected, strict=True):
        torch.testing.assert_close(torch.from_numpy(a), b, atol=1e-5, rtol=1e-4)
    others = np.setdiff1d(np.arange(m), own)
    for part, before in zip((*compiled[:2], compiled[4]), (*values, texture), strict=True):
        np.testing.assert_array_equal(part[others], before.numpy()[others])
    assert not pushed.any()


def test_corners_of_an_array_are_those_of_the_kernels() -> None:
    codes = np.random.default_rng(4).integers(1, 65536, 1000).astype(np.uint16)
    alone = [hit_codes.corner.py_func(int(code), 37)[0] for code in codes]
    np.testing.assert_array_equal(hit_codes.before(codes, 37), alone)


def test_texels_in_error_take_their_neighbours_along() -> None:
    errors = np.zeros((5 * 6, 3), np.float32)
    errors[2 * 6 + 3, 1] = -0.1
    errors[0, 0] = 0.01
    expected = np.zeros((5, 6), bool)
    expected[1:4, 2:5] = True
    np.testing.assert_array_equal(lagging(errors, (5, 6), 0.02).reshape(5, 6), expected)


class Film:
    """Cut-outs, opaque everywhere, of rays that meet one opaque layer, bilinear, at random; in one frame a patch has
    another colour."""

    shape, frames, moved, rays = (16, 16), 5, 3, 6000
    behind = np.zeros((1, 4), np.float32)
    usual, other = np.array([0.8, 0.6, 0.5]), np.array([0.2, 0.3, 0.1])

    def __init__(self, noise: float = 0.0) -> None:
        rng = np.random.default_rng(5)
        codes = rng.integers(1, 65536, (self.rays, 1, 2)).astype(np.uint16)
        self.source = StillRays(one_each(codes))
        place = (codes[:, 0, :].astype(float) - 1) / hit_codes.SCALE
        self.inside = ((place > 0.37) & (place < 0.53)).all(1)
        self.truth = np.tile(self.usual, (self.frames, self.rays, 1))
        self.truth[self.moved, ((place > 0.3) & (place < 0.6)).all(1)] = self.other
        self.images = np.rint(255 * (self.truth + noise * rng.normal(size=self.truth.shape)).clip(0, 1))
        self.opaque = np.full((self.rays, 1), 255)
        self.state = self.of_layers(9.0)

    def cut(self, index: int) -> np.ndarray:
        return np.concatenate([self.images[index], self.opaque], -1).astype(np.uint8)[None]

    def average(self) -> None:
        self.behind[:] = ALL_COLOURS

    def of_layers(self, *logits: float) -> TextureState:
        """All of the usual colour."""
        start = torch.tensor(self.usual, dtype=torch.float32).expand(2, 2, 3)
        state = TextureState(self.shape, len(logits), self.frames, start, PARAMS)
        state.layers[0, ..., 3] = torch.tensor(logits)
        return state

    def followed(self) -> tuple[np.ndarray, float]:
        return follow(self.state, self.source, self, RATES, unlit)

    def errors(self, frame: int) -> np.ndarray:
        return mean_errors(self.state, self.source, self, frame, unlit)

    def error(self, frame: int) -> float:
        """RMS over the rays of a frame in the patch, a texel from its edge."""
        codes = torch.from_numpy(self.source.views.codes.astype(np.int32))
        seen = reference.look_up(codes, self.state.activated(frame).view(*self.shape, 1, 4))[:, 0, :3].numpy()
        return float(np.sqrt(((seen - self.truth[frame])[self.inside] ** 2).mean()))


def unlit(state: TextureState, views: Views, frame: int) -> None:
    """No reflection."""


def test_a_patch_that_changes_in_one_frame_is_followed() -> None:
    film = Film()
    state = film.state
    assert film.error(film.moved) > 0.4
    _, share = film.followed()
    assert film.error(film.moved) < 0.04
    for frame in set(range(film.frames)) - {film.moved}:
        assert not state.frame_colour[0, frame].any() and not state.frame_alpha[0, frame].any()
    assert 0 < share < 0.1
    assert not state.gradient.any()
    for values in (state.colour, state.layers, state.frame_colour, state.frame_alpha):
        assert not values[1:].any()  # moments of the steps before


def test_noise_and_what_all_frames_show_are_no_motion() -> None:
    film = Film(noise=0.02)
    film.images[film.moved] = film.images[0]
    film.state.colour[0] += 0.1  # wrong, in all frames alike
    usual, share = film.followed()
    assert share == 0 and usual.min() > 0.09
    assert not film.state.frame_colour.any()


def test_mean_errors_are_those_of_the_texture() -> None:
    film = Film()
    film.images[:] = np.rint(255 * film.usual)
    film.state.frame_colour[0, 1] += torch.tensor([0.1, 0.0, -0.05])
    np.testing.assert_allclose(film.errors(1), np.tile([0.1, 0.0, -0.05], (256, 1)), atol=3e-3)  # alpha .9999, 8 bits


def test_a_frame_alone_goes_towards_its_pictures() -> None:
    film = Film()
    errors = film.errors(film.moved)
    chosen = lagging(errors, film.shape, PARAMS.follow.min_error)
    follow_frame(film.state, film.source, film, film.moved, chosen, errors, RATES, unlit)
    assert film.error(film.moved) < 0.04


def test_following_does_not_depend_on_the_number_of_threads() -> None:
    def followed() -> torch.Tensor:
        film = Film()
        film.followed()
        return film.state.frame_colour

    assert torch.equal(*each_of((1, 2), followed))


def test_where_everything_moves_a_step_takes_a_quarter_of_a_usual_one() -> None:
    assert [_apart(rays, 40_000.0) for rays in (10, 8_000, 20_000, 100_000)] == [2, 2, 2, 10]


def test_texels_with_a_gradient_are_all_known() -> None:
    views = random_views(40)
    sums = np.zeros((LAYERS, *SHAPE, 4), np.float32)
    rays = views.arrays
    blank, none = np.zeros((1, 40, 4), np.uint8), np.zeros((0, 3), np.float32)
    behind, texture = np.zeros((1, 4), np.float32), random_texture() * 0.3
    shading_kernel.shade(*rays, np.arange(40), blank, behind, texture, none, sums, 0.0, 0.0, True)
    met = np.flatnonzero(sums[..., 3].sum(0).ravel())
    assert not np.setdiff1d(met, _met(views, SHAPE)).size


def test_where_something_moves_all_frames_are_asked_by_their_whole_error() -> None:
    film = Film()
    film.state.colour[0] += 0.1  # as a mean over the frames would be
    usual, _ = film.followed()
    first = film.state.frame_colour[0, 0].abs().amax(-1).numpy() > 0
    assert first.any() and not first.all()
    assert not usual[first].any()
    assert all(film.error(frame) < 0.04 for frame in range(film.frames))


def test_what_is_seen_against_nothing_stays_transparent() -> None:
    """A clear layer before an opaque one: half of the rays pass the clear one alone, and end behind it."""
    film = Film()
    rng = np.random.default_rng(6)
    codes = rng.integers(1, 65536, (film.rays, 2, 2)).astype(np.uint16)
    alone = rng.random(film.rays) < 0.5
    codes[alone, 1] = 0
    film.source = StillRays(one_each(codes))
    film.images[:] = 255 * film.usual
    film.images[film.moved] = 255 * film.other
    film.images[:, alone] = 0
    film.opaque[alone] = 0
    film.state = film.of_layers(-3.0, 9.0)
    _, share = film.followed()
    assert share > 0.1
    assert film.state.activated(film.moved)[:, 0, 3].max() < 0.1
