"""The script for Unreal against a stub: nothing here says that Unreal takes it."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from facefolds_core.asset.gltf.writing import write_layered
from tests.assets import make_asset

SCRIPT = Path(__file__).parents[2] / "engines" / "unreal" / "import_face.py"


class StaticMesh(MagicMock):
    """What the import gives."""


@pytest.fixture
def unreal(monkeypatch: pytest.MonkeyPatch) -> MagicMock:
    stub = MagicMock()
    stub.StaticMesh = StaticMesh
    monkeypatch.setitem(sys.modules, "unreal", stub)
    return stub


def test_sequence_materials_and_slots(unreal: MagicMock, tmp_path: Path) -> None:
    level = make_asset(tmp_path / "asset", layers=2, frames=2, resolution=32).full
    write_layered(tmp_path / "face.glb", level, "caps")
    (tmp_path / "textures").mkdir()
    for name in ("frame_00001.jpg", "frame_00000.jpg"):
        (tmp_path / "textures" / name).touch()
    mesh = StaticMesh()
    slots = [MagicMock(), MagicMock()]
    for slot, name in zip(slots, ("core", "shell"), strict=True):
        slot.get_editor_property.return_value = name
    mesh.get_editor_property.return_value = slots
    unreal.AssetImportTask.return_value.get_editor_property.return_value = ["/Game/facefolds/layers"]
    unreal.load_asset.return_value = mesh
    create = unreal.AssetToolsHelpers.get_asset_tools.return_value.create_asset
    assets: dict[str, MagicMock] = {}
    create.side_effect = lambda name, *_: assets.setdefault(name, MagicMock())
    module = SimpleNamespace(**runpy.run_path(str(SCRIPT)))
    module.main(tmp_path / "face.glb", tmp_path / "textures")
    assets["sequence"].set_sequence_path.assert_called_once_with(str(tmp_path / "textures" / "frame_00000.jpg"))
    unreal.FrameRate.assert_called_once_with(30, 1)
    assert [call.args for call in mesh.set_material.call_args_list] == [(0, assets["M_core"]), (1, assets["M_shell"])]
    u, v, left, top = module.window(module.said_of(tmp_path / "face.glb"), "alphaRectangle")
    texture = level.entry.texture
    x, y, w, h = texture.alpha_rect
    assert (u * texture.width, v * texture.height, left * texture.width, top * texture.height) == (w, h, x, y)
    connected = [call.args[1:] for call in unreal.MaterialEditingLibrary.connect_material_property.call_args_list]
    assert [output for output, _ in connected] == ["RGB", "R", "RGB", "R"]
