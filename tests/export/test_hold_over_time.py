"""Texels kept still, as films show them: the error's change in time of a tiny capture, before and after."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.export.hold import held_rows, texel_weights
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.sphere_uv import directions_to_uv
from facefolds_core.params import BakeParams
from facefolds_core.rendering import Hits, composite
from facefolds_core.scoring.temporal import Film, change_of
from tests.scenes import CENTRE, SphereLayer, first_hit, look_at_origin

SIZE, TEXELS, FRAMES = 40, 48, 8
SPHERES = (SphereLayer(0.34, 0.9, 3.0), SphereLayer(0.31, 1.0, 5.0))
"""A pattern that drifts, and one behind it of which a tenth shows."""


def spheres_hits(camera: Camera) -> Hits:
    """Where a camera's rays meet both spheres; (s, t) is (v, -u), each from -1 to 1."""
    origins, directions = camera.rays()
    hit, st = [], []
    for layer in SPHERES:
        distance, found = first_hit(origins, directions, layer.radius)
        points = origins + distance[..., None] * directions
        u, v = np.moveaxis(directions_to_uv((points - CENTRE) / layer.radius), -1, 0)
        hit.append(found)
        st.append(np.where(found[..., None], np.stack([0.5 + 0.5 * v, 0.5 - 0.5 * u], -1), 0))
    return Hits(np.stack(hit, -1), np.stack(st, -2).astype(np.float32))


def spheres_textures() -> np.ndarray:
    """(2, FRAMES, TEXELS, TEXELS, 4) uint8, true ones."""
    at = 2 * (np.arange(TEXELS) + 0.5) / TEXELS - 1
    uv = np.stack(np.meshgrid(-at, at, indexing="ij"), -1)
    films = [[layer.colour(uv, k) for k in range(FRAMES)] for layer in SPHERES]
    alphas = np.array([layer.alpha for layer in SPHERES])[:, None, None, None, None]
    colours = np.array(films)
    return np.rint(255 * np.concatenate([colours, np.broadcast_to(alphas, (*colours.shape[:-1], 1))], -1)).astype(
        np.uint8
    )


@pytest.fixture(scope="module")
def trembling(tmp_path_factory: pytest.TempPathFactory) -> tuple[FrameStore, np.ndarray]:
    """Textures as a fit to noisy photos leaves them, and how much their texels show in five views."""
    rng = np.random.default_rng(3)
    tremble = rng.normal(0, 1, (2, FRAMES, TEXELS, TEXELS, 4)) * np.array([2, 12])[:, None, None, None, None]
    textures = np.rint(np.clip(spheres_textures() + tremble, 0, 255)).astype(np.uint8)
    path = tmp_path_factory.mktemp("trembling") / "textures.arrow"
    rows = ((n, k, textures[n, k]) for n in range(2) for k in range(FRAMES))
    write_frames(path, (TEXELS, TEXELS, 4), rows)
    rig = [look_at_origin(f"{a}", a, 12 * (-1) ** i, SIZE) for i, a in enumerate((-40, -20, 0, 20, 40))]
    hits = Hits.joined([spheres_hits(camera).at(np.arange(SIZE**2)) for camera in rig])
    codes = np.where(hits.hit[..., None], 1 + np.rint(65534 * hits.st), 0)[0].astype(np.uint16)
    store = FrameStore(path)
    return store, texel_weights(codes, store, len(rig))


def film(textures: np.ndarray, hits: Hits) -> np.ndarray:
    """(FRAMES, SIZE, SIZE, 3) of (2, FRAMES, TEXELS, TEXELS, 4)."""
    return np.stack([composite(hits, textures[:, k])[0] for k in range(FRAMES)])


def held(trembling: tuple[FrameStore, np.ndarray], price: float, folder: Path) -> np.ndarray:
    textures = np.empty((2, FRAMES, TEXELS, TEXELS, 4), np.uint8)
    for layer, frame, image in held_rows(*trembling, price, folder, 1 << 24, progress=False):
        textures[layer, frame] = image
    return textures


def as_they_were(trembling: tuple[FrameStore, np.ndarray]) -> np.ndarray:
    return np.stack([[trembling[0].image(n, k) for k in range(FRAMES)] for n in range(2)])


UNSEEN = look_at_origin("unseen", 10, 8, SIZE)
"""None of the cameras that say what shows."""


def test_the_errors_change_in_time_is_no_worse(trembling: tuple[FrameStore, np.ndarray], tmp_path: Path) -> None:
    hits = spheres_hits(UNSEEN)
    truth, weight = film(spheres_textures(), hits), hits.hit.any(2).astype(float)
    prices = {"baked": None, "held": BakeParams().hold, "held too dearly": 10.0}
    screening = Film()
    films = {
        name: film(as_they_were(trembling) if price is None else held(trembling, price, tmp_path), hits)
        for name, price in prices.items()
    }
    for k in range(FRAMES):
        screening.add(k, {name: pictures[k] for name, pictures in films.items()}, truth[k], weight)
    flicker = {name: change_of([sums]).flicker or 0 for name, sums in screening.sums().items()}
    assert flicker["held"] <= flicker["baked"]  # seen: 0.0085 and 0.0087
    assert flicker["held too dearly"] > 2 * flicker["baked"]  # the measure sees motion that is lost
