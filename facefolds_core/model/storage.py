"""A trained model on disk: `model.safetensors` (numbers) and `model.json` (what they are)."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Union

import torch
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from facefolds_core.errors import UserError
from facefolds_core.files.reading import check_regular
from facefolds_core.files.writing import read_json, write_json
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.torso import Torso
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.manifolds import MlpManifolds
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.model.segmented import SegmentedTextures, segment_file
from facefolds_core.model.tensor_files import check_tensors, read_tensors, write_tensors
from facefolds_core.model.textures import MlpTextures
from facefolds_core.registry import MODELS

_REMEDY = "train again: `dvc repro --force train@SUBJECT`"

Count = Annotated[int, Field(ge=2)]
Spec = BaseModel
"""What is written of a model: its `kind`, and its own fields."""


class ModelSpec(BaseModel):
    """Everything that is needed to build a model but its numbers.

    Attributes:
        centre: c, units.
        levels: s-values, falling (outermost first); radii of the starting spheres, units.
        radius: of the ball around c that encloses all layers, units.
        num_frames: K.
        fingerprint: of the configuration and scene that it was trained with (training/checkpoints.py).
        input_scale, output_scale: of `MlpManifolds`.
        others: as in `MlpParams`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal["facefolds-model"] = "facefolds-model"
    version: Literal[2] = 2
    kind: Literal["mlp"] = "mlp"
    centre: tuple[float, float, float]
    levels: Annotated[tuple[float, ...], Field(min_length=1)]
    radius: float
    num_frames: Annotated[int, Field(ge=1)]
    manifold_layers: int
    manifold_width: int
    search_samples: int
    texture_layers: int
    texture_width: int
    latent_dim: int
    uv_frequencies: int
    level_frequencies: int
    view_frequencies: int
    input_scale: float = 6.0
    output_scale: float = 1.0
    fingerprint: str = ""


def _sound_belt(belt: Belt | None) -> Belt | None:
    """Refuses one from a file that no search could end with."""
    if belt is not None and not belt.sound:
        raise ValueError(f"a belt {Belt.BOUNDS}")
    return belt


def _sound_torso(torso: Torso | None) -> Torso | None:
    if torso is not None and not torso.sound:
        raise ValueError("a torso whose numbers are finite, its normal and quaternion of unit length")
    return torso


class ExplicitSpec(BaseModel):
    """The same for the explicit model (`radial`, `grids`).

    Attributes:
        centre: c, units.
        belt: of the chart; absent where there is none.
        torso: what stays in the room while the head turns; absent where nothing does.
        window: (u0, u1, v0, v1).
        nodes: rows and columns of the radius maps.
        texels: H and W of the textures.
        num_layers, num_frames: N and K.
        reflection: rows and columns of its maps, texels a side of its environment; absent where there is none.
        segments: frames in each file of `segmented.py`; absent where all frames are in model.safetensors.
        fingerprint: of the configuration and scene that it was trained with (training/checkpoints.py).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal["facefolds-model"] = "facefolds-model"
    version: Literal[2] = 2
    kind: Literal["explicit"] = "explicit"
    centre: tuple[float, float, float]
    belt: Annotated[Belt | None, AfterValidator(_sound_belt), Field(exclude_if=lambda belt: belt is None)] = None
    torso: Annotated[Torso | None, AfterValidator(_sound_torso), Field(exclude_if=lambda torso: torso is None)] = None
    window: tuple[float, float, float, float]
    nodes: tuple[Count, Count]
    texels: tuple[Count, Count]
    num_layers: Annotated[int, Field(ge=1)]
    num_frames: Annotated[int, Field(ge=1)]
    reflection: Annotated[tuple[Count, Count, Count] | None, Field(exclude_if=lambda shape: shape is None)] = None
    segments: Annotated[
        tuple[Annotated[int, Field(ge=1)], ...] | None, Field(min_length=1, exclude_if=lambda shape: shape is None)
    ] = None
    fingerprint: str = ""

    @model_validator(mode="after")
    def _sound(self) -> ExplicitSpec:
        if self.segments is not None and sum(self.segments) != self.num_frames:
            raise ValueError(f"segments of {sum(self.segments)} frames, but num_frames is {self.num_frames}")
        return self


@cache
def _specs() -> TypeAdapter[Spec]:
    """Of all models (facefolds_core/training/trainers), told apart by `kind`."""
    kinds: Any = Union[tuple(MODELS[name].spec() for name in MODELS.names)]  # noqa: UP007
    return TypeAdapter(Annotated[kinds, Field(discriminator="kind")])


def build_model(spec: Spec) -> RadianceManifolds:
    """An untrained model; its random numbers come from torch's global generator."""
    model: RadianceManifolds = MODELS[spec.model_dump()["kind"]].build(spec)
    return model


def build_explicit(spec: ExplicitSpec) -> RadianceManifolds:
    reflection = None
    if spec.reflection is not None:
        rows, columns, environment = spec.reflection
        reflection = Reflection(ReflectionShape((rows, columns), environment))
    textures: GridTextures
    if spec.segments is None:
        textures = GridTextures(spec.window, spec.texels, spec.num_layers, spec.num_frames, reflection)
    else:
        textures = SegmentedTextures(spec.window, spec.texels, spec.num_layers, spec.segments, reflection)
    blank = torch.ones(*spec.nodes, spec.num_layers)
    manifolds = RadialManifolds(Chart(spec.centre, spec.belt), spec.window, blank, spec.torso)
    return RadianceManifolds(manifolds, textures)


def build_mlp(spec: ModelSpec) -> RadianceManifolds:
    manifolds = MlpManifolds(
        spec.centre,
        spec.levels,
        spec.radius,
        spec.manifold_layers,
        spec.manifold_width,
        spec.search_samples,
        spec.input_scale,
        spec.output_scale,
    )
    textures = MlpTextures(
        len(spec.levels),
        spec.num_frames,
        spec.texture_layers,
        spec.texture_width,
        spec.latent_dim,
        spec.uv_frequencies,
        spec.level_frequencies,
        spec.view_frequencies,
    )
    return RadianceManifolds(manifolds, textures)


def save_model(model: RadianceManifolds, spec: Spec, folder: Path) -> None:
    """Write `model.safetensors` and `model.json` into `folder` (the caller moves a whole folder into place).

    Segments are linked where their files are still there and the disk can, else written anew.
    """
    if isinstance(model.textures, SegmentedTextures):
        _save_segments(model.textures, folder)
    write_tensors(folder / "model.safetensors", model.state_dict(), {"spec": spec.model_dump_json()})
    write_json(folder / "model.json", spec.model_dump(mode="json"))


def _save_segments(textures: SegmentedTextures, folder: Path) -> None:
    segment_file(folder, 0).parent.mkdir()
    for number, path in enumerate(textures.paths):
        target = segment_file(folder, number)
        try:
            os.link(path, target)
        except OSError:
            write_tensors(target, textures.segment(number), {})


def read_spec(folder: Path) -> Spec:
    """`model.json`.

    Raises:
        UserError: if it is missing, garbled or of another kind.
    """
    path = folder / "model.json"
    check_regular(path, _REMEDY)
    value: Any = read_json(path, remedy=_REMEDY)
    try:
        return _specs().validate_python(value)
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(
            "not the description of a model that this version reads",
            file=path,
            place=".".join(str(part) for part in first["loc"]) or None,
            expected=first["msg"],
            found=repr(first["input"])[:200],
            remedy=_REMEDY,
        ) from None


def load_model(folder: str | Path, device: torch.device | str = "cpu") -> RadianceManifolds:
    """The trained model of a folder, in evaluation mode.

    Raises:
        UserError: if files are missing or damaged, or the two files do not belong together.
    """
    folder = Path(folder)
    spec = read_spec(folder)
    path = folder / "model.safetensors"
    tensors, metadata = read_tensors(path, _REMEDY)
    if metadata.get("spec") != spec.model_dump_json():
        raise UserError(
            "model.safetensors and model.json are of different models",
            file=path,
            expected=spec.model_dump_json(),
            found=metadata.get("spec", "no description"),
            remedy=_REMEDY,
        )
    with torch.random.fork_rng(devices=[]):
        model = build_model(spec)
    check_tensors(tensors, model.state_dict(), path, _REMEDY)
    model.load_state_dict(tensors)
    if isinstance(model.textures, SegmentedTextures):
        model.textures.attach([segment_file(folder, i) for i in range(len(model.textures.lengths))], _REMEDY)
    return model.to(device).eval()
