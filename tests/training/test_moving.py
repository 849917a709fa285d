"""Training rays of a head that turns."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.track import Track
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.training.explicit.views import MovingRays, Views, first_pixel, trace_views
from facefolds_core.training.rays import RaySampler
from tests.geometry.test_track import about
from tests.model.manifolds import layered
from tests.scenes import CENTRE, make_scene

WINDOW = (-0.6, 0.6, -0.6, 0.6)
STILL = Track.of([np.eye(3)] * 2, np.zeros((2, 3)))
TURNED = Track.of([np.eye(3), about((0, 0, 1), 15)], [[0, 0, 0], [0.02, 0.01, 0]])


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return make_scene(tmp_path_factory.mktemp("moving") / "scene", size=24)


def layers() -> RadialManifolds:
    """Three spheres' caps around the subject of `make_scene`."""
    radii = layered(torch.full((9, 9), 0.33), 0.01, 3)
    return RadialManifolds(Chart((float(CENTRE[0]), 0.0, 0.0)), WINDOW, radii)


def rays(scene: Scene, stride: int = 1, share: float = 400.0, reserve: float = 0, shares: int = 1000) -> MovingRays:
    return MovingRays(scene, layers(), stride, share, shares=shares, sample=1, reserve=reserve)


def rows_of(views: Views) -> dict[tuple[int, int], tuple[int, ...]]:
    """(camera, pixel) -> codes."""
    rays = zip(views.camera, views.pixel, views.codes, strict=True)
    return {(int(c), int(p)): tuple(codes.ravel().tolist()) for c, p, codes in rays}


def seen(found: MovingRays, frame: int, parts: int) -> dict[tuple[int, int], tuple[int, ...]]:
    """Of all parts of a frame; none twice."""
    rows: dict[tuple[int, int], tuple[int, ...]] = {}
    for phase in range(parts):
        views, which = found.part(frame, phase, parts)
        own = rows_of(views.part(which))
        assert len(own) == len(which) and not own.keys() & rows.keys()
        rows.update(own)
    return rows


@pytest.mark.parametrize("stride", [1, 5])
def test_in_a_head_that_stands_still_all_shares_are_the_still_rays(scene: Scene, stride: int) -> None:
    found = rays(replace(scene, poses=STILL), stride)
    expected = rows_of(trace_views(scene, layers(), stride))
    assert seen(found, 1, found.shares) == expected
    assert found.count == pytest.approx(len(expected), rel=0.01)


def test_finer_parts_are_the_same_rays(scene: Scene) -> None:
    found = rays(replace(scene, poses=TURNED))
    assert seen(found, 1, 3 * found.shares) == seen(found, 1, found.shares)


def test_each_frame_has_the_rays_of_its_own_cameras(scene: Scene) -> None:
    turned = replace(scene, poses=TURNED)
    found = rays(turned)
    moved = replace(scene, cameras=tuple(turned.camera_in_head(i, 1) for i in range(len(scene.cameras))))
    assert scene.indices("train")[0] == 0
    rows, expected = (
        {pixel: codes for (camera, pixel), codes in rays.items() if camera == 0}
        for rays in (seen(found, 1, found.shares), rows_of(trace_views(moved, layers(), 1)))
    )
    assert rows == expected


def test_what_does_not_fit_is_traced_anew_and_is_the_same(scene: Scene) -> None:
    turned = replace(scene, poses=TURNED)
    kept, anew = rays(turned), rays(turned, reserve=math.inf)
    assert kept.part(1, 0, kept.shares)[0] is kept.part(1, 0, kept.shares)[0]
    assert anew.part(1, 0, anew.shares)[0] is not anew.part(1, 0, anew.shares)[0]
    assert seen(kept, 1, kept.shares) == seen(anew, 1, anew.shares)


def test_few_shares_still_meet_every_pixel_over_the_frames(scene: Scene) -> None:
    """Of a head that hardly moves, so that its pixels are the same: five shares, one a frame."""
    long = replace(scene, frame_ids=tuple("abcde"), poses=Track.of([np.eye(3)] * 5, np.zeros((5, 3))))
    every = rays(long)
    few = rays(long, share=every.count / 5, shares=1)
    assert few.shares == 5
    pixels = [set(seen(few, frame, 1)) for frame in range(5)]
    assert set().union(*pixels) == set(seen(every, 0, every.shares))


@pytest.mark.parametrize("poses", [None, TURNED], ids=["still", "turned"])
def test_perceptrons_rays_have_the_colours_of_their_pixels(scene: Scene, poses: Track | None) -> None:
    """In the cameras as they stand in their frame: all training pictures are drawn from."""
    turned, cameras = replace(scene, poses=poses), set[tuple[int, int]]()
    sampler = RaySampler(turned, torch.tensor(CENTRE, dtype=torch.float32), 0.45, torch.device("cpu"))
    drawn = sampler.draw(400, torch.Generator().manual_seed(0))
    store = turned.open_frames()
    for o, d, t, rgb in zip(drawn.origins, drawn.directions, drawn.time, drawn.rgb, strict=True):
        views = [(c, turned.camera_in_head(c, int(t))) for c in turned.indices("train")]
        c, camera = min(views, key=lambda pair: float(np.abs(pair[1].centre - o.numpy()).sum()))
        assert camera.centre == pytest.approx(o.numpy(), abs=1e-5)
        (x, y), _ = camera.project((o + d).numpy().astype(float))
        assert x % 1 == pytest.approx(0.5, abs=2e-3) and y % 1 == pytest.approx(0.5, abs=2e-3)
        assert rgb.numpy() * 255 == pytest.approx(store.image(c, int(t))[int(y), int(x)], abs=0.01)
        cameras.add((c, int(t)))
    assert cameras == {(c, k) for c in turned.indices("train") for k in range(turned.num_frames)}


@pytest.mark.parametrize("stride", range(1, 10))
def test_cameras_begin_at_different_pixels(stride: int) -> None:
    assert {first_pixel(camera, stride) for camera in range(stride)} == set(range(stride))
