"""The library's face: what it offers, and that readers of assets need nothing of what makes them."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import facefolds_core
from facefolds_core.cli import COMMANDS, app
from tests.assets import make_asset
from tests.processes import printed

EXTRAS = "torch numba scipy trimesh pymeshlab cv2 pyarrow safetensors matplotlib jinja2 yaml dvc dvclive rpack tqdm"
READER = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in sys.argv[2].split():
            raise ModuleNotFoundError(f"{name} is not installed", name=name)

sys.meta_path.insert(0, Refuse())
import facefolds_core as facefolds

assert "numpy" not in sys.modules
assert facefolds.validate(sys.argv[1]) == []
asset = facefolds.load_asset(sys.argv[1])
camera = facefolds.camera_of(facefolds.Eye(azimuth=20), 40, 30, field_of_view=40)
picture = asset.render(camera, 0)
assert picture.shape == (30, 40, 4) and picture[..., 3].max() > 0
assert asset._repr_html_()
asset.save_glb(sys.argv[1] + ".glb")
try:
    facefolds.train
except ModuleNotFoundError as error:
    assert "facefolds[train]" in str(error)
else:
    raise AssertionError
from facefolds_core.cli import validate, view, render
"""


def test_every_name_is_there() -> None:
    for name in facefolds_core.__all__:
        assert getattr(facefolds_core, name) is not None
    assert set(facefolds_core.__all__) - {"__version__"} == set(facefolds_core._PLACES)


def test_an_unknown_name() -> None:
    with pytest.raises(AttributeError, match="splats"):
        facefolds_core.splats  # noqa: B018


def test_an_asset_is_read_checked_and_rendered_without_the_extras(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=2, frames=1, resolution=32)
    printed(READER, str(tmp_path / "asset"), EXTRAS)


def test_help_lists_every_command_and_imports_none() -> None:
    code = (
        "import sys; from facefolds_core.cli import app\n"
        "try: app(['--help'])\n"
        "finally: print([m for m in sys.modules if m.startswith('facefolds_core.cli.') or m == 'numpy'])"
    )
    said = printed(code)
    assert all(f"  {name} " in said for name in COMMANDS), said
    assert said.endswith("[]")


def test_stages_that_ask_no_model_do_without_torch() -> None:
    """It takes a second to import, in each stage of each subject."""
    code = "import importlib, sys\nfor name in sys.argv[1].split():\n    importlib.import_module(f'stages.{name}')\n"
    printed(
        code + "    assert 'torch' not in sys.modules, name", "configure reconstruct decimate texture bake compress"
    )


def test_a_command_without_its_extra_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jinja2", None)
    for module in [
        name for name in sys.modules if name.startswith(("facefolds_core.reporting", "facefolds_core.cli.report"))
    ]:
        monkeypatch.delitem(sys.modules, module)
    done = CliRunner().invoke(app, ["report"])
    assert done.exit_code == 1
    assert "pip install 'facefolds[report]'" in str(done.exception)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_function(name: str) -> None:
    module = importlib.import_module(f"facefolds_core.cli.{name.replace('-', '_')}")
    assert callable(module.command)
