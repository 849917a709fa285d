"""FaceFolds: multi-view face video to nested textured meshes with an RGBA texture video.

The names below are imported when they are first used: reading, checking and rendering an asset needs numpy, PyAV,
DracoPy, Embree and pydantic, and nothing of what trains one.

    import facefolds_core as facefolds

    asset = facefolds.load_asset("data/actor/asset")
    camera = facefolds.camera_of(facefolds.Eye(azimuth=25), width=512, height=768, field_of_view=30)
    rgb, alpha = facefolds.render(asset, camera, frame=0)

With the extra `train`, from a scene (as the stage `normalize` writes it) to an asset and its scores (pipeline.py):

    scene = facefolds.load_scene("data/actor/scene")
    trained = facefolds.train(scene)
    asset = facefolds.export_asset(trained.model, scene, "face")
    scores = facefolds.evaluate(asset, scene, trained.model)
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from facefolds_core.asset.reader import read_asset as load_asset
    from facefolds_core.asset.validation import validate_asset as validate
    from facefolds_core.captures.scene import read_scene as load_scene
    from facefolds_core.model.storage import load_model
    from facefolds_core.params import train_params
    from facefolds_core.pipeline import ExportParams, evaluate, export_asset, train
    from facefolds_core.rendering.camera_paths import Eye, camera_of
    from facefolds_core.rendering.pixels import render

_PLACES = {
    "ExportParams": ("facefolds_core.pipeline", "ExportParams"),
    "Eye": ("facefolds_core.rendering.camera_paths", "Eye"),
    "camera_of": ("facefolds_core.rendering.camera_paths", "camera_of"),
    "evaluate": ("facefolds_core.pipeline", "evaluate"),
    "export_asset": ("facefolds_core.pipeline", "export_asset"),
    "load_asset": ("facefolds_core.asset.reader", "read_asset"),
    "load_model": ("facefolds_core.model.storage", "load_model"),
    "load_scene": ("facefolds_core.captures.scene", "read_scene"),
    "render": ("facefolds_core.rendering.pixels", "render"),
    "train": ("facefolds_core.pipeline", "train"),
    "train_params": ("facefolds_core.params", "train_params"),
    "validate": ("facefolds_core.asset.validation", "validate_asset"),
}
"""Name of the API -> module and name there."""

__all__ = [
    "ExportParams",
    "Eye",
    "__version__",
    "camera_of",
    "evaluate",
    "export_asset",
    "load_asset",
    "load_model",
    "load_scene",
    "render",
    "train",
    "train_params",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _PLACES[name]
    return getattr(importlib.import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES})
