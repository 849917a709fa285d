"""FaceFolds: multi-view face video to nested textured meshes with an RGBA texture video.

    import facefolds_core as facefolds

    capture = facefolds.load_capture("captures/anna")     # any layout that is read; or facefolds.film_actor()
    scene = facefolds.normalize(capture)
    subject = facefolds.find_subject(scene)
    model = facefolds.train(scene, subject)               # about a minute
    asset = model.export("anna")
    scores = facefolds.evaluate(asset, scene)

    asset = facefolds.load_asset("data/actor/asset")      # needs nothing of what trains one
    picture = asset.render("poster", frame=0)

The names are imported when they are first used. docs/reference/library.md describes them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from facefolds_core.api.asset import Asset, load_asset
    from facefolds_core.api.capture import Capture, film_actor, load_capture
    from facefolds_core.api.model import Model, load_model, train
    from facefolds_core.api.scene import Scene, load_scene, normalize
    from facefolds_core.api.scores import Scores, evaluate
    from facefolds_core.api.subject import Subject, find_subject
    from facefolds_core.asset.validation import validate_asset as validate
    from facefolds_core.errors import UserError
    from facefolds_core.geometry.cameras import Camera
    from facefolds_core.rendering.camera_paths import Eye, camera_of

_PLACES = {
    "Asset": ("facefolds_core.api.asset", "Asset"),
    "Camera": ("facefolds_core.geometry.cameras", "Camera"),
    "Capture": ("facefolds_core.api.capture", "Capture"),
    "Eye": ("facefolds_core.rendering.camera_paths", "Eye"),
    "Model": ("facefolds_core.api.model", "Model"),
    "Scene": ("facefolds_core.api.scene", "Scene"),
    "Scores": ("facefolds_core.api.scores", "Scores"),
    "Subject": ("facefolds_core.api.subject", "Subject"),
    "UserError": ("facefolds_core.errors", "UserError"),
    "camera_of": ("facefolds_core.rendering.camera_paths", "camera_of"),
    "evaluate": ("facefolds_core.api.scores", "evaluate"),
    "film_actor": ("facefolds_core.api.capture", "film_actor"),
    "find_subject": ("facefolds_core.api.subject", "find_subject"),
    "load_asset": ("facefolds_core.api.asset", "load_asset"),
    "load_capture": ("facefolds_core.api.capture", "load_capture"),
    "load_model": ("facefolds_core.api.model", "load_model"),
    "load_scene": ("facefolds_core.api.scene", "load_scene"),
    "normalize": ("facefolds_core.api.scene", "normalize"),
    "train": ("facefolds_core.api.model", "train"),
    "validate": ("facefolds_core.asset.validation", "validate_asset"),
}
"""Name of the API -> module and name there."""

__all__ = [
    "Asset",
    "Camera",
    "Capture",
    "Eye",
    "Model",
    "Scene",
    "Scores",
    "Subject",
    "UserError",
    "__version__",
    "camera_of",
    "evaluate",
    "film_actor",
    "find_subject",
    "load_asset",
    "load_capture",
    "load_model",
    "load_scene",
    "normalize",
    "train",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    place, attribute = _PLACES[name]
    try:
        module = importlib.import_module(place)
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("facefolds_core"):
            raise
        remedy = "pip install 'facefolds[train]'"
        raise ModuleNotFoundError(f"`{name}` needs the package {error.name}: {remedy}", name=error.name) from None
    return getattr(module, attribute)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES})
