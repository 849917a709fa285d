"""Assets as OpenUSD: what the checker says of the stage, and what the stage says of the asset."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import Asset
from facefolds_core.engines.usd import STAGE, export
from facefolds_core.errors import UserError
from facefolds_core.rendering.reference import sample_texture
from tests.assets import make_asset
from tests.engines.tracks import with_track

if importlib.util.find_spec("pxr") is None:
    pytest.skip("no usd-core: pip install 'facefolds[usd]'", allow_module_level=True)

FRAMES = 3


@pytest.fixture(scope="module")
def caps(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return make_asset(tmp_path_factory.mktemp("caps") / "asset", layers=3, frames=FRAMES, resolution=64)


@pytest.fixture(scope="module")
def exported(caps: Asset) -> Path:
    export(caps.folder.parent / "usd", caps.full, "caps")
    return caps.folder.parent / "usd"


def complaints(file: Path) -> list[str]:
    """Of all checks that usdchecker makes."""
    from pxr import Usd, UsdValidation

    checks = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(checks).Validate(Usd.Stage.Open(str(file)))
    return [error.GetErrorAsString() for error in errors]


def opened(file: Path) -> Any:
    from pxr import Usd

    return Usd.Stage.Open(str(file))


def test_the_checker_finds_nothing(exported: Path) -> None:
    assert complaints(exported / STAGE) == []


def test_the_checker_finds_a_missing_picture(exported: Path, tmp_path: Path) -> None:
    (tmp_path / STAGE).write_bytes((exported / STAGE).read_bytes())
    assert any("frame_00000.jpg" in line for line in complaints(tmp_path / STAGE))


def test_a_package_is_whole(caps: Asset, tmp_path: Path) -> None:
    export(tmp_path / "face.usdz", caps.full, "caps")
    assert complaints(tmp_path / "face.usdz") == []
    assert [path.name for path in tmp_path.iterdir()] == ["face.usdz"]


def test_the_stage_says_axes_units_and_time(exported: Path) -> None:
    from pxr import UsdGeom

    stage = opened(exported / STAGE)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (30, 0, FRAMES - 1)


def test_the_subject_looks_along_z_with_y_up(exported: Path) -> None:
    from pxr import Gf, UsdGeom

    stage = opened(exported / STAGE)  # a prim lives as long as its stage
    turned = UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath("/Face/Head"))
    ways = [tuple(turned.TransformDir(Gf.Vec3d(*axis))) for axis in np.eye(3).tolist()]
    assert ways == [(0, 0, 1), (1, 0, 0), (0, 1, 0)]  # forward, left, up


def test_layers_have_their_order(exported: Path) -> None:
    stage = opened(exported / STAGE)
    meshes = [prim for prim in stage.Traverse() if prim.GetTypeName() == "Mesh"]
    assert [prim.GetAttribute("primvars:facefolds:layer").Get() for prim in meshes] == [2, 1, 0]


def shader_input(stage: Any, path: str, name: str) -> Any:
    from pxr import UsdShade

    return UsdShade.Shader(stage.GetPrimAtPath(path)).GetInput(name)


@pytest.mark.parametrize("frame", range(FRAMES))
def test_vertices_find_the_colour_and_alpha_of_their_frame(caps: Asset, exported: Path, frame: int) -> None:
    stage, textures = opened(exported / STAGE), caps.frame(frame)
    for index, mesh in enumerate(caps.layers):
        inner = ((mesh.st > 0.1) & (mesh.st < 0.9)).all(1)
        h, w = textures[index].shape[:2]
        expected = sample_texture(textures[index], mesh.st[inner])
        assert (h, w) == tuple(reversed(caps.full.entry.layers[index].texture_rect[2:]))
        for name, primvar, channels in (("colour", "st", slice(0, 3)), ("alpha", "st_alpha", slice(3, 4))):
            file = shader_input(stage, f"/Face/Materials/layer_{index:02d}/{name}", "file").Get(frame)
            picture = np.asarray(Image.open(file.resolvedPath).convert("RGB"))
            prim = stage.GetPrimAtPath(f"/Face/Head/layer_{index:02d}")
            st = np.array(prim.GetAttribute(f"primvars:{primvar}").Get()) * [1, -1] + [0, 1]  # v is up
            found = sample_texture(picture, st[inner])[:, : expected[:, channels].shape[1]]
            assert np.abs(found - expected[:, channels]).max() < 0.04, (index, name)


def test_a_head_that_moves_has_its_pose_in_each_frame(caps: Asset, tmp_path: Path) -> None:
    from pxr import Gf, UsdGeom

    level = with_track(caps.full)
    export(tmp_path / "usd", level, "caps")
    stage = opened(tmp_path / "usd" / STAGE)
    head = stage.GetPrimAtPath("/Face/Head")
    for frame in range(FRAMES):
        pose = level.track.at(frame)
        moved = UsdGeom.Xformable(head).GetLocalTransformation(frame)
        found = np.array(moved.Transform(Gf.Vec3d(0.1, 0.2, 0.3)))
        np.testing.assert_allclose(found, pose.apply(np.array([0.1, 0.2, 0.3])), atol=1e-6)


def test_a_folder_with_other_files_is_left_alone(caps: Asset, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    with pytest.raises(UserError, match="not empty"):
        export(tmp_path, caps.full, "caps")
    assert (tmp_path / "precious").is_file()
