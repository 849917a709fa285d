"""The base of a long take: a training of its key frames at once, kept in a folder beside the model."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import safe_open
from torch import Tensor

from facefolds_core.captures.part import part_of
from facefolds_core.captures.scene import Scene
from facefolds_core.config.source_code import digest_of_packages
from facefolds_core.files.writing import atomic_folder
from facefolds_core.model import load_model
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.storage import ExplicitSpec, read_spec
from facefolds_core.model.tensor_files import read_tensors, write_tensors
from facefolds_core.params import ExplicitParams, ReflectionParams
from facefolds_core.training.explicit.loop import Surroundings, fit_with_surroundings
from facefolds_core.training.explicit.reflection_maps import Maps

LOG = "log"
"""Folder in a base's: dvclive's files of its training."""

_REMEDY = "delete the folder: the base is then trained again"


@dataclass(frozen=True)
class Base:
    """What every frame of a take is fitted against.

    Attributes:
        folder: of its model, and of `surroundings.safetensors`.
        spec: of its model; its frames are the key frames.
        manifolds: the layers.
        textures: what all frames share; without frames, which `frame` reads.
        surroundings: gains, cameras.
    """

    folder: Path
    spec: ExplicitSpec
    manifolds: RadialManifolds
    textures: GridTextures
    surroundings: Surroundings

    def lit(self, params: ReflectionParams) -> Maps | None:
        """The reflection that frames are fitted with: none if the base's layers were trained without."""
        reflection = self.textures.reflection
        return None if reflection is None or params.begin == "end" else Maps.of(reflection)

    def mixed(self, shares: NDArray[np.float64]) -> tuple[Tensor, Tensor]:
        """Mean of the key frames' colour [H, W, 3] and alpha [H, W, N], with shares (n,)."""
        sums: dict[str, Tensor] = {}
        with safe_open(str(self.folder / "model.safetensors"), "pt") as file:
            for name in ("frame_colour", "frame_alpha"):
                part = file.get_slice(f"textures.{name}")
                for k in np.flatnonzero(shares):
                    sums[name] = sums.get(name, torch.zeros(())) + float(shares[k]) * part[int(k)]
        return sums["frame_colour"], sums["frame_alpha"]


def digest_of_training(params: ExplicitParams) -> bytes:
    """Of the parameters, and of the code of trainings and models: results of other code are not taken up."""
    digest = hashlib.sha256()
    left_out = {"preset", "segments"}
    values = params.model_dump(mode="json", exclude=left_out)
    digest.update(json.dumps(values, sort_keys=True).encode())
    digest.update(digest_of_packages("training", "subject", "model", "geometry", "params", "spacing").encode())
    return digest.digest()


def digest_of_fitting(params: ExplicitParams) -> bytes:
    """Of the parameters by which frames are fitted to a base."""
    values = params.segments.model_dump(mode="json", include={"steps"})
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).digest()


def digests_of_frames(scene: Scene, frames: Iterable[int]) -> list[bytes]:
    """Of each frame, what it is fitted to: its pictures, mattes, mesh and pose."""
    stores = [scene.open_frames(), scene.open_mattes()]
    surface = scene.load_surface()
    found = []
    for k in frames:
        digest = hashlib.blake2b(digest_size=16)
        for number, store in ((n, one) for n, one in enumerate(stores) if one is not None):
            for camera in scene.indices("train"):
                if (camera, k) in store:
                    digest.update(f"{number} {camera}".encode())
                    digest.update(np.ascontiguousarray(store.image(camera, k)).data)
        if surface is not None:
            digest.update(np.ascontiguousarray(surface[0][k]).data)
        if scene.poses is not None:
            digest.update(scene.poses.quaternions[k].tobytes() + scene.poses.translations[k].tobytes())
        found.append(digest.digest())
    return found


def fingerprint_of_base(scene: Scene, training: bytes, keys: list[int], digests: list[bytes]) -> str:
    """16 hex digits. Args: `training`: of `digest_of_training`; `keys`: the key frames; `digests`: of all frames."""
    digest = hashlib.sha256(training)
    for camera, split in zip(scene.cameras, scene.splits, strict=True):
        if split == "train":
            digest.update(f"{camera.name} {camera.width} {camera.height}".encode())
            digest.update(camera.K.tobytes() + camera.w2c.tobytes())
    plates = scene.open_plates()
    digest.update(repr(scene.radius).encode())
    found = scene.found_gaussians()
    digest.update(b"" if found is None else found.read_bytes())
    for camera_index, _ in () if plates is None else plates:
        digest.update(f"{camera_index}".encode())
        digest.update(np.ascontiguousarray(plates.image(camera_index, 0)).data)  # type: ignore[union-attr]
    surface = scene.load_surface()
    digest.update(b"" if surface is None else surface[1].tobytes())
    for k in keys:
        digest.update(digests[k])
    return digest.hexdigest()[:16]


def train_base(scene: Scene, keys: list[int], params: ExplicitParams, folder: Path, log: Path) -> None:
    """Train the key frames at once, and write the base's folder, whole or not at all."""
    trained, found = fit_with_surroundings(part_of(scene, keys), params, log)
    with atomic_folder(folder) as temporary:
        trained.write(temporary)
        tensors = {
            "gains": torch.from_numpy(np.ascontiguousarray(found.gains)),
            "usual": torch.from_numpy(found.usual),
        }
        write_tensors(temporary / "surroundings.safetensors", tensors, {"splits": json.dumps(found.splits)})
        shutil.copytree(log, temporary / LOG)


def read_base(folder: Path) -> Base:
    """Raises UserError if a file is damaged."""
    spec = read_spec(folder)
    assert isinstance(spec, ExplicitSpec)
    model = load_model(folder)
    textures, manifolds = model.textures, model.manifolds
    assert isinstance(textures, GridTextures) and isinstance(manifolds, RadialManifolds)
    shared = GridTextures(spec.window, spec.texels, spec.num_layers, 0, textures.reflection)
    shared.colour, shared.layers = textures.colour, textures.layers
    tensors, metadata = read_tensors(folder / "surroundings.safetensors", _REMEDY)
    splits = tuple(json.loads(metadata["splits"]))
    surroundings = Surroundings(splits, tensors["gains"].numpy(), tensors["usual"].numpy())
    return Base(folder, spec, manifolds, shared, surroundings)


def with_its_cameras(scene: Scene, base: Base) -> Scene:
    """The scene without the training cameras that the base does not believe."""
    return replace(scene, splits=base.surroundings.splits)
