"""The player's server: byte ranges, types, nothing outside its folders."""

from __future__ import annotations

import gzip
import http.client
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from facefolds_core.errors import UserError
from facefolds_core.serving import serving

TEXT = b"the same again and again " * 400


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    root = tmp_path_factory.mktemp("serving")
    for name, data in {
        "player/index.html": b"<!doctype html>",
        "player/page.js": b"1",
        "player/long.js": TEXT,
        "player/draco/decoder.wasm": b"\0asm",
        "asset/manifest.json": b'{"levels": [{"file": "full.mp4"}]}',
        "asset/full.mp4": bytes(range(200)),
        "secret": b"not to be seen",
    }.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(data)
    with serving(root / "player", {"asset": root / "asset"}) as url:
        yield url


def get(address: str, path: str, **headers: str) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=10)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    return response, response.read()


def test_it_listens_on_the_loopback_only(address: str) -> None:
    assert urlsplit(address).hostname == "127.0.0.1"


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/", "text/html"),
        ("/page.js", "application/javascript"),
        ("/draco/decoder.wasm", "application/wasm"),
        ("/asset/full.mp4", "video/mp4"),
    ],
)
def test_files_have_their_types(address: str, path: str, kind: str) -> None:
    response, _ = get(address, path)
    assert response.status == 200
    assert response.getheader("Content-Type", "").startswith(kind)
    assert response.getheader("Cache-Control") == "no-cache"


def test_byte_ranges(address: str) -> None:
    response, data = get(address, "/asset/full.mp4", Range="bytes=10-19")
    assert (response.status, response.getheader("Content-Range")) == (206, "bytes 10-19/200")
    assert data == bytes(range(10, 20))
    response, _ = get(address, "/asset/full.mp4", Range="bytes=500-")
    assert response.status == 416


@pytest.mark.parametrize("path", ["/nothing", "/asset/../secret", "/asset/%2e%2e/secret", "/..%2fsecret"])
def test_what_is_not_there_or_outside_is_not_found(address: str, path: str) -> None:
    response, data = get(address, path)
    assert response.status in (403, 404)
    assert b"not to be seen" not in data


def test_a_port_that_is_taken(address: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot listen"), serving(tmp_path, {}, urlsplit(address).port or 0):
        pass


def test_a_port_that_cannot_be_does_not_hang(tmp_path: Path) -> None:
    with pytest.raises(OverflowError), serving(tmp_path, {}, 70_000):
        pass


def test_texts_and_programs_come_by_gzip(address: str) -> None:
    response, body = get(address, "/long.js", **{"Accept-Encoding": "br, gzip"})
    assert response.getheader("Content-Encoding") == "gzip" and response.getheader("Vary") == "Accept-Encoding"
    assert len(body) < len(TEXT) / 10 and int(response.getheader("Content-Length", "0")) == len(body)
    assert gzip.decompress(body) == TEXT


@pytest.mark.parametrize("said", ["identity", "gzip;q=0", "br"])
def test_who_cannot_read_gzip_gets_the_file(address: str, said: str) -> None:
    response, body = get(address, "/long.js", **{"Accept-Encoding": said})
    assert response.getheader("Content-Encoding") is None and body == TEXT


def test_a_part_is_one_of_the_file_itself(address: str) -> None:
    response, body = get(address, "/long.js", **{"Accept-Encoding": "gzip", "Range": "bytes=4-7"})
    assert (response.status, response.getheader("Content-Encoding"), body) == (206, None, TEXT[4:8])


def test_videos_are_not_packed_again(address: str) -> None:
    response, body = get(address, "/asset/full.mp4", **{"Accept-Encoding": "gzip"})
    assert response.getheader("Content-Encoding") is None and len(body) == 200


def test_what_is_packed_has_a_mark_of_its_own(address: str) -> None:
    plain, _ = get(address, "/long.js")
    response, _ = get(address, "/long.js", **{"Accept-Encoding": "gzip"})
    mark = response.getheader("ETag", "")
    assert mark != plain.getheader("ETag")
    again, body = get(address, "/long.js", **{"Accept-Encoding": "gzip", "If-None-Match": mark})
    assert (again.status, body) == (304, b"")
