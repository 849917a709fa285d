"""What bench/players.py compares: the same head in other forms, and its tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench.heads import SPREAD, VISIBLE, sample_splats, subdivided, triangle_areas, write_single
from bench.players import Loading, Timing, loading_table, timing_table
from facefolds_core.asset import Asset, read_asset
from tests.assets import CENTRE, cap_mesh, make_asset, radius_of


@pytest.fixture(scope="module")
def caps(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("caps") / "asset"
    make_asset(folder, layers=2, frames=2, resolution=48)
    return read_asset(folder)


def test_subdividing_keeps_the_surface_and_its_edges_shared() -> None:
    mesh = cap_mesh(0.3, vertices_a_side=4)
    fine = subdivided(mesh, 2)
    assert len(fine.faces) == 16 * len(mesh.faces)
    assert len(fine.vertices) == 13**2  # a grid of 3 x 3 cells, each cut into 4 x 4
    assert triangle_areas(fine).sum() == pytest.approx(triangle_areas(mesh).sum(), rel=1e-5)


def test_a_single_level_with_more_triangles_is_a_valid_asset_of_the_same_frames(caps: Asset, tmp_path: Path) -> None:
    count = write_single(tmp_path / "many", caps.full, 1)
    found = read_asset(tmp_path / "many")
    assert count == sum(len(layer.faces) for layer in found.layers) == 4 * sum(len(m.faces) for m in caps.layers)
    for a, b in zip(found.frame(1), caps.frame(1), strict=True):
        np.testing.assert_array_equal(a, b)


def test_splats_lie_on_the_layers_where_something_is_seen(caps: Asset) -> None:
    splats = sample_splats(caps.full, 500)
    assert splats.nbytes == 500 * 32
    radii = np.linalg.norm(splats["centre"] - np.array(CENTRE), axis=1)
    nearest = np.min([np.abs(radii - radius_of(layer)) for layer in range(2)], axis=0)
    assert nearest.max() < 0.01  # of flat triangles on spheres
    assert splats["rgba"][:, 3].min() >= np.floor(255 * VISIBLE)
    seen = (splats["scale"][0, 0] / SPREAD) ** 2 * 500
    assert 0.2 < seen / sum(triangle_areas(mesh).sum() for mesh in caps.layers) < 1


def test_tables_compare_with_the_first_row() -> None:
    timings = [Timing("floor", "draw", 10, 20, 4, 50.0, 40.0), Timing("ours", "play", 10, 20, 4, 100.0, 160.0)]
    assert timing_table(timings).splitlines()[-1] == "| ours, playing | 100 | 10.0 | 160 | 4.0 |"
    loaded = {"first": {"ms": 700.0, "bytes": 2**20}, "picture": {"ms": 900.0}}
    loading = Loading("ours", "llvmpipe", loaded, 3 * 2**20, 2**20, 10 * 2**20, None)
    assert loading_table([loading]).splitlines()[-1] == "| ours |  | 700 ms |  | 900 ms | 1.0 | 3.0 | 1.0 | 10.0 |  |"
