"""Poisson reconstruction of sampled sheets: trimming, accuracy, determinism, errors."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.export.poisson import Samples, gather_samples, largest_component, reconstruct, reconstruct_layers
from facefolds_core.export.sampling import sample_grids
from facefolds_core.geometry.meshes import Surface
from facefolds_core.geometry.sphere_uv import FULL_WINDOW, Window, points_to_uv
from facefolds_core.params import ReconstructParams
from tests.ellipsoids import Ellipsoids
from tests.export.order import boundary_loops

WINDOW: Window = (-0.5, 0.6, -0.3, 0.4)
PARAMS = ReconstructParams(depth=6)


def surface_of(model: Ellipsoids, resolution: int, window: Window) -> Surface:
    grids = sample_grids(model, resolution, window)
    return reconstruct(gather_samples(grids, 0, PARAMS.resolution), PARAMS, 0)


@pytest.mark.parametrize("window", [FULL_WINDOW, WINDOW], ids=["hemisphere", "window"])
@pytest.mark.parametrize("resolution", [48, 128])
def test_trimming_keeps_one_component_and_one_boundary(window: Window, resolution: int) -> None:
    faces = surface_of(Ellipsoids(), resolution, window).faces
    assert len(largest_component(faces.astype(np.intp), int(faces.max()) + 1)) == len(faces)
    assert boundary_loops(faces) == 1


def test_a_hole_in_the_samples_is_a_second_boundary() -> None:
    assert boundary_loops(surface_of(Ellipsoids(hole=0.15), 96, WINDOW).faces) == 2


def test_the_surface_covers_the_samples_and_little_more() -> None:
    vertices = surface_of(Ellipsoids(), 96, WINDOW).vertices
    uv, _ = points_to_uv(vertices.astype(np.float64), Ellipsoids().centre.numpy())
    overhang = np.array([uv[:, 0].max() - 0.6, -0.5 - uv[:, 0].min(), uv[:, 1].max() - 0.4, -0.3 - uv[:, 1].min()])
    assert (overhang > 0).all()
    assert overhang.max() < 3 * 1.1 / 96 + 0.01


@pytest.mark.parametrize("window", [FULL_WINDOW, WINDOW], ids=["hemisphere", "window"])
def test_the_surface_lies_on_the_layer(window: Window) -> None:
    model = Ellipsoids()
    result = reconstruct(gather_samples(sample_grids(model, 128, window), 0, None), PARAMS, 0)
    scaled = (result.vertices - model.centre.numpy()) / np.array(model.axes[0])
    error = np.abs(np.linalg.norm(scaled, axis=-1) - 1) * 0.35
    assert np.median(error) < 2e-4  # seen: 8e-5
    assert error.max() < 5e-3  # the rim and the poles


def test_faces_look_outward() -> None:
    surface = surface_of(Ellipsoids(), 64, WINDOW)
    corners = surface.vertices[surface.faces] - Ellipsoids().centre.numpy()
    volume = np.einsum("fc,fc->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    assert (volume > 0).mean() > 0.99


@pytest.mark.slow
def test_two_processes_give_what_one_gives() -> None:
    grids = sample_grids(Ellipsoids(), 48, WINDOW)
    apart = [reconstruct(gather_samples(grids, i, None), PARAMS, i) for i in range(2)]
    together = reconstruct_layers(grids, PARAMS)
    for a, b in zip(apart, together, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.faces, b.faces)


def test_samples_are_evenly_spread_up_to_the_poles() -> None:
    """And thinning keeps one in k squared."""
    middle = sample_grids(Ellipsoids(), 64, (-0.1, 0.1, -0.1, 0.1))
    assert len(gather_samples(middle, 0, 16).points) == 16**2
    grids = sample_grids(Ellipsoids(axes=((0.3, 0.3, 0.3),)), 64, FULL_WINDOW)
    samples = gather_samples(grids, 0, None)
    # Area of the half sphere over the square of the spacing.
    assert len(samples.points) == pytest.approx(2 / np.pi * 64**2, rel=0.1)
    assert samples.spacing.min() > 0.8 * 0.3 * np.pi / 64
    assert samples.spacing.max() < 1.6 * 0.3 * np.pi / 64


@pytest.mark.parametrize(
    ("count", "place", "said"),
    [(3, 0.0, r"too few[\s\S]*layer 7"), (50, 0.1, r"no surface[\s\S]*layer 7[\s\S]*remedy")],
)
def test_samples_that_bound_nothing_name_the_layer(count: int, place: float, said: str) -> None:
    stacked = Samples(np.full((count, 3), place), np.tile([1.0, 0, 0], (count, 1)), np.zeros(count))
    with pytest.raises(UserError, match=said):
        reconstruct(stacked, PARAMS, 7)


def test_a_missing_libgl_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "pymeshlab":
            raise ImportError("libGL.so.1: cannot open shared object file: No such file or directory")
        return original(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(UserError, match="libgl1"):
        surface_of(Ellipsoids(), 32, WINDOW)
