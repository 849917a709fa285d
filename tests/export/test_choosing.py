"""`auto` of R^m and R^t: the least that the photos cannot tell from the best."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.asset import packing
from facefolds_core.asset.packing import AtlasLayout
from facefolds_core.captures.scene import Scene
from facefolds_core.export import choosing
from facefolds_core.export.choosing import choose_meshes, choose_texels, explained, looks_of
from facefolds_core.export.poisson import gather_samples, reconstruct
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Grids, Sheets
from facefolds_core.facts import Fact, fact
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.writing import read_json
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.params import DecimateParams, ReconstructParams
from facefolds_core.pipeline import decimate
from facefolds_core.pipeline.choices import write_choice
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import composite
from facefolds_core.rendering.reflection import reflected_colours
from tests.assets import grid_faces
from tests.ellipsoids import Ellipsoids
from tests.scenes import make_scene

SIDE = 64


def ball(n: int) -> TexturedMesh:
    """The front half (+x) of a ball of radius 0.3 as n x n vertices; s and t along y and z."""
    angles = np.linspace(-1.2, 1.2, n)
    z, y = np.meshgrid(angles[::-1], angles, indexing="ij")
    points = 0.3 * np.stack([np.cos(y) * np.cos(z), np.sin(y) * np.cos(z), np.sin(z)], -1)
    st = np.stack([(y + 1.2) / 2.4, (1.2 - z) / 2.4], -1)
    points, st = points.reshape(-1, 3).astype(np.float32), st.reshape(-1, 2).astype(np.float32)
    return TexturedMesh(points, grid_faces(n), st)


def stripes(period: float) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 4) opaque, waves of so many texels."""
    wave = 127.5 + 100 * np.sin(2 * np.pi * np.arange(SIDE) / period)
    image = np.full((SIDE, SIDE, 4), 255, np.uint8)
    image[..., :3] = np.rint(wave)[None, :, None]
    return image


def surfaces(grids: Grids, method: str) -> Sheets | list[Surface]:
    """Those of `reconstruct`; Poisson's one after the other, as processes of their own take seconds to begin."""
    if method == "grid":
        return grid_sheets(grids, None)
    params = ReconstructParams(depth=5)
    return [reconstruct(gather_samples(grids, i, None), params, i) for i in range(grids.num_layers)]


def matte(reflection: ReflectionMaps | None = None) -> Grids:
    """Of one layer, all but its window and reflection left out."""
    nothing, window = np.zeros((1, 2, 2, 3), np.float32), [[-0.7, 0.7, -0.7, 0.7]]
    one = np.ones((1, 2, 2), np.uint8)
    return Grids(nothing, nothing, one > 0, one, np.array(window), Chart((0.0, 0.0, 0.0)), reflection)


@dataclass(frozen=True)
class Filmed:
    scene: Scene
    textures: FrameStore

    def texels(self, maps: ReflectionMaps | None = None) -> tuple[int, Fact]:
        return choose_texels(self.scene, [ball(64)], matte(maps), self.textures)


def film(folder: Path, period: float, noise: float = 0.0, shining: ReflectionMaps | None = None) -> Filmed:
    """Photos of the ball with waves of so many texels, and its texture; with noise on the photos (of 255)."""
    scene, texture = make_scene(folder, cameras=5, size=96, frames=1), stripes(period)
    write_frames(folder / "textures.arrow", (SIDE, SIDE, 4), [(0, 0, texture)])
    rng = np.random.default_rng(1)
    rows = []
    for i, camera in enumerate(scene.cameras):
        hits, window = cast_layers(camera, [ball(64)]), matte().window(0)
        added = None if shining is None else reflected_colours(hits, camera, [window], shining)
        photo = 255 * composite(hits, [texture], added=added)[0]
        rows.append((i, 0, np.rint(photo + rng.normal(0, noise, photo.shape)).clip(0, 255).astype(np.uint8)))
    write_frames(folder / "frames.arrow", rows[0][2].shape, rows)
    return Filmed(scene, FrameStore(folder / "textures.arrow"))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Candidates as small as the pictures here."""
    monkeypatch.setattr(choosing, "TEXELS", (16, 32, 48, 64))
    monkeypatch.setattr(choosing, "MESHES", (8, 16, 32, 64))


@pytest.mark.parametrize("period, least", [(32.0, 32), (16.0, 48), (5.0, 64)])
def test_textures_are_no_finer_than_what_they_show(tmp_path: Path, period: float, least: int) -> None:
    assert film(tmp_path, period, noise=20.0).texels()[0] == least


def test_textures_fit_into_a_video(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All layers whole: what a layer does not show is cropped later."""
    monkeypatch.setattr(packing, "MAX_PIXELS", AtlasLayout.pack([(64, 64)]).pixels - 1)
    assert film(tmp_path, 5.0, noise=20.0).texels()[0] == 48


def test_photos_that_the_model_does_not_show_let_no_detail_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filmed = film(tmp_path, 8.0, noise=60.0)
    assert filmed.texels()[0] == 64
    monkeypatch.setattr(choosing, "FIDELITY", 0.0)
    assert filmed.texels()[0] == 32


def test_meshes_are_no_finer_than_their_shape_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filmed = film(tmp_path, 16.0, noise=20.0)
    monkeypatch.setattr(choosing, "FIDELITY", 35.0)
    ladder = {n: [ball(n)] for n in (8, 16, 32, 64)}
    chosen, why = choose_meshes(filmed.scene, ladder, matte(), filmed.textures)
    flat = {n: [ball(4)] for n in (8, 16, 32)} | {64: [ball(64)]}
    assert chosen == 32
    assert choose_meshes(filmed.scene, flat, matte(), filmed.textures)[0] == 64
    assert f"took {chosen} of" in str(why) and "split train" in str(why)


def test_what_photos_reflect_is_not_counted_against_textures(tmp_path: Path) -> None:
    """They differ by it from every candidate: taken away, photos are those of a matte ball, to their rounding."""
    rng = np.random.default_rng(0)
    normals = np.stack([np.ones((6, 6)), *rng.uniform(-0.3, 0.3, (2, 6, 6))], -1)
    parts = (np.full((6, 6), 0.2), np.full((6, 6, 3), 0.1), normals, rng.random((8, 8, 3)))
    shining = ReflectionMaps((-0.7, 0.7, -0.7, 0.7), *(part.astype(np.float32) for part in parts))
    filmed = film(tmp_path, 16.0, shining=shining)
    matched, unmatched = (max(filmed.texels(maps)[1].values["psnr"]) for maps in (shining, None))
    assert matched > 50 > 30 > unmatched


@pytest.mark.parametrize("unseen", ["nothing is opaque", "no photo is there"])
def test_where_nothing_can_be_compared_the_finest_is_taken(tmp_path: Path, unseen: str) -> None:
    filmed = film(tmp_path, 32.0)
    if unseen == "nothing is opaque":
        glass = stripes(32.0)
        glass[..., 3] = 120
        write_frames(tmp_path / "glass.arrow", glass.shape, [(0, 0, glass)])
        filmed = Filmed(filmed.scene, FrameStore(tmp_path / "glass.arrow"))
    else:
        splits = tuple("validate" if i == 0 else split for i, split in enumerate(filmed.scene.splits))
        rows = [(i, 0, filmed.scene.open_frames().image(i, 0).copy()) for i in range(1, 5)]
        write_frames(filmed.scene.folder / "frames.arrow", rows[0][2].shape, rows)
        filmed = Filmed(replace(filmed.scene, splits=splits), filmed.textures)
    chosen, why = filmed.texels()
    assert chosen == 64 and why.values["tried"] == [64]


def test_cameras_for_validation_decide_where_there_are_any(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = film(tmp_path, 16.0).scene
    monkeypatch.setattr(choosing, "CAMERAS", 3)
    split, looks = looks_of(scene)
    assert split == "train" and len(looks) == 3
    checked = replace(scene, splits=("train", "validate", "holdout", "train", "train"))
    split, looks = looks_of(checked)
    assert split == "validate" and [camera.name for (camera, _), _ in looks] == ["cam1"]


@pytest.mark.parametrize("method", ["grid", "poisson"])
def test_coarser_levels_are_never_finer_than_the_full_one(
    tmp_path: Path, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_scene(tmp_path, cameras=3, size=40, frames=1)
    grids = sample_grids(Ellipsoids(), 32, (-0.5, 0.6, -0.3, 0.4))
    write_frames(tmp_path / "samples.arrow", (8, 8, 4), [(n, 0, np.full((8, 8, 4), 255, np.uint8)) for n in range(2)])
    for name, value in {"MESHES": (8, 16), "LOSS": 50.0, "FIDELITY": 0.0}.items():
        monkeypatch.setattr(choosing, name, value)
    monkeypatch.setattr(decimate, "MESHES", (8, 16))
    samples, found = FrameStore(tmp_path / "samples.arrow"), surfaces(grids, method)
    meshes, coarser, why = decimate.decimate_all(found, grids, scene, samples, DecimateParams(), [6, 12])
    assert why is not None and why.values["chosen"] == 8
    assert len(meshes[0].vertices) <= 64
    assert coarser[12] is meshes and len(coarser[6][0].vertices) <= 36


def test_what_was_chosen_is_said_and_kept(tmp_path: Path) -> None:
    values = {"tried": [8], "below": 0.0, "to_finest": 50.0, "views": 1, "split": "train"}
    why = fact("resolution_chosen", what="texture.resolution", chosen=8, **values)
    assert "texture.resolution: auto took 8" in write_choice(tmp_path, why)
    assert read_json(tmp_path / "choice.json")["chosen"] == 8
    assert write_choice(tmp_path / "none", None) == "" and not (tmp_path / "none").exists()


def test_how_well_an_export_shows_the_photos(tmp_path: Path) -> None:
    """Nothing is said of one that is clear."""
    filmed = film(tmp_path, 16.0, noise=20.0)
    found = explained(filmed.scene, [ball(64)], [matte().window(0)], None, filmed.textures)
    assert found == pytest.approx(20 * np.log10(255 / 20), abs=0.2)
    write_frames(tmp_path / "clear.arrow", (SIDE, SIDE, 4), [(0, 0, np.zeros((SIDE, SIDE, 4), np.uint8))])
    clear = FrameStore(tmp_path / "clear.arrow")
    assert explained(filmed.scene, [ball(64)], [matte().window(0)], None, clear) is None
