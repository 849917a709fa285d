"""What lies apart from the subject in the textures."""

from __future__ import annotations

import numpy as np
import torch

from facefolds_core.hit_codes import encode
from facefolds_core.params import ExplicitParams, PruningParams
from facefolds_core.training.explicit.clearing import painted_room, specks
from facefolds_core.training.explicit.silhouettes import Silhouettes
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import Shown, Views

PARAMS = PruningParams()


def _head() -> np.ndarray:
    opacity = np.zeros((60, 60))
    opacity[10:50, 10:40] = 1.0
    return opacity


def test_a_splinter_goes_and_the_head_with_its_soft_edge_stays() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    opacity[20, 40:42] = 0.1  # hair
    apart, count = specks(opacity, PARAMS)
    assert count == 1 and apart[30:34, 50:52].all()
    assert not apart[10:50, 10:40].any() and not apart[20, 40:42].any()


def test_a_large_second_body_stays() -> None:
    opacity = _head()
    opacity[10:50, 48:55] = 0.8  # a fifth of the head's
    apart, count = specks(opacity, PARAMS)
    assert count == 0 and not apart[10:50, 48:55].any()


def test_fog_far_from_everything_goes_with_the_splinters() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    opacity[2:5, 50:58] = 0.1
    assert specks(opacity, PARAMS)[0][2:5, 50:58].all()


def test_nothing_is_taken_where_there_are_no_splinters() -> None:
    opacity = _head()
    opacity[2:5, 50:58] = 0.1
    assert not specks(opacity, PARAMS)[0].any()
    assert not specks(np.zeros((4, 4)), PARAMS)[0].any()


def test_all_can_be_kept() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    apart, count = specks(opacity, PARAMS.model_copy(update={"speck_share": 0.0}))
    assert count == 0 and not apart.any()


class OneRay:
    """A ray through the centre of each of 32 x 32 texels of one layer."""

    def part(self, frame: int, phase: int, parts: int) -> tuple[Views, np.ndarray]:
        t, s = (np.mgrid[0:32, 0:32].reshape(2, -1) + 0.5) / 32
        codes = encode(np.stack([s, t], -1))[:, None].astype(np.uint16)
        rays = np.arange(1024)
        views = Views(codes, np.zeros(1024, np.int32), rays.astype(np.int32), np.zeros((1024, 3), np.float32))
        return views, rays

    count = 1024


def test_paint_that_looks_like_the_room_is_cleared_and_the_subject_stays() -> None:
    """A room of grey 0.2; on the right half stands something of 0.6. All texels are opaque and show the picture."""
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2}})
    picture = np.where(np.arange(1024) % 32 < 16, 0.2, 0.6)
    background = torch.full((1, 1024, 3), 0.2)
    state = TextureState((32, 32), 1, 1, torch.full((2, 2, 4), 0.5), background, params)
    state.colour[0] = torch.from_numpy(picture).float()[:, None]
    state.layers[0, ..., 3] = 8.0
    shown = Shown(np.rint(255 * picture)[None, :, None].repeat(3, 2).astype(np.uint8))
    poor = painted_room(state, OneRay(), shown, 1, params.pruning).view(32, 32)
    assert poor[:, :8].all() and not poor[:, 16:].any()
    kept = params.pruning.model_copy(update={"room_gain": 0.0})
    assert not painted_room(state, OneRay(), shown, 1, kept).any()


def test_one_speck_does_not_keep_what_looks_like_the_room() -> None:
    """Opaque paint like a room of 0.2; of its rays one in 16 shows a speck of 0.9, or one in two does."""
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2}})
    row, column = np.divmod(np.arange(1024), 32)
    state = TextureState((32, 32), 1, 1, torch.full((2, 2, 4), 0.5), torch.full((1, 1024, 3), 0.2), params)
    state.layers[0, ..., 3] = 8.0
    # Layers stand in the middle only: beside them the room is seen.
    inside = (abs(row - 15.5) < 13) & (abs(column - 15.5) < 13)
    state.layers[0, ..., 3] = torch.from_numpy(np.where(inside, 8.0, -8.0)).float()[:, None]
    asked = params.pruning.model_copy(update={"room_gain": 0.0, "beside_layers_gain": 0.001})
    for specks_there, cleared in (((row % 4 == 0) & (column % 4 == 0), True), ((row + column) % 2 == 0, False)):
        picture = np.where(specks_there & inside, 0.9, 0.2)
        state.colour[0] = torch.from_numpy(picture).float()[:, None]
        shown = Shown(np.rint(255 * picture)[None, :, None].repeat(3, 2).astype(np.uint8))
        poor = painted_room(state, OneRay(), shown, 1, asked, size=(32, 32)).view(32, 32)[6:26, 6:26]
        assert poor.all() if cleared else not poor.any()


def test_one_ray_that_loses_much_does_not_clear_what_the_others_need() -> None:
    """Layers of 0.4 before a room of 0.2; one ray in 16 shows the room: a loss of a hundred times the least gain."""
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2, "room_gain": 0, "beside_layers_gain": 4e-4}})
    row, column = np.divmod(np.arange(1024), 32)
    inside = (abs(row - 15.5) < 13) & (abs(column - 15.5) < 13)
    state = TextureState((32, 32), 1, 1, torch.full((2, 2, 4), 0.5), torch.full((1, 1024, 3), 0.2), params)
    state.colour[0] = 0.4
    state.layers[0, ..., 3] = torch.from_numpy(np.where(inside, 8.0, -8.0)).float()[:, None]
    wrong = (row % 4 == 0) & (column % 4 == 0)
    shown = Shown(np.where(inside & ~wrong, 102, 51).astype(np.uint8)[None, :, None].repeat(3, 2))
    kept = painted_room(state, OneRay(), shown, 1, params.pruning, size=(32, 32)).view(32, 32)[6:26, 6:26]
    assert not kept.any()


def test_what_only_shines_is_no_paint_of_the_room() -> None:
    """Texels as grey as the room, which reflect 0.4 on the right half, where the picture has 0.6."""
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2}})
    right = np.arange(1024) % 32 >= 16
    state = TextureState((32, 32), 1, 1, torch.full((2, 2, 4), 0.5), torch.full((1, 1024, 3), 0.2), params)
    state.colour[0], state.layers[0, ..., 3] = 0.2, 8.0
    shown = Shown(np.where(right, 153, 51).astype(np.uint8)[None, :, None].repeat(3, 2))
    assert painted_room(state, OneRay(), shown, 1, params.pruning).all()

    def light(state: TextureState, views: Views, frame: int) -> None:
        state.shine = np.where(right, 0.4, 0.0).astype(np.float32)[:, None].repeat(3, 1)

    poor = painted_room(state, OneRay(), shown, 1, params.pruning, None, light).view(32, 32)
    assert poor[:, :8].all() and not poor[:, 16:].any()


class Turning(OneRay):
    """In frame 1 half as many rays."""

    def part(self, frame: int, phase: int, parts: int) -> tuple[Views, np.ndarray]:
        views, rays = super().part(frame, phase, parts)
        chosen = rays[:: frame + 1]
        return views.part(chosen), np.arange(len(chosen))


def test_a_turning_heads_rays_are_lit_in_each_frame_anew() -> None:
    """What shines is that of the rays at hand, also where the outline is known in another frame."""
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2, "room_frames": 1, "beside_gain": 0.01}})
    state = TextureState((32, 32), 1, 2, torch.full((2, 2, 4), 0.5), torch.full((1, 1024, 3), 0.2), params)
    state.colour[0], state.layers[0, ..., 3] = 0.2, 8.0
    beside = Silhouettes(1, np.array([0]), np.zeros((1, 1024), np.uint8))

    def light(state: TextureState, views: Views, frame: int) -> None:
        state.shine = np.full((len(views.pixel), 3), 0.4, np.float32)

    lit, bare = (Shown(np.full((1, 1024, 3), value, np.uint8)) for value in (153, 51))
    assert not painted_room(state, Turning(), lit, 1, params.pruning, beside, light).any()
    assert painted_room(state, Turning(), bare, 1, params.pruning, beside, light).all()


def _half_room(params: ExplicitParams) -> tuple[TextureState, Shown]:
    """A room of grey 0.2, and opaque texels that show 0.245 everywhere: a gain of 0.002."""
    state = TextureState((32, 32), 1, 1, torch.full((2, 2, 4), 0.5), torch.full((1, 1024, 3), 0.2), params)
    state.colour[0] = 0.245
    state.layers[0, ..., 3] = 8.0
    return state, Shown(np.full((1, 1024, 3), round(255 * 0.245), np.uint8))


def test_paint_on_pixels_beside_the_subject_is_cleared_earlier() -> None:
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2}})
    state, shown = _half_room(params)
    right = np.where(np.arange(1024) % 32 < 16, 0, 255).astype(np.uint8)[None]
    outlines = Silhouettes(0, np.array([0]), right)
    poor = painted_room(state, OneRay(), shown, 1, params.pruning, outlines).view(32, 32)
    assert poor[:, :12].all() and not poor[:, 20:].any()
    assert not painted_room(state, OneRay(), shown, 1, params.pruning).any()  # nothing is known of the outline
    other = Silhouettes(0, np.array([-1]), right)  # of another camera alone
    assert not painted_room(state, OneRay(), shown, 1, params.pruning, other).any()
    for key, value in (("beside_gain", 0.0), ("beside_gain", 0.0015)):
        kept = params.pruning.model_copy(update={key: value})
        assert not painted_room(state, OneRay(), shown, 1, kept, outlines).any()


def test_nothing_of_the_subject_is_cleared_where_only_what_lies_beside_it_is_to_be() -> None:
    params = ExplicitParams.model_validate({"pruning": {"room_texels": 2, "room_gain": 0.0}})
    state, shown = _half_room(params)
    state.colour[0] = 0.9  # far worse than the bare room
    inside = Silhouettes(0, np.array([0]), np.full((1, 1024), 255, np.uint8))
    assert not painted_room(state, OneRay(), shown, 1, params.pruning, inside).any()


def test_outlines_of_cameras_that_have_none_are_unknown() -> None:
    known = Silhouettes(0, np.array([1, -1, 0]), np.array([[0, 255], [51, 102]], np.uint8))
    found = known.of(np.array([0, 0, 1, 2]), np.array([0, 1, 0, 1]))
    np.testing.assert_allclose(found, [0.2, 0.4, np.nan, 1.0], rtol=1e-6)
