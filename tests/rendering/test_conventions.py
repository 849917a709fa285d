"""A mesh on a sphere around the sphere centre, against the sphere itself: axes, (u, v) and (s, t) all agree."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.geometry.sphere_uv import directions_to_uv, uv_to_st
from facefolds_core.rendering.reference import AssetCaster
from tests.assets import WINDOW, Meshes, cap_mesh
from tests.scenes import CENTRE, first_hit, look_at_origin

RADII = (0.36, 0.30)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (35, 10), (-50, -20)])
def test_texture_coordinates_are_those_of_the_sphere(azimuth: float, elevation: float) -> None:
    camera = look_at_origin("camera", azimuth, elevation, 48)
    hits = AssetCaster(Meshes([cap_mesh(radius, 96) for radius in RADII])).cast(camera)
    origins, directions = camera.rays()
    for i, radius in enumerate(RADII):
        distance, hit = first_hit(origins, directions, radius)
        points = origins + distance[..., None] * directions
        st = uv_to_st(directions_to_uv((points - CENTRE) / radius), WINDOW)
        # Well inside the cap, where the mesh is certainly hit, and not grazing, where facets shift the hit.
        cosine = -(directions * (points - CENTRE)).sum(-1) / radius
        inside = hit & ((st > 0.05) & (st < 0.95)).all(-1) & (cosine > 0.3)
        assert inside.sum() > 100
        assert hits.hit[inside, i].all()
        assert np.abs(hits.st[..., i, :] - st)[inside].max() < 1e-3  # worst seen 1.2e-4: facets
