"""How one level of detail is coded, as the encoders take it: read from the section `compress`, which stays as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from facefolds_core.asset.cropping import CroppedLayer
from facefolds_core.geometry.cameras import Camera
from facefolds_core.packaging.meshbits import position_bits, texture_coordinate_bits
from facefolds_core.params import AttentionParams, CompressParams, LevelParams, MeshCodec, VideoCodec


@dataclass(frozen=True)
class LevelSetting:
    """Of one level.

    Attributes:
        mesh: for the encoder; with `max_error_pixels` the numbers of bits follow from the meshes (`fitted`).
        video: for the encoder.
        attention: where bits go.
    """

    mesh: MeshCodec
    video: VideoCodec
    attention: AttentionParams

    @classmethod
    def of(cls, params: CompressParams, level: LevelParams | None = None, interval: int | None = None) -> LevelSetting:
        """Of the full level, or of a coarser one, which has a constant rate factor of its own.

        Args:
            interval: frames between the key frames of a stream, which has one a segment.
        """
        mesh, video = params.mesh, params.video
        if level is not None:
            video = video.model_copy(update={"crf": level.crf, "target_psnr": None})
            if level.max_error_pixels is not None:
                mesh = mesh.model_copy(update={"max_error_pixels": level.max_error_pixels})
        if interval is not None:
            video = video.model_copy(update={"keyframe_interval": interval})
        return cls(mesh, video, params.attention)

    def fitted(self, layers: Sequence[CroppedLayer], cameras: Sequence[Camera]) -> LevelSetting:
        """With numbers of bits that keep `max_error_pixels`; as it is where none is asked for."""
        error = self.mesh.max_error_pixels
        if error is None or not cameras:
            return self
        bits = {
            "quantization_bits": position_bits(layers, cameras, error),
            "texture_coordinate_bits": texture_coordinate_bits(layers, error),
        }
        return replace(self, mesh=self.mesh.model_copy(update=bits))
