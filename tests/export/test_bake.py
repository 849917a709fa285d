"""Fitting textures to decimated meshes: the kernel against torch, closed forms, and that it wins back what was lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from facefolds_core.export.bake import MIN_LIGHT, Baker, cast_codes, gather_rays, reproject
from facefolds_core.export.bake_kernel import accumulate, render, update
from facefolds_core.export.collapse import decimate_sheets
from facefolds_core.export.sampling import sample_grids, texture_rows
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Sheets
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.kernels.hit_codes import SCALE
from tests.ellipsoids import Ellipsoids
from tests.export import bake_reference
from tests.scenes import look_at_origin

WINDOW: Window = (-0.6, 0.6, -0.6, 0.6)
MODEL = Ellipsoids(patch=0.5)
R = 96
LIGHT = MIN_LIGHT
RIG = [look_at_origin(f"{a}", a, e, 96) for a, e in ((-35, 10), (0, 0), (30, -15), (-15, -10), (15, 15))]


@pytest.fixture(scope="module")
def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    codes = rng.integers(1, 65536, (400, 3, 2)).astype(np.uint16)
    codes[rng.random((400, 3)) < 0.2] = 0
    codes[0] = [[1, 1], [65535, 65535], [1, 65535]]
    texture = rng.uniform(0, 0.9, (3, 7, 9, 4)).astype(np.float32)
    return codes, rng.random((400, 4)).astype(np.float32), texture


def test_rendering_is_that_of_the_reference(problem: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    codes, _, texture = problem
    out = np.empty((len(codes), 4), np.float32)
    render(codes, texture * 255, out)
    rgba = bake_reference.look_up(torch.tensor(codes.astype(np.int32)), torch.tensor(texture))
    assert np.abs(out - bake_reference.composite(rgba).numpy()).max() < 1e-4  # seen: 4e-5


@pytest.mark.parametrize("light", [LIGHT, 0.3])
def test_the_step_is_that_of_the_reference(problem: tuple[np.ndarray, np.ndarray, np.ndarray], light: float) -> None:
    codes, target, texture = problem
    texture = np.concatenate([texture[..., :3], texture[..., 3:] ** 0.2], -1)  # a few rays end before the last layer
    sums = np.zeros((3, 7, 9, 6), np.float32)
    squares = accumulate(codes, target, texture, sums, light)
    expected, total = bake_reference.accumulate(
        torch.tensor(codes.astype(np.int32)), torch.tensor(target), torch.tensor(texture), light
    )
    assert squares == pytest.approx(float(total), rel=1e-6)
    assert np.abs(sums - expected.numpy()).max() < 1e-5  # seen 1.9e-6, of sums up to 10.7


def test_a_texel_without_rays_or_without_opacity_stays() -> None:
    texture = np.full((1, 8, 8, 4), 0.5, np.float32)
    texture[:, :4, :, 3] = 0
    codes = np.full((1, 1, 2), 1 + int(SCALE * 0.5), np.uint16)
    codes[0, 0, 1] = 1 + int(SCALE * 0.8)
    before, shown = texture.copy(), texture.copy()
    sums = np.zeros((1, 8, 8, 6), np.float32)
    accumulate(codes, np.ones((1, 4), np.float32), texture, sums, LIGHT)
    update(texture.reshape(-1, 4), sums.reshape(-1, 6), 0.05, shown.reshape(-1, 4))
    changed = np.argwhere((texture != before).any(-1))
    assert set(changed[:, 1]) <= {5, 6}
    assert set(changed[:, 2]) <= {3, 4}
    assert len(changed)
    assert (sums == 0).all()


def test_what_is_shown_has_eight_bits() -> None:
    values, shown = np.full((1, 4), 0.3, np.float32), np.zeros((1, 4), np.float32)
    sums = np.zeros((1, 6), np.float32)
    sums[0] = [0.1, 0.1, 0.1, 0.1, 0.95, 0.95]
    update(values, sums, 0.05, shown)
    assert values[0] == pytest.approx([0.2] * 4)
    assert shown[0] * 255 == pytest.approx([51.0] * 4)


@pytest.fixture(scope="module")
def sheets() -> Sheets:
    return grid_sheets(sample_grids(MODEL, R, WINDOW, progress=False), None)


@pytest.fixture(scope="module")
def coarse(sheets: Sheets) -> list[TexturedMesh]:
    return decimate_sheets(sheets, 64)


@pytest.fixture(scope="module")
def samples() -> np.ndarray:
    grids = sample_grids(MODEL, R, WINDOW, progress=False)
    rows = [(frame, layer, image) for layer, frame, image in texture_rows(MODEL, grids, progress=False)]
    return np.stack([np.stack([image for f, _, image in rows if f == k]) for k in range(MODEL.num_frames)])


def test_reprojection_onto_the_samples_themselves_changes_nothing(sheets: Sheets, samples: np.ndarray) -> None:
    row, column = np.mgrid[:R, :R].astype(np.float32)
    image = samples[0, 1]
    moved = reproject(image, np.stack([column, row], -1))
    shown = image[..., 3] > 0
    assert np.array_equal(moved[..., 3], image[..., 3])
    assert np.abs(moved[shown].astype(int) - image[shown]).max() <= 1


def decibels(meshes: list[TexturedMesh], sheets: Sheets, textures: np.ndarray, samples: np.ndarray) -> float:
    """Of the meshes against the sheets, on a camera that is not in the rig."""
    rays = gather_rays([look_at_origin("new", 8, 4, 96)], meshes, sheets, progress=False)
    shown, truth = (np.empty((len(rays.shipped), 4), np.float32) for _ in range(2))
    render(rays.shipped, textures.astype(np.float32), shown)
    render(rays.sampled, samples.astype(np.float32), truth)
    return float(-10 * np.log10(((shown - truth) ** 2).mean()))


def test_the_fit_wins_back_what_decimation_lost(
    coarse: list[TexturedMesh], sheets: Sheets, samples: np.ndarray
) -> None:
    baker = Baker(coarse, sheets, gather_rays(RIG, coarse, sheets, progress=False), R)
    before = decibels(coarse, sheets, samples[0], samples[0])
    moved = decibels(coarse, sheets, baker.frame(samples[0], samples[0], 0), samples[0])
    fitted = decibels(coarse, sheets, baker.frame(samples[0], samples[0], 6), samples[0])
    later = decibels(coarse, sheets, baker.frame(samples[1], samples[1], 6), samples[1])
    assert moved > before + 1
    assert fitted > moved + 1
    assert later > moved + 1


def test_meshes_that_show_the_same_are_left_alone(sheets: Sheets, samples: np.ndarray) -> None:
    fine = decimate_sheets(sheets, R * R)
    rays = gather_rays(RIG[:2], fine, sheets, progress=False)
    baked = Baker(fine, sheets, rays, R).frame(samples[0], samples[0], 4)
    shown = samples[0][..., 3] > 0
    assert np.abs(baked[shown].astype(int) - samples[0][shown]).max() <= 3


def test_codes_are_texture_coordinates_in_16_bits() -> None:
    camera = look_at_origin("front", 0, 0, 8)
    square = np.array([[0, -1, 1], [0, 1, 1], [0, -1, -1], [0, 1, -1]], np.float32)
    mesh = TexturedMesh(
        square, np.array([[0, 2, 3], [0, 3, 1]], np.int32), np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    )
    codes = cast_codes(camera, [mesh, replace(mesh, vertices=square + np.float32([0, 9, 0]))])
    assert (codes[:, 1] == 0).all()
    st = (codes[:, 0].astype(float).reshape(8, 8, 2) - 1) / SCALE
    assert st[4, 4] == pytest.approx([0.5 + 0.35 / 16, 0.5 + 0.35 / 16], abs=1e-4)
    assert (np.diff(st[0, :, 0]) > 0).all()
