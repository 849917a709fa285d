"""One level: its codecs' settings chosen by what shows, its files written, its quality measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from facefolds_core.asset.codecs import CODECS, Codec
from facefolds_core.asset.manifest import Level, Quality
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.regions import Regions
from facefolds_core.asset.video import decode_video, unpack_picture
from facefolds_core.asset.writer import LevelContent, write_level
from facefolds_core.geometry.cameras import Camera
from facefolds_core.packaging import rate
from facefolds_core.packaging.attention import regions_of
from facefolds_core.packaging.settings import LevelSetting, VideoSetting
from facefolds_core.packaging.views import FRAMES, ViewMeter
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
    setting: LevelSetting,
    meter: ViewMeter | None,
    cameras: Sequence[Camera],
    shared: Level | None = None,
) -> Level:
    """Write a level and measure it: against the full one before coding, by `meter`.

    Args:
        cameras: that see it, for the bits of the meshes and of the video.
        shared: a level whose meshes are this one's, too.
    """
    setting = setting.fitted(content.layers, cameras)
    video, crfs = setting.video, None
    regions = regions_of(content, cameras, setting.attention)
    if meter is not None and video.target_psnr is not None:
        target = video.target_psnr
        crfs = {codec: _crf(folder, content, regions, CODECS[codec], video, meter, target) for codec in video.codec}
    level = write_level(folder, name, content, setting, crfs, shared, regions)
    if meter is None:
        return level
    shown = read_level(folder, level)
    psnr = meter.psnr(enumerate(shown.frames()), meter.hits(shown.layers))
    asked = None if crfs is None else video.target_psnr
    return level.model_copy(update={"quality": Quality(psnr_to_model=round(psnr, 3), target_psnr=asked)})


def _crf(
    folder: Path,
    content: LevelContent,
    regions: Regions,
    codec: Codec,
    video: VideoSetting,
    meter: ViewMeter,
    target: float,
) -> int:
    layout = content.layout
    with TemporaryDirectory(dir=folder) as scratch:  # a killed run leaves nothing elsewhere
        path = Path(scratch) / f"trial.{codec.container}"

        def quality(crf: int) -> float:
            content.encode(path, codec, video, crf, min(content.frames, rate.FRAMES), regions)
            pictures = decode_video(path, (layout.width, layout.height), float(content.rate))
            wanted = ((k, picture) for k, picture in enumerate(pictures) if k in meter.frames)
            return meter.psnr((k, unpack_picture(picture, layout)) for k, picture in wanted)

        return rate.search_crf(quality, target, codec.crf(video.crf), codec.worst_crf).crf
