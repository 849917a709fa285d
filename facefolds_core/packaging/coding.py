"""One level: its codecs' settings chosen by what shows, its files written, its quality measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from facefolds_core.asset.codecs import CODECS, Codec
from facefolds_core.asset.manifest import Level, Quality
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.regions import Region
from facefolds_core.asset.video import decode_video, unpack_picture
from facefolds_core.asset.writer import LevelContent, write_level
from facefolds_core.geometry.cameras import Camera
from facefolds_core.packaging import rate
from facefolds_core.packaging.attention import regions_of
from facefolds_core.packaging.settings import fitted
from facefolds_core.packaging.views import FRAMES, ViewMeter
from facefolds_core.params import CodecName, CompressParams, VideoCodec
from facefolds_core.spacing import spread


def make_meter(content: LevelContent, cameras: Sequence[Camera]) -> ViewMeter | None:
    """The yardstick of the content's own textures and meshes; None without cameras."""
    if not cameras:
        return None
    frames = {*spread(range(content.frames), FRAMES), *spread(range(min(content.frames, rate.FRAMES)), FRAMES)}
    meshes = [layer.mesh for layer in content.layers]
    return ViewMeter(meshes, cameras, {frame: content.frame(frame) for frame in frames})


def coded_level(
    folder: Path,
    name: str,
    content: LevelContent,
    params: CompressParams,
    meter: ViewMeter | None,
    cameras: Sequence[Camera],
    shared: Level | None = None,
) -> Level:
    """Write a level and measure it: against the full one before coding, by `meter`.

    Args:
        params: with the level's own values.
        cameras: that see it, for the bits of the meshes and of the video.
        shared: a level whose meshes are this one's, too.
    """
    params = fitted(params, content.layers, cameras)
    video, crfs, encoded = params.video, dict[CodecName, int](), dict[CodecName, Path]()
    regions = regions_of(content, cameras, params.attention)
    with TemporaryDirectory(dir=folder) as scratch:  # a killed run leaves nothing elsewhere
        if meter is not None and video.target_psnr is not None:
            for codec in (CODECS[name] for name in video.codec):
                crf = _crf(Path(scratch), content, regions, codec, video, meter, video.target_psnr)
                crfs[codec.name] = crf
                if content.frames <= rate.FRAMES and not content.part_frames:
                    encoded[codec.name] = _trial(Path(scratch), codec, crf)
        level = write_level(folder, name, content, params.mesh, video, crfs, shared, regions, encoded)
    if meter is None:
        return level
    shown = read_level(folder, level)
    psnr = meter.psnr(enumerate(shown.frames()), meter.hits(shown.layers))
    asked = video.target_psnr if crfs else None
    return level.model_copy(update={"quality": Quality(psnr_to_model=round(psnr, 3), target_psnr=asked)})


def _trial(folder: Path, codec: Codec, crf: int) -> Path:
    return folder / f"{codec.name}_{crf}.{codec.container}"


def _crf(
    folder: Path,
    content: LevelContent,
    regions: Sequence[Region],
    codec: Codec,
    video: VideoCodec,
    meter: ViewMeter,
    target: float,
) -> int:
    """The factor; `folder` has what was tried (`_trial`)."""
    layout = content.layout

    def quality(crf: int) -> float:
        path = _trial(folder, codec, crf)
        content.encode(path, codec, video, crf, min(content.frames, rate.FRAMES), regions)
        pictures = decode_video(path, (layout.width, layout.height), float(content.rate))
        wanted = ((k, picture) for k, picture in enumerate(pictures) if k in meter.frames)
        return meter.psnr((k, unpack_picture(picture, layout)) for k, picture in wanted)

    return rate.search_crf(quality, target, codec.crf(video.crf), codec.worst_crf)
