"""How one level of detail is coded, as the encoders take it: read from the section `compress`, which stays as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from facefolds_core.asset.cropping import CroppedLayer
from facefolds_core.asset.draco import MeshSettings
from facefolds_core.geometry.cameras import Camera
from facefolds_core.packaging.meshbits import position_bits, texture_coordinate_bits
from facefolds_core.params import AttentionParams, CodecName, CompressParams, LevelParams


@dataclass(frozen=True)
class MeshSetting:
    """See `MeshCodec`; with `max_error_pixels` the numbers of bits follow from the meshes (`LevelSetting.fitted`)."""

    quantization_bits: int
    texture_coordinate_bits: int
    compression_level: int


@dataclass(frozen=True)
class VideoSetting:
    """See `VideoCodec`."""

    codec: tuple[CodecName, ...]
    crf: int
    target_psnr: float | None
    preset: str
    keyframe_interval: int


@dataclass(frozen=True)
class LevelSetting:
    """Of one level.

    Attributes:
        mesh, video: for the encoders.
        max_error_pixels: None: the numbers of bits are given.
        attention: where bits go.
    """

    mesh: MeshSettings
    video: VideoSetting
    max_error_pixels: float | None
    attention: AttentionParams

    @classmethod
    def of(cls, params: CompressParams, level: LevelParams | None = None, interval: int | None = None) -> LevelSetting:
        """Of the full level, or of a coarser one, which has a constant rate factor of its own.

        Args:
            interval: frames between the key frames of a stream, which has one a segment.
        """
        mesh, video = params.mesh, params.video
        error = mesh.max_error_pixels
        if level is not None and level.max_error_pixels is not None:
            error = level.max_error_pixels
        return cls(
            MeshSetting(mesh.quantization_bits, mesh.texture_coordinate_bits, mesh.compression_level),
            VideoSetting(
                codec=video.codec,
                crf=video.crf if level is None else level.crf,
                target_psnr=video.target_psnr if level is None else None,
                preset=video.preset,
                keyframe_interval=video.keyframe_interval if interval is None else interval,
            ),
            error,
            params.attention,
        )

    def fitted(self, layers: Sequence[CroppedLayer], cameras: Sequence[Camera]) -> LevelSetting:
        """With numbers of bits that keep `max_error_pixels`; as it is where none is asked for."""
        error = self.max_error_pixels
        if error is None or not cameras:
            return self
        bits, st_bits = position_bits(layers, cameras, error), texture_coordinate_bits(layers, error)
        return replace(self, mesh=MeshSetting(bits, st_bits, self.mesh.compression_level))
