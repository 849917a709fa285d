"""Files of earlier stages: damage is named with the stage that mends it; nothing hangs, nothing is unpickled."""

from __future__ import annotations

import errno
import io
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pyarrow as pa
import pytest

from facefolds_core.captures.scene import read_scene, write_scene
from facefolds_core.config.stages import read_subject
from facefolds_core.errors import UserError
from facefolds_core.export.stores import read_meshes
from facefolds_core.files.archives import read_npz
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.reading import remake
from facefolds_core.files.writing import read_json
from facefolds_core.model.storage import load_model
from facefolds_core.model.tensor_files import read_tensors
from facefolds_core.reporting.facts import read_images, read_mapping
from tests.captures.test_scene import scene
from tests.hostile.structured import ODD
from tests.hostile.watch import within

IMAGE = np.arange(60, dtype=np.uint8).reshape(5, 4, 3)


def store(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_frames(path, (5, 4, 3), [(0, 0, IMAGE), (0, 1, IMAGE)])
    return path


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("data/anna/scene/frames.arrow", "dvc repro normalize@anna`"),
        ("data/anna/samples/textures.arrow", "dvc repro sample@anna`"),
        ("data/anna/resampled/textures.arrow", "dvc repro texture@anna`"),
        ("data/anna/textures/textures.arrow", "dvc repro bake@anna`"),
        ("data/anna/meshes/meshes.npz", "dvc repro decimate@anna`"),
        ("elsewhere/x.arrow", "dvc repro`"),
    ],
)
def test_the_remedy_names_the_stage(tmp_path: Path, name: str, words: str) -> None:
    assert words in remake(tmp_path / name)
    if name.endswith(".arrow"):
        path = store(tmp_path / name)
        path.write_bytes(path.read_bytes()[:300])
        with pytest.raises(UserError, match="damaged frame store") as caught:
            FrameStore(path)
        assert words in str(caught.value.remedy)


@pytest.mark.parametrize("error", [OSError(errno.ENOMEM, "Cannot allocate memory"), pa.lib.ArrowMemoryError("1")])
def test_memory_that_runs_out_is_no_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    path = store(tmp_path / "scene" / "frames.arrow")
    monkeypatch.setattr(pa, "memory_map", Mock(side_effect=error))
    with pytest.raises(UserError, match="memory ran out"):
        FrameStore(path)


def test_an_image_that_the_store_lacks_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="an image is missing") as caught:
        FrameStore(store(tmp_path / "frames.arrow")).image(3, 0)
    assert "3" in str(caught.value.place)


@pytest.mark.parametrize("shape", [(5, 4, 4), (5, 400, 3), (-5, -4, 3), (0, 4, 3)])
def test_a_store_whose_shape_does_not_fit_its_pixels(tmp_path: Path, shape: tuple[int, int, int]) -> None:
    path = tmp_path / "frames.arrow"
    names = ("height", "width", "channels")
    fields = [("camera", pa.int32()), ("frame", pa.int32()), ("pixels", pa.binary(60))]
    schema = pa.schema(fields, metadata={n: str(v) for n, v in zip(names, shape, strict=True)})
    columns = [pa.array([0], pa.int32()), pa.array([0], pa.int32()), pa.array([IMAGE.tobytes()], pa.binary(60))]
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, schema) as writer:
        writer.write_batch(pa.record_batch(columns, schema=schema))
    with pytest.raises(UserError, match="damaged frame store"):
        FrameStore(path)


def archive(path: Path, data: bytes, compression: int = zipfile.ZIP_STORED) -> Path:
    with zipfile.ZipFile(path, "w", compression) as file:
        file.writestr("vertices_00.npy", data)
    return path


def npy(shape: str, data: bytes = b"", kind: str = "'<f4'") -> bytes:
    """An array's file with any header."""
    header = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header + data


NONE_OF_OURS = {
    "huge": npy("(1000000000000,)"),
    "bomb": npy("(10000000,)", bytes(40_000_000)),
    "pickle": npy("(3,)", bytes(24), "'|O'"),
    "negative": npy("(-3,)", bytes(12)),
    "short": npy("(3, 3)", bytes(12)),
}


@pytest.mark.parametrize("name", NONE_OF_OURS)
def test_archives_that_are_none_of_ours(tmp_path: Path, name: str) -> None:
    compression = zipfile.ZIP_DEFLATED if name == "bomb" else zipfile.ZIP_STORED
    with pytest.raises(UserError, match="a damaged geometry file"):
        read_meshes(archive(tmp_path / "meshes.npz", NONE_OF_OURS[name], compression))


def test_an_archive_is_what_numpy_reads(tmp_path: Path) -> None:
    arrays = {"a": np.eye(3, dtype=np.float32), "b": np.asfortranarray(np.arange(6).reshape(2, 3)), "c": np.zeros(0)}
    np.savez(tmp_path / "x.npz", **arrays)
    found = read_npz(tmp_path / "x.npz", "damaged")
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
        assert (found[name].dtype, found[name].flags.writeable) == (array.dtype, True)
    assert set(read_npz(tmp_path / "x.npz", "damaged", {"b"})) == {"b"}


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[Callable[[str], object], tuple[str]]:
            return os.mkdir, (str(tmp_path / "made"),)

    buffer = io.BytesIO()
    np.save(buffer, np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(UserError):
        read_meshes(archive(tmp_path / "meshes.npz", buffer.getvalue()))
    assert not (tmp_path / "made").exists()


READERS: dict[str, Callable[[Path], object]] = {
    "frames.arrow": FrameStore,
    "meshes.npz": read_meshes,
    "scene.json": lambda path: read_scene(path.parent),
    "model.json": lambda path: load_model(path.parent),
    "model.safetensors": lambda path: read_tensors(path, "train again"),
    "entry.json": lambda path: read_subject(path.parent),
    "per_image.parquet": read_images,
    "fit.json": read_mapping,
}


@pytest.mark.parametrize("odd", [name for name in ODD if name != "nothing"])
@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_never_opened(tmp_path: Path, name: str, odd: str) -> None:
    path = tmp_path / name
    ODD[odd](path)
    with pytest.raises(UserError) as caught:
        within(10, lambda: READERS[name](path))()
    assert caught.value.file == path and caught.value.remedy


CHANGES: list[dict[str, Any]] = [
    {"splits": 1, "cameras": []},
    {"frame_ids": [1, 2]},
    {"times": [0.0]},
    {"times": [0.0, float("nan")]},
    {"fps": 1e300},
    {"subject": 3},
    {"from_capture": {"scale": -1, "rotation": np.eye(3).tolist(), "translation": [0, 0, 0]}},
    {"from_capture": {"scale": 1, "rotation": [1], "translation": [0, 0, 0]}},
]
CAMERAS: list[dict[str, Any]] = [
    {"split": "other"},
    {"width": 10},
    {"width": 0},
    {"K": [[1, 2], [3, 4]]},
    {"K": np.zeros((3, 3)).tolist()},
    {"w2c": (2 * np.eye(3, 4)).tolist()},
    {"w2c": np.full((3, 4), 1e300).tolist()},
    {"name": None},
]


@pytest.mark.parametrize("change", [*CHANGES, *CAMERAS], ids=str)
def test_a_scene_with_values_that_none_has(tmp_path: Path, change: dict[str, Any]) -> None:
    write_scene(scene(tmp_path), tmp_path)
    path = tmp_path / "scene.json"
    value = json.loads(path.read_text())
    (value if change in CHANGES else value["cameras"][1]).update(change)
    path.write_text(json.dumps(value))
    with pytest.raises(UserError) as caught:
        read_scene(tmp_path)
    assert caught.value.file == path


def test_a_scene_that_is_no_object(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text("[1]")
    with pytest.raises(UserError, match="another version"):
        read_scene(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"faces": np.array([[0, 1, 3]], np.int32)},
        {"faces": np.zeros((0, 3), np.int32)},
        {"vertices": np.full((2, 3, 3), np.nan, np.float32)},
        {"vertices": np.zeros((1, 3, 3), np.float32)},
        {"vertices": np.zeros((2, 3, 3))},
    ],
    ids=["face", "no faces", "nan", "frames", "type"],
)
def test_a_surface_that_does_not_fit_its_scene(tmp_path: Path, change: dict[str, Any]) -> None:
    sound = {"vertices": np.zeros((2, 3, 3), np.float32), "faces": np.array([[0, 1, 2]], np.int32)}
    np.savez(tmp_path / "surface.npz", **(sound | change))
    with pytest.raises(UserError, match="tracked mesh of the scene is damaged"):
        scene(tmp_path).load_surface()


def test_json_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    """Windows' editors write one."""
    (tmp_path / "transforms.json").write_bytes(b"\xef\xbb\xbf" + b'{"a": 1}')
    assert read_json(tmp_path / "transforms.json") == {"a": 1}
