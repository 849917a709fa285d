"""Bytes against quality on held-out cameras: the paper's export and ours, from the same trained model.

python -m bench.rate_distortion --work build/rate                  # trains the actor on 60 frames first
python -m bench.rate_distortion data/mugsy --work build/rate_mugsy  # a subject that was trained with `dvc repro`

`paper`: the whole hemisphere, Poisson on 512 x 512 samples, 32 x 32 vertices a layer with the nearest sample's texture
coordinates, Draco without loss, 1024 x 1024 texels, H.264. `ours`: the sections of the subject's own configuration, as
`configure` left them, meshes by error in pixels; `ours32` the same with as few vertices as the paper's. All go through
the same writer, which crops layers and leaves out what shows nothing: that flatters the paper's. A point is one
constant rate factor; the export stages run once a series, and what is in --work from an earlier run is used again.

Writes rate.json there, and with --chart a PNG; with --plot the points for `dvc plots show`.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import typer
from numpy.typing import NDArray

from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.draco import encode_mesh
from facefolds_core.asset.video import decode_video, encode_video, pack_frame, unpack_picture
from facefolds_core.asset.writer import LevelContent
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import report_user_errors
from facefolds_core.export.stores import read_meshes, read_windows
from facefolds_core.files import atomic_file, read_json, write_json
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.packaging.meshbits import resolved
from facefolds_core.packaging.views import spread, training_cameras
from facefolds_core.params import MeshCodec, VideoCodec
from facefolds_core.params_file import load_params, write_configs
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import composite
from facefolds_core.scoring.metrics import psnr, shown
from stages.bake import bake
from stages.capture import capture
from stages.decimate import decimate
from stages.normalize import normalize
from stages.reconstruct import reconstruct
from stages.sample import sample
from stages.texture import texture
from stages.train import train_stage as train

PAPER: dict[str, dict[str, Any]] = {
    "sample": {"resolution": 1024, "window": "full"},
    "reconstruct": {"method": "poisson", "resolution": 512},
    "decimate": {"resolution": 32, "uv": "nearest"},
    "texture": {"resolution": 1024},
    "bake": {"iterations": 0},
}
FEWER_VERTICES: dict[str, dict[str, Any]] = {"decimate": {"resolution": 32}}
LOSSLESS_MESH = MeshCodec(quantization_bits=0, compression_level=0)
QUANTISED_MESH = MeshCodec(max_error_pixels=0.2, compression_level=10)
STAGES: dict[str, Callable[[SubjectFolders], str]] = {
    "samples": sample,
    "surfaces": reconstruct,
    "meshes": decimate,
    "resampled": texture,
    "textures": bake,
}
"""Folder that a stage writes, whole or not at all -> the stage."""
FACTORS = (17, 22, 27, 32, 38)
FRAMES = 60
"""Of the actor: codecs are compared honestly only on sequences of real length."""
SCORED_FRAMES = 6


@dataclass(frozen=True)
class Point:
    """One asset: its bytes, and dB on the held-out cameras (the subject, where the capture has masks)."""

    series: str
    crf: int
    mesh_bytes: int
    video_bytes: int
    psnr: float

    @property
    def bytes(self) -> int:
        return self.mesh_bytes + self.video_bytes


def exported(subject: Path, work: Path, changes: dict[str, dict[str, Any]]) -> SubjectFolders:
    """Run the export stages of a trained subject in a folder of their own, with changed sections; once."""
    folders = SubjectFolders(work)
    work.mkdir(parents=True, exist_ok=True)
    for name in ("scene", "model"):
        (work / name).unlink(missing_ok=True)
        (work / name).symlink_to((subject / name).resolve())
    shutil.copytree(SubjectFolders(subject).config, folders.config, dirs_exist_ok=True)
    for stage, section in changes.items():
        path = folders.config / f"{stage}.json"
        write_json(path, (read_json(path) if path.exists() else {}) | section)
    for name, run in STAGES.items():
        if not (work / name).exists():
            typer.echo(f"{work.name}: {run(folders)}")
    return folders


def series(
    name: str,
    subject: Path,
    work: Path,
    changes: dict[str, dict[str, Any]],
    mesh: MeshCodec,
    video: VideoCodec,
) -> list[Point]:
    """All points of one series; measured once, then read."""
    path = work / f"{name.replace(', ', '_')}.json"
    if path.exists():
        return [Point(**row) for row in read_json(path)]
    folders = exported(subject, work / name.split(",")[0], changes)
    found = points(name, folders, read_scene(subject / "scene"), mesh, video, FACTORS)
    write_json(path, [asdict(point) for point in found])
    return found


def link(source: Path, target: Path, names: Sequence[str]) -> None:
    """Let an export start from what another one, of the same settings up to there, has made."""
    target.mkdir(parents=True, exist_ok=True)
    for name in names:
        if not (target / name).exists():
            (target / name).symlink_to((source / name).resolve())


def points(
    series: str, folders: SubjectFolders, scene: Scene, mesh: MeshCodec, video: VideoCodec, crfs: Sequence[int]
) -> list[Point]:
    """One point for each factor, on x264's scale: meshes are written once, pictures packed once."""
    store = FrameStore(folders.textures / "textures.arrow")
    layers = crop_layers(
        read_meshes(folders.meshes / "meshes.npz"),
        read_windows(folders.samples / "grids.npz"),
        store,
        scene.num_frames,
    )
    content = LevelContent(layers, store, scene.num_frames, scene.fps)
    coded = [encode_mesh(layer.mesh, resolved(mesh, layers, training_cameras(scene))) for layer in layers]
    meter = HeldOut(scene, [decoded for _, decoded in coded])
    size = sum(len(data) for data, _ in coded)
    layout, codec, found = content.layout, CODECS[video.codec[0]], []
    packed = folders.root / "pictures.yuv"
    pictures = np.memmap(packed, np.uint8, "w+", shape=picture_shape(content))
    for k in range(content.frames):
        pictures[k] = pack_frame(content.frame(k), layout)
    for crf in crfs:
        options = codec.options(video, codec.crf(crf))
        path = folders.root / f"trial.{codec.container}"
        encode_video(path, pictures, (layout.width, layout.height), content.rate, codec, options)
        decoded = decode_video(path, (layout.width, layout.height), float(content.rate))
        quality = meter.psnr((k, unpack_picture(frame, layout)) for k, frame in enumerate(decoded) if k in meter.frames)
        found.append(Point(series, crf, size, path.stat().st_size, quality))
        typer.echo(f"{series}, crf {crf}: {size} + {path.stat().st_size} bytes, {quality:.3f} dB")
    packed.unlink()
    return found


def picture_shape(content: LevelContent) -> tuple[int, int, int]:
    return content.frames, content.layout.height * 3 // 2, content.layout.width


class HeldOut:
    """PSNR on the held-out cameras, in at most SCORED_FRAMES frames: of the subject, where the capture has masks.

    Args:
        meshes: as they are decoded.
    """

    def __init__(self, scene: Scene, meshes: Sequence[TexturedMesh]) -> None:
        self.frames = spread(scene.num_frames, SCORED_FRAMES)
        self._truths, self._masks = scene.open_frames(), scene.open_masks()
        self._hits = {index: cast_layers(scene.cameras[index], meshes) for index in scene.indices("holdout")}

    def psnr(self, textures: Iterable[tuple[int, Sequence[NDArray[np.uint8]]]]) -> float:
        """Mean over cameras and frames, dB. textures: (frame, those of all layers) of the scored frames."""
        values = []
        for k, layers in textures:
            for index, hits in self._hits.items():
                has_mask = self._masks is not None and (index, k) in self._masks
                mask = self._masks.image(index, k)[..., 0] / 255 if self._masks is not None and has_mask else None
                values.append(psnr(shown(composite(hits, layers)[0]), self._truths.image(index, k) / 255, mask))
        return float(np.mean([value for value in values if value is not None]))


def filmed(work: Path) -> Path:
    """The actor in FRAMES frames, filmed, normalised and trained in a folder of its own; once. Returns the folder."""
    folders = SubjectFolders(work / "actor")
    if (folders.model / "model.json").exists():
        return folders.root
    params = load_params("params.yaml")
    folders.config.mkdir(parents=True, exist_ok=True)
    write_configs(params, "actor", folders.config)
    path = folders.config / "capture.json"
    write_json(path, read_json(path) | {"frames": FRAMES})
    for run in (capture, normalize, train):
        typer.echo(f"actor, {FRAMES} frames: {run(folders)}")
    return folders.root


def bytes_at(quality: float, series: list[Point]) -> float | None:
    """Bytes of a series at a quality, by linear interpolation of their logarithm; None where it does not reach it."""
    ordered = sorted(series, key=lambda point: point.psnr)
    if not ordered or not ordered[0].psnr <= quality <= ordered[-1].psnr:
        return None
    logs = np.log([point.bytes for point in ordered])
    return float(np.exp(np.interp(quality, [point.psnr for point in ordered], logs)))


def psnr_at(size: int, series: list[Point]) -> float | None:
    """PSNR of a series at a number of bytes, linear in their logarithm; None beyond its ends."""
    ordered = sorted(series, key=lambda point: point.bytes)
    if not ordered or not ordered[0].bytes <= size <= ordered[-1].bytes:
        return None
    return float(np.interp(np.log(size), np.log([point.bytes for point in ordered]), [point.psnr for point in ordered]))


def quality_table(found: list[Point]) -> str:
    """Markdown: PSNR of each series at the bytes of the paper's points."""

    def cell(anchor: Point, points: list[Point]) -> str:
        value = psnr_at(anchor.bytes, points)
        smaller = [point.psnr for point in points if point.bytes <= anchor.bytes]
        least = f"at least {max(smaller):.2f} dB" if smaller else "larger"
        return least if value is None else f"{value:.2f} dB"

    return _table(found, "bytes", lambda point: f"{point.bytes / 1000:.0f} kB", cell)


def size_table(found: list[Point]) -> str:
    """Markdown: bytes of each series at the qualities of the paper's points."""

    def cell(anchor: Point, points: list[Point]) -> str:
        size = bytes_at(anchor.psnr, points)
        better = [point.bytes for point in points if point.psnr >= anchor.psnr]
        most = f"at most {min(better) / 1000:.0f} kB" if better else "out of reach"
        return most if size is None else f"{size / 1000:.0f} kB"

    return _table(found, "held-out PSNR", lambda point: f"{point.psnr:.2f} dB", cell)


def _table(
    found: list[Point], title: str, row: Callable[[Point], str], cell: Callable[[Point, list[Point]], str]
) -> str:
    """A row for each point of the first series, a column for each series."""
    names = list(dict.fromkeys(point.series for point in found))
    by_name = {name: [point for point in found if point.series == name] for name in names}
    lines = [f"| {title} | {' | '.join(names)} |", "|---" * (1 + len(names)) + "|"]
    lines += [
        f"| {row(anchor)} | {' | '.join(cell(anchor, by_name[name]) for name in names)} |"
        for anchor in by_name[names[0]]
    ]
    return "\n".join(lines)


def draw(found: list[Point], path: Path, title: str) -> None:
    matplotlib.use("agg")
    from matplotlib import pyplot
    from matplotlib.ticker import LogLocator, NullLocator

    figure, axes = pyplot.subplots(figsize=(7, 4.5))
    for name in dict.fromkeys(point.series for point in found):
        line = sorted((point.bytes / 1000, point.psnr) for point in found if point.series == name)
        axes.plot(*zip(*line, strict=True), "o-", label=name)
    axes.set(xscale="log", xlabel="kB, meshes and video", ylabel="PSNR on held-out cameras, dB", title=title)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
    axes.grid(True, alpha=0.3)
    axes.legend()
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=120, bbox_inches="tight")
    pyplot.close(figure)


def main(
    work: Annotated[Path, typer.Option(help="Folder for the exports; a second run uses them again.")],
    subject: Annotated[Path | None, typer.Argument(help="Folder of a trained subject; none: actor, 60 frames.")] = None,
    chart: Annotated[Path | None, typer.Option(help="Write a chart there (PNG).")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write the points there, for `dvc plots show` (JSON).")] = None,
    codec: Annotated[list[str] | None, typer.Option(help="Codecs of ours (several: repeat).")] = None,
) -> None:
    """Compare the paper's export with ours: bytes against PSNR on held-out cameras, from one trained model."""
    with report_user_errors("rate_distortion"):
        folder = subject or filmed(work)
        scene = read_scene(folder / "scene")
        video = VideoCodec(codec=("h264",), preset="medium")
        found = series("paper", folder, work, PAPER, LOSSLESS_MESH, video)
        for name in codec or ["h264", "vp9", "av1"]:
            video = VideoCodec.model_validate({"codec": name})
            found += series(f"ours, {name}", folder, work, {}, QUANTISED_MESH, video)
        link(work / "ours", work / "ours32", ("samples", "surfaces", "resampled"))
        found += series("ours32, h264", folder, work, FEWER_VERTICES, QUANTISED_MESH, VideoCodec())
        rows = [asdict(point) | {"bytes": point.bytes} for point in found]
        write_json(work / "rate.json", rows)
        if plot:
            write_json(plot, rows)
        typer.echo(f"\n{scene.subject}, {scene.num_frames} frames\n{size_table(found)}\n\n{quality_table(found)}")
        if chart:
            draw(found, chart, f"{scene.subject}, {scene.num_frames} frames")


if __name__ == "__main__":
    typer.run(main)
