"""Pictures: PNG and JPEG only, decoded strictly."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import EpsImagePlugin
from PIL import Image as Pillow

from facefolds_core.captures.picture import FilePicture
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture, picture_size
from tests.captures.fixtures import encoded
from tests.hostile.damage import flip_bits, truncate, zero_tail

EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 40 64\nshowpage\n%%EOF\n"
SMOOTH = np.clip(np.cumsum(np.random.default_rng(0).integers(-3, 4, (96, 64, 3)), 0) + 128, 0, 255).astype(np.uint8)


def chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    found, at = [], 8
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        found.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    return found


def png(parts: list[tuple[bytes, bytes]]) -> bytes:
    """With right checksums, whatever the parts are."""
    whole = [struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts]
    return b"\x89PNG\r\n\x1a\n" + b"".join(whole)


@pytest.mark.parametrize("name", ["x.png", "poster.jpg"])
@pytest.mark.parametrize("call", [FilePicture.size, FilePicture.rgb])
def test_nothing_is_started_for_an_eps_by_another_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, call: Callable[[FilePicture, str], object]
) -> None:
    reached: list[str] = []
    monkeypatch.setattr(
        EpsImagePlugin, "Ghostscript", lambda *_, **__: reached.append("gs") or Pillow.new("RGB", (1, 1))
    )
    monkeypatch.setattr(EpsImagePlugin.EpsImageFile, "_open", lambda self: reached.append("EPS plugin"))
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: reached.append("process"))
    monkeypatch.setattr(os, "posix_spawn", lambda *_, **__: reached.append("process"))
    (tmp_path / name).write_bytes(EPS)
    with pytest.raises(UserError, match="cannot read an image"):
        call(FilePicture(tmp_path / name), "camera 1")
    assert reached == []


@pytest.mark.parametrize("kind", ["TIFF", "BMP", "WEBP", "GIF", "PPM"])
def test_other_formats_are_refused(kind: str) -> None:
    with pytest.raises(DamagedPictureError, match="no PNG or JPEG"):
        open_picture(encoded(SMOOTH, kind))


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
@pytest.mark.parametrize("mode", ["RGB", "L", "CMYK", "RGBA", "P", "I;16", "1"])
def test_sound_pictures_are_what_pillow_makes_of_them(kind: str, mode: str) -> None:
    if mode in (("CMYK",) if kind == "PNG" else ("RGBA", "P", "I;16", "1")):
        pytest.skip("no such picture")
    buffer = io.BytesIO()
    Pillow.fromarray(SMOOTH).convert("L" if mode == "I;16" else mode).convert(mode).save(buffer, kind)
    with Pillow.open(buffer) as plain:
        np.testing.assert_array_equal(np.asarray(open_picture(buffer.getvalue())), np.asarray(plain))


@pytest.mark.parametrize(
    "options", [{"progressive": True}, {"restart_marker_rows": 1}, {"subsampling": 0}, {"quality": 10}]
)
def test_kinds_of_jpeg(options: dict[str, object]) -> None:
    data = encoded(SMOOTH, "JPEG", **options)
    for whole in (data, data + b"what a camera put behind it"):
        with Pillow.open(io.BytesIO(data)) as plain:
            np.testing.assert_array_equal(np.asarray(open_picture(whole)), np.asarray(plain))


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("mutation", [flip_bits, truncate, zero_tail])
def test_no_png_is_accepted_with_other_pixels(mutation: Callable[..., bytes], seed: int) -> None:
    data = png([*chunks(encoded(SMOOTH, "PNG"))[:1], *_in_parts(1000), (b"IEND", b"")])
    changed = mutation(data, np.random.default_rng(seed))
    try:
        found = np.asarray(open_picture(changed))
    except DamagedPictureError:
        return
    np.testing.assert_array_equal(found, SMOOTH)


def _in_parts(size: int) -> list[tuple[bytes, bytes]]:
    pixels = b"".join(d for kind, d in chunks(encoded(SMOOTH, "PNG")) if kind == b"IDAT")
    return [(b"IDAT", pixels[i : i + size]) for i in range(0, len(pixels), size)]


HEAD, END = chunks(encoded(SMOOTH, "PNG"))[0], (b"IEND", b"")


@pytest.mark.parametrize(
    "parts",
    [
        [HEAD, *_in_parts(500)[:-3], END],
        [HEAD, *_in_parts(500)[3:], END],
        [HEAD, *_in_parts(500)[:3], *_in_parts(500)[2:], END],
        [HEAD, *_in_parts(500)],
        [HEAD, *_in_parts(500)[:3], (b"tEXt", b"a\0b"), *_in_parts(500)[3:], END],
        [HEAD, END],
    ],
    ids=["last", "first", "twice", "no end", "split", "no pixels"],
)
def test_pngs_with_right_checksums_but_wrong_chunks(parts: list[tuple[bytes, bytes]]) -> None:
    with pytest.raises(DamagedPictureError):
        open_picture(png(parts))


@pytest.mark.parametrize("size", [(60_000, 60_000), (12_000, 12_000)])
def test_a_header_that_promises_more_than_the_file_holds(tmp_path: Path, size: tuple[int, int]) -> None:
    header = struct.pack(">IIBBBBB", *size, 8, 2, 0, 0, 0)
    (tmp_path / "x.png").write_bytes(png([(b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), END]))
    with pytest.raises(UserError):
        FilePicture(tmp_path / "x.png").rgb("camera 1")


def test_a_jpeg_that_is_cut_or_lacks_a_part() -> None:
    data = encoded(SMOOTH, "JPEG", restart_marker_rows=1)
    start = data.index(b"\xff\xd2")
    missing = data[:start] + data[data.index(b"\xff\xd4") :]
    for damaged in (data[:-2], data[: len(data) // 2], data[: len(data) // 2] + bytes(len(data) // 2), missing):
        with pytest.raises(DamagedPictureError):
            open_picture(damaged)


@pytest.mark.parametrize("options", [{}, {"progressive": True}])
def test_a_jpeg_with_a_lost_block_is_refused_more_often_than_not(options: dict[str, object]) -> None:
    image = np.random.default_rng(1).integers(0, 256, (200, 200, 3), dtype=np.uint8)
    data = encoded(image, "JPEG", quality=90, **options)
    refused = 0
    for start in range(2000, len(data) - 2000, len(data) // 20):
        try:
            open_picture(data[:start] + bytes(1000) + data[start + 1000 :])
        except DamagedPictureError:
            refused += 1
    assert refused >= 9  # of 18; Pillow alone refuses none


@pytest.mark.parametrize("options", [{}, {"progressive": True}, {"restart_marker_rows": 1}, {"optimize": True}])
def test_blocks_that_were_never_written_are_found(options: dict[str, object]) -> None:
    data = encoded(np.random.default_rng(0).integers(0, 256, (240, 240, 3), dtype=np.uint8), "JPEG", **options)
    for block in range(1, len(data) // 4096):
        for count in (1, 2):
            hole = data[: block * 4096] + bytes(4096 * count) + data[(block + count) * 4096 :]
            with pytest.raises(DamagedPictureError):
                open_picture(hole)


def test_an_even_picture_is_no_block_that_was_never_written() -> None:
    """Its codes are zeros for long, from anywhere to anywhere."""
    image = np.zeros((4000, 4000, 3), np.uint8)
    image[1000:1100, 1000:1100] = np.random.default_rng(0).integers(0, 256, (100, 100, 3))
    data = encoded(image, "JPEG", optimize=True)
    assert bytes(4 * 4096) in data
    assert open_picture(data).size == (4000, 4000)


@pytest.mark.parametrize("call", [picture_size, open_picture])
def test_what_is_no_file_is_not_opened(tmp_path: Path, call: Callable[[Path], object]) -> None:
    os.mkfifo(tmp_path / "x.png")
    with pytest.raises(DamagedPictureError, match="regular"):
        call(tmp_path / "x.png")


def test_memory_that_runs_out_is_not_called_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "x.png").write_bytes(encoded(SMOOTH, "PNG"))

    def fails(self: object) -> None:
        raise MemoryError

    monkeypatch.setattr("PIL.ImageFile.ImageFile.load", fails)
    with pytest.raises(UserError, match="memory ran out"):
        FilePicture(tmp_path / "x.png").rgb("camera 1")


def test_pillow_opens_files_in_one_place_only() -> None:
    root = Path(__file__).parents[2]
    folders = [root / name for name in ("facefolds_core", "stages", "bench", "docs")]
    texts = {path: path.read_text() for folder in folders for path in folder.rglob("*.py")}
    opening = [path.name for path, text in texts.items() if "Image.open(" in text or "Pillow.open(" in text]
    assert (opening, [path for path, text in texts.items() if "allow_pickle=True" in text]) == (["pictures.py"], [])
