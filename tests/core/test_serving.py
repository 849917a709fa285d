"""The player's server: byte ranges, types, nothing outside its folders."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from facefolds_core.errors import UserError
from facefolds_core.serving import serving


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    root = tmp_path_factory.mktemp("serving")
    for name, data in {
        "player/index.html": b"<!doctype html>",
        "player/page.js": b"1",
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
