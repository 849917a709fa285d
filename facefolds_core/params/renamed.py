"""Keys of params.yaml that have another name now: section -> old key -> new key."""

from __future__ import annotations

EXPLICIT: dict[str, str] = {
    "level_halfwidth": "geometry.halfwidth",
    "lr_texture": "textures.learning_rate",
    "lr_volume": "volume.learning_rate",
    "lambda_veil": "losses.opacity",
    "lambda_solid": "losses.binarisation",
}
"""Of `train`, model `explicit`; until 0.1."""

MOVED: dict[str, str] = {"mattes": "matte"}
"""Key of `train`, model `explicit` -> the section that has become of it."""
