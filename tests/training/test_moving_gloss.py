"""The reflection of a head that turns: its light stays with the room."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.params import ReflectionParams
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.training.explicit.gloss import GlossFit
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.reflection import GlossMethod
from facefolds_core.training.explicit.reflection_maps import Maps, SeenRays, surface_normals
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import StillRays, trace_views
from tests.geometry.test_track import about
from tests.scenes import make_scene
from tests.training.takes import params
from tests.training.test_explicit_kernels import random_cut
from tests.training.test_moving import TURNED, WINDOW, layers, rays


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return make_scene(tmp_path_factory.mktemp("moving") / "scene", size=24, surface_radius=0.33, mattes=True)


def model() -> RadianceManifolds:
    """Opaque layers that mirror a room which is light to the left alone."""
    reflection = Reflection(ReflectionShape((2, 2), 4))
    textures = GridTextures(WINDOW, (4, 4), 3, 1, reflection)
    with torch.no_grad():
        textures.layers[..., 3] = 5.0
        reflection.gloss.fill_(0.5)
        reflection.normals.copy_(torch.tensor([1.0, 0, 0]))
        reflection.environment[:, 2:] = 1.0
    return RadianceManifolds(layers(), textures).eval()


def test_a_turned_head_mirrors_what_is_there_in_the_room(scene: Scene) -> None:
    """A quarter turn to its left, and to its right: what it has before it is what the room has there."""
    camera, turned = scene.cameras[scene.indices("train")[0]], about((0, 0, 1), 90)
    poses = [None, *(Similarity(1.0, R, np.zeros(3)) for R in (np.eye(3), turned, turned.T))]
    pictures = [ModelView(model(), camera, pose).render(0) for pose in poses]
    brightness = [float(picture[0].mean()) for picture in pictures]
    np.testing.assert_array_equal(pictures[0][0], pictures[1][0])
    assert brightness[2] > 2 * brightness[3]
    assert all(np.array_equal(picture[1], pictures[0][1]) for picture in pictures)


class Noise:
    """Other pictures in each frame."""

    behind = np.tile(np.array([0.5, 0.5, 0.5, 0], np.float32), (6, 1))

    def cut(self, index: int) -> np.ndarray:
        return random_cut(np.random.default_rng(index), (6, 24 * 24))


def test_the_rays_of_a_fit_are_every_so_many_th_of_all_frames_together(scene: Scene) -> None:
    turns = Track.of([about((0, 0, 1), 5.0 * k) for k in range(6)], np.zeros((6, 3)))
    source = rays(replace(scene, frame_ids=tuple("abcdef"), poses=turns), share=150)
    state = TextureState((8, 8), 3, 6, torch.full((2, 2, 3), 0.5), params())
    state.layers[0] = 4 * torch.randn(state.layers[0].shape, generator=torch.Generator().manual_seed(0))
    fits = [
        GlossFit(layers().chart, WINDOW, ReflectionParams(), turns, GlossMethod(rays=most, moving_frames=5))
        for most in (10**6, 100)
    ]
    every, some = (fit.look(state, source, Noise()) for fit in fits)
    step = -(-len(every.st) // 100)
    assert step > 1 and len({turn.tobytes() for turn in some.turns}) == 5
    for field in fields(SeenRays):
        np.testing.assert_array_equal(getattr(some, field.name), getattr(every, field.name)[::step])


def test_steps_are_lit_as_the_head_stands_in_their_frame(scene: Scene) -> None:
    """In each frame another picture of the room, that of the model at the layer in the middle."""
    turns = Track.of([about((0, 0, 1), 20.0 * k) for k in range(2)], np.zeros((2, 3)))
    source = rays(replace(scene, frame_ids=tuple("ab"), poses=turns), share=150)
    state = TextureState((8, 8), 3, 2, torch.full((2, 2, 3), 0.5), params())
    given = ReflectionParams(texels=6, environment_texels=5)
    gloss = GlossFit(layers().chart, WINDOW, given, turns)
    views, _ = source.part(1, 0, 1)
    gloss.light(state, views, 1)
    assert len(state.shine) == 0  # nothing is known yet
    surface = surface_normals(np.full((20, 20), 0.33), layers().chart, WINDOW, (6, 6), 1.0)
    light = np.random.default_rng(0).random((5, 5, 3), np.float32)
    gloss.maps = replace(Maps.blank(surface, given), environment=light)
    gloss.light(state, views, 1)
    st = (torch.from_numpy(views.codes[:, 1].astype(np.float32)) - 1) / 65534
    held = views.codes[:, 1, 0] > 0
    turn = torch.from_numpy(turns.at(1).rotation.astype(np.float32))
    expected = gloss.maps.model().added(st, torch.from_numpy(views.directions), turn).detach().numpy()
    assert held.mean() > 0.8
    np.testing.assert_allclose(state.shine[held], expected[held], atol=2e-5)


def test_rays_that_are_clear_reflect_in_the_middle(scene: Scene) -> None:
    """Not in the corner of the window, where a mean over no opacity lies."""
    source = rays(scene, share=150)
    views, _ = source.part(0, 0, 1)
    seen = SeenRays.middle(views)
    half = replace(seen, st=0 * seen.st + 0.25, opacity=np.linspace(0, 1, len(seen.st), dtype=np.float32))
    found = half.filled(views).st
    clear = half.opacity < 0.1
    np.testing.assert_array_equal(found[clear], seen.st[clear])
    np.testing.assert_array_equal(found[~clear], 0.25)


def test_nothing_is_fitted_before_anything_is_opaque(scene: Scene) -> None:
    """No gloss would be found then, and without gloss no light ever after."""
    state = TextureState((8, 8), 3, 6, torch.full((2, 2, 3), 0.5), params())
    source = StillRays(trace_views(scene, layers(), 1))
    gloss = GlossFit(layers().chart, WINDOW, ReflectionParams(texels=4, environment_texels=4), None)
    gloss.follow(state, source, Noise(), layers().radii()[..., 1])
    for logit, fitted in ((-5.0, False), (5.0, True)):
        state.layers[0, ..., 3] = logit
        gloss.fit(state, source, Noise(), done=False)
        assert (gloss.maps is not None) == fitted


@pytest.mark.slow
def test_it_is_looked_for(scene: Scene, tmp_path: Path) -> None:
    reflection = ReflectionParams(texels=4, environment_texels=4)
    given = params().model_copy(update={"reflection": reflection})
    fit = fit_explicit(replace(scene, poses=TURNED), given, tmp_path / "log").fit
    assert fit is not None
    assert {"reflection", "smooth_reflection", "no_reflection"} & {event["kind"] for event in fit["events"]}
