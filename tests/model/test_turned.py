"""A torso that stays in the room while the head turns: in closed form, and layers against their mesh."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.rays import MISS, EmbreeMesh
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import st_to_uv
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track, turn_of
from facefolds_core.model.radial import RadialManifolds
from tests.assets import grid_faces
from tests.model.manifolds import layered

C = (-0.25, 0.0, 0.0)
WINDOW = (-0.6, 0.6, -0.6, 0.6)
MADE = Similarity(1.0, turn_of(np.array([0.0, 0.02, 0.01])), np.array([0.01, 0.0, 0.0]))
NOW = Similarity(1.0, turn_of(np.array([0.0, 0.05, 0.25])), np.array([0.02, 0.01, 0.0]))
TORSO = Torso.at([0.0, 0.0, -1.0], 0.0, 0.1, MADE)


def test_beyond_the_plane_points_stay_in_the_room() -> None:
    below, above, between = np.array([[0.1, 0.05, -0.2]]), np.array([[0.1, 0.0, 0.1]]), np.array([[0.1, 0.02, -0.05]])
    np.testing.assert_allclose(NOW.apply(TORSO.posed(below, NOW)), MADE.apply(below), atol=1e-12)
    np.testing.assert_array_equal(TORSO.posed(above, NOW), above)
    both = 0.5 * (NOW.apply(between) + MADE.apply(between))
    np.testing.assert_allclose(NOW.apply(TORSO.posed(between, NOW)), both, atol=1e-12)
    np.testing.assert_allclose(TORSO.posed(below, MADE), below, atol=1e-12)


def test_its_numbers_are_all_of_it() -> None:
    assert Torso.of(TORSO.numbers) == TORSO and TORSO.sound
    wrong = np.tile(TORSO.numbers, (4, 1))
    wrong[0, 0], wrong[1, 4], wrong[2, 5], wrong[3, 11] = 0.5, 0, 3, np.nan
    assert not any(Torso.of(numbers).sound for numbers in wrong)


def test_a_track_without_a_torso_moves_nothing_within_the_head() -> None:
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_array_equal(Track.of([NOW.rotation], [NOW.translation]).posed(points, 0), points)


def bumpy(torso: Torso | None) -> RadialManifolds:
    """With folds before one another."""
    random = torch.Generator().manual_seed(0)
    coarse = torch.rand(1, 1, 6, 6, generator=random)
    bumps = torch.nn.functional.interpolate(coarse, size=(48, 40), mode="bicubic")[0, 0]
    return RadialManifolds(Chart(C), WINDOW, layered(0.25 + 0.1 * bumps, 0.02, 2), torso)


def rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    origins = np.array([1.0, 0, 0]) + 0.4 * (random.random((count, 3)) - 0.5)
    directions = 0.3 * (random.random((count, 3)) - 0.5) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize("pose", [NOW, MADE], ids=["turned", "as made"])
def test_layers_are_crossed_where_their_mesh_is(pose: Similarity) -> None:
    manifolds, (origins, directions) = bumpy(TORSO), rays(4000)
    with torch.no_grad():
        found = manifolds.crossings(torch.from_numpy(origins), torch.from_numpy(directions), pose)
    n = 120
    s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    uv = torch.from_numpy(st_to_uv(np.stack([s, t], -1).reshape(-1, 2), WINDOW))
    for layer, radii in enumerate(manifolds.radii_at(uv)[0].detach().double().numpy().T):
        made = manifolds.chart.points(uv.numpy(), radii)
        posed, faces = TORSO.posed(made, pose).astype(np.float32), grid_faces(n)
        mesh = EmbreeMesh(posed, faces).nearest(origins, directions)
        hit, corners = mesh.triangle != MISS, faces[mesh.triangle]
        own = found.hit[:, layer].numpy()
        assert (own == hit).mean() > 0.995 and own[hit].mean() > 0.995
        both = own & hit
        there, seen = (np.einsum("rk,rkc->rc", mesh.barycentric[both], of[corners[both]]) for of in (made, posed))
        off = np.linalg.norm(found.points[:, layer].numpy()[both] - there, axis=1)
        assert np.quantile(off, 0.98) < 1e-3
        far = np.abs(found.distance[:, layer].numpy()[both] - np.linalg.norm(seen - origins[both], axis=1))
        assert np.quantile(far, 0.98) < 1e-3
    assert (TORSO.share(found.points.numpy()[found.hit.numpy()]) > 0.99).mean() > 0.05


def test_without_a_pose_layers_are_as_they_were_made() -> None:
    origins, directions = (torch.from_numpy(part) for part in rays(200))
    with torch.no_grad():
        found, plain = (bumpy(torso).crossings(origins, directions) for torso in (TORSO, None))
        posed = bumpy(None).crossings(origins, directions, NOW)
    torch.testing.assert_close(found.distance, plain.distance)
    torch.testing.assert_close(posed.distance, plain.distance)
