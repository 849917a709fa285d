"""A scene whose held-out camera looks straight at a flat asset that shows exactly the truth, and an untrained model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene, read_scene, write_scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.track import Track
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.storage import ModelSpec, build_model
from facefolds_core.scoring.panels import Evaluation, ImageScore, Panel
from tests.scenes import look_at_origin, make_scene

SIZE = 32
FRAMES = 3
TEXELS = 8
"""Equal texels a side of each pixel: all rays through its area meet one colour."""

SPEC = ModelSpec(
    centre=(-0.25, 0.0, 0.0),
    levels=(0.34, 0.31),
    radius=0.45,
    num_frames=FRAMES,
    manifold_layers=2,
    manifold_width=16,
    search_samples=32,
    texture_layers=2,
    texture_width=16,
    latent_dim=4,
    uv_frequencies=4,
    level_frequencies=2,
    view_frequencies=2,
)


def tiny_model(view_bias: float = 0.0) -> RadianceManifolds:
    """An untrained model of two spheres; its view term is `view_bias` everywhere."""
    with torch.random.fork_rng():
        torch.manual_seed(0)
        model = build_model(SPEC).eval()
    biases = [p for name, p in model.textures.named_parameters() if "view" in name and name.endswith("bias")]
    assert len(biases) == 1
    with torch.no_grad():
        biases[0].fill_(view_bias)
    return model


def evaluation(scores: list[ImageScore], **found: Any) -> Evaluation:
    """Of scores alone, without pictures."""
    return Evaluation(scores, [], cast(Panel, None), **found)


def pictures() -> NDArray[np.uint8]:
    """(FRAMES, SIZE, SIZE, 3): what the held-out camera saw."""
    return np.random.default_rng(0).integers(0, 256, (FRAMES, SIZE, SIZE, 3), dtype=np.uint8)


def half_mask() -> NDArray[np.uint8]:
    """(SIZE, SIZE, 1): the subject fills the left half."""
    mask = np.zeros((SIZE, SIZE, 1), np.uint8)
    mask[:, : SIZE // 2] = 255
    return mask


@dataclass(frozen=True)
class FlatAsset:
    """A square that fills the image of the camera at azimuth 0, textured with `frames_` (K, R, R, 3), opaque, each
    pixel of them TEXELS x TEXELS texels; with a `track` it moves."""

    frames_: NDArray[np.uint8]
    track: Track | None = None

    @property
    def num_frames(self) -> int:
        return len(self.frames_)

    @property
    def layers(self) -> tuple[TexturedMesh, ...]:
        st = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
        vertices = np.stack([np.zeros(4), 0.7 * st[:, 0] - 0.35, 0.35 - 0.7 * st[:, 1]], 1).astype(np.float32)
        return (TexturedMesh(vertices, np.array([[0, 2, 1], [1, 2, 3]], np.int32), st),)

    def reflection(self) -> None:
        return None

    @property
    def full(self) -> FlatAsset:
        return self

    @property
    def windows(self) -> tuple[()]:
        return ()

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        return (self.frame(k) for k in range(self.num_frames))

    def frame(self, k: int) -> NDArray[np.uint8]:
        frame = self.frames_[k].repeat(TEXELS, 0).repeat(TEXELS, 1)
        return np.concatenate([frame, np.full((*frame.shape[:2], 1), 255, np.uint8)], -1)[None]


def flat_asset(frames: NDArray[np.uint8] | None = None) -> Asset:
    return cast(Asset, FlatAsset(pictures() if frames is None else frames))


def flat_scene(folder: Path, masks: dict[int, NDArray[np.uint8]] | None = None) -> Scene:
    """Camera 0 of three is held out and looks straight at FlatAsset.

    Args:
        masks: frame -> mask of the held-out camera; None writes no masks.
    """
    make_scene(folder, cameras=3, size=SIZE, frames=FRAMES)
    scene = read_scene(folder)
    front = look_at_origin("front", 0, 0, SIZE)
    scene = replace(scene, cameras=(front, *scene.cameras[1:]), splits=("holdout", "train", "train"))
    write_scene(scene, folder)
    images = pictures()
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), ((i, k, images[k]) for i in range(3) for k in range(FRAMES)))
    (folder / "masks.arrow").unlink()
    if masks is not None:
        write_frames(folder / "masks.arrow", (SIZE, SIZE, 1), ((0, k, mask) for k, mask in masks.items()))
    return scene
