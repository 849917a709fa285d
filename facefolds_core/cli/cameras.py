"""The camera that `facefolds render --camera` names: of the asset, of the capture beside it, or in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facefolds_core.api.cameras import camera_named, cameras_of_asset
from facefolds_core.asset.reader import Asset
from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json
from facefolds_core.geometry.cameras import Camera


def named_camera(asset: Asset, name: str) -> Camera:
    """The camera of that name, in the world of the asset.

    Raises:
        UserError: if there is none, listing those that there are; or if the file holds none.
    """
    if name.endswith(".json"):
        return _from_file(Path(name))
    none = "FILE.json: this asset names no camera, and there is no scene beside it"
    known = cameras_of_asset(asset, asset.folder.resolve().parent)
    return camera_named(name, known, "--camera", none, ", or give a JSON file with K, w2c, width and height")


def _from_file(path: Path) -> Camera:
    remedy = "give one as an object with K by rows, w2c = (R | t) by rows, width, height"
    value = read_json(path, remedy=remedy)
    try:
        K, w2c = np.array(value["K"], float), np.array(value["w2c"], float)
        width, height = int(value["width"]), int(value["height"])
        rotation = w2c[:, :3]
        sound = K.shape == (3, 3) and w2c.shape == (3, 4) and np.isfinite(K).all() and np.isfinite(w2c).all()
        sound = sound and min(width, height) >= 16 and max(width, height) <= 16_384 and K[0, 0] > 0 and K[1, 1] > 0
        sound = sound and np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-2 and np.linalg.det(rotation) > 0
    except (KeyError, TypeError, ValueError, IndexError):
        sound = False
    if not sound:
        raise UserError("no camera in the file", file=path, expected="K, w2c, width and height", remedy=remedy)
    return Camera(path.stem, K, w2c, width, height)
