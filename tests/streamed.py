"""A long take for tests: a short one's groups of pictures over and over, cut into segments."""

from __future__ import annotations

import math
import wave
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import av
import numpy as np

from facefolds_core.asset.audio import encode_sound
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.manifest import Level, Manifest
from facefolds_core.asset.manifest_base import StoredFile
from facefolds_core.asset.manifest_extras import Audio
from facefolds_core.asset.manifest_file import write_manifest
from facefolds_core.asset.streams import make_streams
from facefolds_core.asset.video import FORMATS
from facefolds_core.asset.writer import LevelContent, manifest_of
from facefolds_core.files.writing import file_sha256
from facefolds_core.packaging.levels import stream_unit, write_rungs
from facefolds_core.params import CompressParams, merged
from tests.assets import PLAIN, SOURCE, WINDOW, cap_mesh, cap_textures, radius_of


def stored(path: Path) -> StoredFile:
    return StoredFile(file=path.name, bytes=path.stat().st_size, sha256=file_sha256(path))


class Caps:
    """The textures of the synthetic asset, made when they are asked for."""

    def __init__(self, layers: int, resolution: int) -> None:
        self.layers, self.resolution = layers, resolution

    def image(self, layer: int, frame: int, /) -> np.ndarray[Any, Any]:
        return cap_textures(self.layers, frame, self.resolution)[layer]


def repeated(path: Path, rate: Fraction, times: int) -> None:
    """A video's packets, several times over."""
    long = path.with_name(f"long_{path.name}")
    with (
        av.open(str(path), format=FORMATS[path.suffix[1:]]) as source,
        av.open(str(long), "w", format=FORMATS[path.suffix[1:]]) as out,
    ):
        packets = [packet for packet in source.demux(video=0) if packet.size]
        copy = out.add_stream_from_template(source.streams.video[0], opaque=True)
        copy.time_base = 1 / rate
        contents = [(bytes(packet), packet.is_keyframe) for packet in packets]
        number = count()
        for data, key in contents * times:
            packet = av.Packet(data)
            packet.time_base, packet.pts = 1 / rate, next(number)
            packet.dts, packet.duration, packet.is_keyframe, packet.stream = packet.pts, 1, key, copy
            out.mux(packet)
    long.replace(path)


def streamed_asset(
    folder: Path, section: dict[str, Any], frames: int, times: int = 1, sound: bool = False, resolution: int = 64
) -> Manifest:
    """The caps with two layers at 30 frames a second as a stream of `times` x `frames` pictures.

    Args:
        section: `compress`.
    """
    folder.mkdir(parents=True)
    params = CompressParams.model_validate(merged(PLAIN.model_dump(), section))
    textures, meshes = Caps(2, resolution), [cap_mesh(radius_of(layer)) for layer in range(2)]
    unit = stream_unit(params.levels, resolution)
    layers = crop_layers(meshes, [WINDOW] * 2, textures, frames, unit)
    levels = write_rungs(folder, LevelContent(layers, textures, frames, SOURCE.fps, unit), params, None, [])
    levels = [_longer(folder, level, times) for level in levels]
    audio = None
    if sound:
        source = folder.with_name("tone.wav")
        seconds = frames * times / SOURCE.fps
        with wave.open(str(source), "wb") as file:
            file.setparams((1, 2, 48_000, 0, "NONE", ""))
            tone = np.sin(2 * math.pi * 440 * np.arange(round(48_000 * seconds)) / 48_000)
            file.writeframes((8000 * tone).astype("<i2").tobytes())
        mime = encode_sound(folder / "audio.m4a", source, seconds)
        audio = Audio(**stored(folder / "audio.m4a").model_dump(exclude_none=True), mime=mime)
    made, audio, stream = make_streams(folder, levels, audio)
    manifest = manifest_of(SOURCE, made, folder).model_copy(update={"audio": audio, "stream": stream})
    return write_manifest(manifest, folder / "manifest.json")


def _longer(folder: Path, level: Level, times: int) -> Level:
    if times == 1:
        return level
    texture = level.texture
    videos = []
    for video in texture.videos:
        repeated(folder / video.file, texture.rate, times)
        videos.append(video.model_copy(update=stored(folder / video.file).model_dump(exclude_none=True)))
    keys = tuple(k * texture.frames + key for k in range(times) for key in texture.keyframes)
    update = {"videos": tuple(videos), "frames": texture.frames * times, "keyframes": keys}
    size = level.bytes + sum(b.bytes - a.bytes for a, b in zip(texture.videos, videos, strict=True))
    return level.model_copy(update={"texture": texture.model_copy(update=update), "bytes": size})
