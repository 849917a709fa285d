"""What the layers begin with: the opacity and the colours that the subject's Gaussians put on them; and what goes at
the end."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import torch

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.state import BELIEF, FAINT, MAX_OPACITY, MIN_OPACITY, TextureState, loose
from tests.training.rays import one_each


def grey() -> TextureState:
    """Of two frames, three layers of 24 texels."""
    return TextureState((4, 6), 3, 2, torch.full((2, 2, 3), 0.5), ExplicitParams())


def test_layers_begin_with_what_is_given_and_keep_what_they_have_learnt() -> None:
    rng = np.random.default_rng(0)
    start = torch.tensor([0.3, 0.4, 0.5]).expand(2, 2, 3)
    state = TextureState((4, 6), 3, 2, start, ExplicitParams())
    opacity, rgb = rng.uniform(0.1, 0.9, (24, 3)).astype(np.float32), rng.random((24, 3, 3), np.float32)
    opacity[0], opacity[1] = 0, 1
    state.fill(opacity, rgb)
    begun = state.activated(1).clone().numpy()
    np.testing.assert_allclose(begun[..., 3], opacity.clip(MIN_OPACITY, MAX_OPACITY), atol=1e-5)
    np.testing.assert_allclose(begun[1:, :, :3], rgb[1:], atol=1e-5)
    np.testing.assert_allclose(begun[0, :, :3], np.tile((0.3, 0.4, 0.5), (3, 1)), atol=1e-5)  # nothing is there
    state.frame_alpha[0] += 1
    state.layers[1:] += 1
    state.fill(opacity[::-1].copy())
    again = state.activated(1).numpy()
    np.testing.assert_allclose(again[..., 3], opacity[::-1].clip(MIN_OPACITY, MAX_OPACITY), atol=1e-5)
    np.testing.assert_allclose(again[..., :3], begun[..., :3], atol=1e-5)
    assert not state.layers[1:].any()


def test_a_frame_begins_with_an_opacity_of_its_own() -> None:
    state = grey()
    usual, own = np.random.default_rng(0).uniform(0.1, 0.9, (2, 24, 3)).astype(np.float32)
    state.fill(usual)
    state.fill_frame(1, own)
    for frame, opacity in enumerate((usual, own)):
        np.testing.assert_allclose(state.activated(frame)[..., 3].numpy(), opacity, atol=1e-5)
    state.fill(usual)
    assert not state.frame_alpha.any()


def test_steps_draw_opacity_back_to_what_is_believed() -> None:
    """A step on rays that meet nothing changes logits by this alone: of the difference 1 - BELIEF is left."""
    state = grey()
    state.fill(np.full((24, 3), 0.5, np.float32))
    views = one_each(np.zeros((2, 3, 2), np.uint16))
    step = partial(state.step, views, np.arange(2), OneColour(), 0, 0.0, np.full(5, 0.1, np.float32))
    step()
    torch.testing.assert_close(state.layers[0, ..., 3], torch.zeros(24, 3))
    state.believe(np.full((24, 3), 0.9, np.float32))
    step()
    torch.testing.assert_close(state.layers[0, ..., 3], torch.full((24, 3), BELIEF * float(np.log(9))))
    assert not state.frame_alpha.any()


def test_what_stays_fainter_than_a_code_in_all_frames_goes() -> None:
    """Texels that no ray has met are as opaque as layers begin: a veil, layer by layer."""
    state = TextureState((1, 4), 1, 3, torch.full((2, 2, 3), 0.5), ExplicitParams())
    usual = np.array([[MIN_OPACITY], [0.9 * FAINT], [1.1 * FAINT], [0.5]], np.float32)
    shown = usual.copy()
    shown[1] = 0.3  # in one frame
    state.fill(usual)
    state.fill_frame(2, shown)
    state.clear()
    shown[0] = usual[0] = 0
    for frame, opacity in enumerate((usual, usual, shown)):
        np.testing.assert_allclose(state.activated(frame)[..., 3].numpy(), opacity, atol=2e-4)


class OneColour:
    """A picture of two pixels."""

    behind = np.array([[0.5, 0.5, 0.5, 0]], np.float32)

    def cut(self, index: int) -> np.ndarray:
        return np.full((1, 2, 4), 255, np.uint8)


def test_a_splinter_goes_with_fog_and_the_head_with_its_soft_edge_stays() -> None:
    """And a large second body."""
    opacity = np.zeros((60, 60))
    opacity[10:50, 10:40] = 1.0
    opacity[30:34, 50:52] = 0.8
    opacity[20, 40:42] = 0.1  # hair
    opacity[2:5, 50:58] = 0.1  # fog
    apart = loose(opacity)
    assert apart[30:34, 50:52].all() and apart[2:5, 50:58].all()
    assert not apart[10:50, 10:40].any() and not apart[20, 40:42].any()
    opacity[10:50, 48:55] = 0.8  # a fifth of the head's
    assert not loose(opacity)[10:50, 48:55].any()


@pytest.mark.parametrize("opacity", [0.0, 0.2])
def test_nothing_goes_where_nothing_is_opaque(opacity: float) -> None:
    assert not loose(np.full((4, 4), opacity)).any()
