"""The shared reflection: kernels against torch, its fit against a known one, and whether it is left out."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import texel_uv, uv_to_directions
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.params import ReflectionParams
from facefolds_core.training.explicit.gloss import GlossFit
from facefolds_core.training.explicit.reflection import (
    GlossMethod,
    centred,
    fit_maps,
    gain_on_cameras,
    grounded,
)
from facefolds_core.training.explicit.reflection_kernel import look, normal_equations
from facefolds_core.training.explicit.reflection_maps import (
    Maps,
    SeenRays,
    surface_normals,
    tangents,
    tilted,
    values_at,
)
from tests.threads import each_of
from tests.training import reference
from tests.training.rays import one_each
from tests.training.test_explicit_kernels import random_cut

WINDOW = (-0.5, 0.4, -0.3, 0.6)
KEYS = ReflectionParams(enabled=True, texels=8, environment_texels=8)
PARAMS = GlossMethod()


def _random_maps(seed: int = 0, shape: tuple[int, int] = (8, 8)) -> Maps:
    rng = np.random.default_rng(seed)
    surface = np.stack([np.ones(shape), *(0.3 * rng.standard_normal((2, *shape)))], -1)
    surface /= np.linalg.norm(surface, axis=-1, keepdims=True)
    gloss, offset = rng.random(shape), 0.2 * rng.random((*shape, 3))
    light = rng.random((8, 8, 3))
    return Maps(*(np.asarray(x, np.float32) for x in (gloss, offset, surface, np.zeros((*shape, 2)), light)))


TRUTH = _random_maps(3)
START = Maps.blank(TRUTH.normals, KEYS)
"""The right normals, nothing else known."""


def _rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places, and directions from before the face."""
    rng = np.random.default_rng(1)
    along = np.stack([-np.ones(count), *rng.uniform(-0.8, 0.8, (2, count))], -1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return rng.random((count, 2), np.float32), along.astype(np.float32)


def _looked(st: np.ndarray, along: np.ndarray, turns: np.ndarray | None = None) -> SeenRays:
    """Opaque rays that show nothing."""
    return SeenRays(np.zeros(len(st), np.int32), along, st, np.ones(len(st), np.float32), np.zeros_like(along), turns)


def _turns(count: int) -> np.ndarray:
    """(count, 3, 3) of a head that nods and turns by up to 20 degrees."""
    angles = np.random.default_rng(4).uniform(-0.35, 0.35, (count, 3))
    return np.asarray(Rotation.from_euler("xyz", angles).as_matrix(), np.float32)


@pytest.mark.parametrize("turned", [False, True])
def test_compiled_reflection_is_that_of_the_model(turned: bool) -> None:
    """Turned-away normals included: there the direction goes on."""
    maps, turn = _random_maps(shape=(5, 7)), _turns(1)
    st, along = _rays(2000)
    along[::5] *= -1
    to_room = torch.from_numpy(turn[0]) if turned else None
    expected = maps.model().added(torch.from_numpy(st), torch.from_numpy(along), to_room)
    found = maps.added(_looked(st, along, np.repeat(turn, 2000, 0) if turned else None))
    torch.testing.assert_close(torch.from_numpy(found), expected.detach(), atol=2e-5, rtol=0)


def test_a_mirror_before_the_face_shows_what_is_behind_the_eye() -> None:
    """A normal along +x, seen from +x: the reflected direction is +x, in the middle of the environment."""
    module = Reflection(ReflectionShape((2, 2), 3))
    with torch.no_grad():
        module.gloss.fill_(1)
        module.normals.copy_(torch.tensor([1.0, 0, 0]))
        module.environment[1, 1] = torch.tensor([0.2, 0.4, 0.6])
        added = module.added(torch.tensor([[0.5, 0.5]]), torch.tensor([[-1.0, 0, 0]]))
    torch.testing.assert_close(added, torch.tensor([[0.2, 0.4, 0.6]]))


def test_look_is_the_difference_of_cut_out_and_reference() -> None:
    rng = np.random.default_rng(0)
    codes = rng.integers(0, 65536, (400, 4, 2)).astype(np.uint16)
    codes[codes[..., 1] == 0] = 0
    texture = rng.random((6, 9, 4, 4), np.float32)
    cut, behind = random_cut(rng, (1, 400)), rng.random((1, 3), np.float32)
    seen = np.zeros((400, 6), np.float32)
    look(codes, np.zeros(400, np.int32), np.arange(400, dtype=np.int32), cut, behind, texture, seen, 0.002)
    rgba = reference.look_up(torch.from_numpy(codes.astype(np.int32)), torch.from_numpy(texture))
    weights, through = reference.compositing_weights(rgba[..., 3])
    st = (torch.from_numpy(codes.astype(np.float32)) - 1) / 65534
    colour = (weights[..., None] * rgba[..., :3]).sum(1) + through[:, None] * torch.from_numpy(behind)
    wanted = reference.over(torch.from_numpy(cut[0]) / 255, torch.from_numpy(behind))
    expected = torch.cat([wanted - colour, 1 - through[:, None], (weights[..., None] * st).sum(1)], 1)
    torch.testing.assert_close(torch.from_numpy(seen), expected, atol=5e-3, rtol=0)  # what lies behind T < 0.002


def test_normal_equations_are_those_of_a_dense_matrix() -> None:
    rng = np.random.default_rng(0)
    st, weight = rng.random((300, 2), np.float32), rng.random(300, np.float32)
    wish = rng.random((300, 2), np.float32)
    h, w = 4, 5
    band, right = np.zeros((w + 2, h * w)), np.zeros((h * w, 2))
    normal_equations(st, weight, wish, h, w, band, right)
    rows = np.stack([values_at(one.reshape(h, w, 1), st) for one in np.eye(h * w, dtype=np.float32)], 1)[..., 0]
    full = (rows * weight[:, None]).T @ rows
    found = [np.diagflat(diagonal[: h * w - below], -below) for below, diagonal in enumerate(band)]
    np.testing.assert_allclose(sum(found), np.tril(full), atol=1e-4)
    np.testing.assert_allclose(right, rows.T @ wish, atol=1e-4)


def _seen(strength: float, turned: bool = False, maps: Maps = TRUTH) -> SeenRays:
    """Rays of eight cameras whose photos show `strength` times a known reflection, its mean in the layers."""
    looked = _looked(*_rays(20_000), _turns(20_000) if turned else None)
    rng, count = np.random.default_rng(2), len(looked.st)
    known = centred(maps, looked, PARAMS)
    residual = strength * known.added(looked) + 0.01 * rng.standard_normal((count, 3)).astype(np.float32)
    return replace(looked, camera=(np.arange(count) % 8).astype(np.int32), residual=residual.astype(np.float32))


@pytest.mark.parametrize("turned", [False, True])
def test_a_known_reflection_is_found(turned: bool) -> None:
    seen = _seen(0.2, turned)
    found = centred(fit_maps(seen, START, 12, PARAMS), seen, PARAMS)
    left = seen.residual - found.added(seen)
    noise = 1e-4
    assert left.var() - noise < 0.1 * (seen.residual.var() - noise)  # seen: 0.07
    assert found.gloss.min() >= 0


def test_light_begins_at_nothing_and_the_sum_stays() -> None:
    looked = _looked(*_rays(500))
    lit = replace(TRUTH, environment=TRUTH.environment - np.float32(0.7))
    found = grounded(lit)
    assert found.environment.min() == 0
    np.testing.assert_allclose(found.added(looked), lit.added(looked), atol=1e-5)


@pytest.mark.parametrize("strength, helps", [(0.2, True), (0.0, False)])
def test_whether_it_helps_is_asked_of_other_cameras(strength: float, helps: bool) -> None:
    """On matte noise a fit always gains on its own rays, and nothing on others."""
    assert (gain_on_cameras(_seen(strength), START, PARAMS) >= PARAMS.min_gain) == helps


@pytest.mark.parametrize(
    ("fine", "smooth", "kind", "times"),
    [
        (0.6, 0.9, "reflection", 1.0),  # sure
        (0.3, 0.2, "reflection", 1.0),
        (0.3, 0.4, "smooth_reflection", 10.0),
        (0.0, 0.2, "smooth_reflection", 10.0),
        (-0.3, 0.0, "no_reflection", 1.0),
    ],
)
def test_a_smoother_one_is_asked_for_where_little_is_gained(
    fine: float, smooth: float, kind: str, times: float
) -> None:
    seen = _seen(0.2)
    gloss = GlossFit(Chart((0.0, 0.0, 0.0)), WINDOW, KEYS, None)
    gloss.maps, gloss._normals = START, START.surface
    state = SimpleNamespace(shine=np.ones((3, 3), np.float32))

    def gain(_: SeenRays, __: Maps, ___: GlossMethod, smoother: float = 1.0) -> float:
        return fine if smoother == 1 else smooth

    with patch("facefolds_core.training.explicit.gloss.gain_on_cameras", gain):
        found = gloss._decide(cast(Any, state), seen)
    assert (found.kind, gloss.smoother, gloss.on) == (kind, times, kind != "no_reflection")
    assert found.values["gain"] == (fine if kind == "reflection" else smooth)
    if kind == "reflection":
        assert gloss.maps is START and len(state.shine) == 3
    elif kind == "no_reflection":
        assert gloss.maps is None and len(state.shine) == 0
    else:
        fitted = grounded(fit_maps(seen, START, PARAMS.first_rounds, PARAMS, 10.0))
        expected = centred(fitted, seen, PARAMS, 10.0)
        assert gloss.maps is not None and len(state.shine) == len(seen.st)
        for field in fields(Maps):
            np.testing.assert_allclose(getattr(gloss.maps, field.name), getattr(expected, field.name), atol=1e-6)


def test_light_that_stays_with_the_room_is_not_taken_for_the_heads() -> None:
    """Of a head that turns, a fit that lets the light turn with it explains less on cameras that it did not see."""
    seen = _seen(0.2, turned=True)
    gains = [gain_on_cameras(rays, START, PARAMS) for rays in (seen, replace(seen, turns=None))]
    assert gains[0] > gains[1] + 1  # dB


def test_the_fit_does_not_depend_on_threads() -> None:
    seen = _seen(0.2)
    one, two = each_of((1, 2), lambda: fit_maps(seen, TRUTH, 3, PARAMS))
    assert all(np.array_equal(getattr(one, field.name), getattr(two, field.name)) for field in fields(Maps))


def test_normals_of_a_sphere_are_its_directions() -> None:
    normals = surface_normals(np.full((40, 40), 0.3), Chart((0, 0, 0)), WINDOW, (6, 6), 2.0)
    np.testing.assert_allclose(normals, uv_to_directions(texel_uv(6, 6, WINDOW)), atol=2e-3)


def test_tangents_are_at_right_angles_to_the_normal_and_to_each_other() -> None:
    normals = np.random.default_rng(0).standard_normal((500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first, second = tangents(normals.astype(np.float32))
    axes = np.stack([normals, first, second], 1)[normals[:, 0] > -0.99]
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-4)
    np.testing.assert_array_equal(tangents(np.float32([1, 0, 0])), np.eye(3)[1:])


def test_normals_lean_as_the_reflection_asks_for() -> None:
    """Given the surface of a truth that leans by 0.15 in a random direction everywhere."""
    angle = np.random.default_rng(5).uniform(0, 2 * np.pi, TRUTH.gloss.shape)
    tilt = np.asarray(0.15 * np.stack([np.cos(angle), np.sin(angle)], -1), np.float32)
    seen = _seen(1.0, maps=replace(TRUTH, tilt=tilt))
    found = fit_maps(seen, TRUTH, 12, replace(PARAMS, normal_smoothness=0.01))
    assert np.median(np.linalg.norm(found.tilt - tilt, axis=-1)) < 0.05
    assert np.abs(found.tilt).max() <= PARAMS.max_tilt


def test_normals_stay_where_they_are_asked_to() -> None:
    found = fit_maps(_seen(0.2), START, 2, replace(PARAMS, max_tilt=0.0))
    np.testing.assert_array_equal(found.tilt, 0)
    np.testing.assert_allclose(found.normals, tilted(TRUTH.surface, 0 * TRUTH.tilt))


def test_a_ray_reflects_at_the_layer_nearest_to_the_middle() -> None:
    codes = np.zeros((3, 5, 2), np.uint16)
    codes[0, :] = 1 + np.arange(5)[:, None] * 1000
    codes[1, [0, 4]] = [[1, 65535], [65535, 1]]
    codes[2, 1:] = codes[0, 1:] * (np.arange(1, 5) != 2)[:, None]
    st = SeenRays.middle(one_each(codes), np.eye(3, dtype=np.float32)).st
    np.testing.assert_allclose(st, [[2000 / 65534] * 2, [0, 1], [1000 / 65534] * 2], atol=1e-6)
