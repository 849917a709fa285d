"""The player's server: types, byte ranges; and what no player sends: other hosts, other files, broken requests."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from facefolds_core.errors import UserError
from facefolds_core.serving import server as module
from facefolds_core.serving.server import serving
from tests.hostile.fuzz_server import SECRET, ask, site

CONTENT = bytes(range(200))
WAIT = 3.0
"""Seconds for an answer."""


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("hostile")
    names = ["full.mp4", "link.drc", "inner.drc", "pipe.drc", "../secret", "/etc/passwd", "folder", "gone.drc"]
    manifest = json.dumps({"levels": [{"layers": [{"mesh": name} for name in names]}]}).encode()
    more = {"player/draco/decoder.wasm": b"\0asm", "asset/folder/file": SECRET}
    site(root, {"asset/manifest.json": manifest, "asset/full.mp4": CONTENT, **more})
    (root / "asset" / "inner.drc").symlink_to("full.mp4")
    (root / "player" / "link.js").symlink_to(root / "secret")
    return root


@pytest.fixture(scope="module")
def port(root: Path) -> Iterator[int]:
    with serving(root / "player", {"asset": root / "asset"}) as url:
        yield urlsplit(url).port or 0


def get(port: int, path: str, *headers: str, host: str = "", method: str = "GET") -> tuple[int, bytes, bytes]:
    """(status, head, body) of one request."""
    lines = [f"{method} {path} HTTP/1.1", f"Host: {host or f'127.0.0.1:{port}'}", "Connection: close", *headers, "", ""]
    head, _, body = ask(port, "\r\n".join(lines).encode("latin-1"), WAIT).partition(b"\r\n\r\n")
    return int(head.split()[1]), head, body


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LOCALHOST", "[::1]"])
def test_this_machines_names(port: int, name: str) -> None:
    assert get(port, "/", host=f"{name}:{port}")[0] == 200


@pytest.mark.parametrize("name", ["evil.example:{}", "127.0.0.1", "localhost:1", "127.0.0.1.evil.example:{}", "0:{}"])
def test_another_host_is_refused(port: int, name: str) -> None:
    status, _, body = get(port, "/asset/full.mp4", host=name.format(port))
    assert status in (400, 403) and CONTENT not in body


def test_no_host_and_two_hosts(port: int) -> None:
    for request in (
        b"GET /asset/full.mp4 HTTP/1.0\r\n\r\n",
        f"GET /asset/full.mp4 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nHost: evil.example\r\n\r\n".encode(),
    ):
        answer = ask(port, request, WAIT)
        assert answer.split()[1] in (b"400", b"403") and CONTENT not in answer


@pytest.mark.parametrize(
    "path",
    [
        *(f"/asset{name}" for name in ("", "/", "/notes.txt", "/folder", "/folder/file", "/link.drc", "/pipe.drc")),
        *(f"/asset/{name}" for name in ("gone.drc", "../secret", "%2e%2e/secret", "..%2fsecret", "/etc/passwd")),
        *(f"/asset/{name}" for name in ("%2fetc%2fpasswd", "..\\secret", "full.mp4%00.txt")),
        *("/.hidden", "/link.js", "/draco/", "/draco", "/%ff%fe", "/" + "a" * 300, "/" + "a/" * 3000),
    ],
)
def test_nothing_else_is_served(port: int, path: str) -> None:
    status, _, body = get(port, path)
    assert 400 <= status < 500 and SECRET not in body and b"root:" not in body


def test_what_the_manifest_names_is_served(port: int) -> None:
    assert get(port, "/asset/full.mp4")[2] == CONTENT
    assert get(port, "/asset/inner.drc")[2] == CONTENT
    assert get(port, "/asset/manifest.json")[0] == get(port, "/draco/decoder.wasm")[0] == 200


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/", b"text/html"),
        ("/page.js", b"application/javascript"),
        ("/draco/decoder.wasm", b"application/wasm"),
        ("/asset/full.mp4", b"video/mp4"),
    ],
)
def test_files_have_their_types(port: int, path: str, kind: bytes) -> None:
    head = get(port, path)[1]
    assert b"Content-Type: " + kind in head and b"Cache-Control: no-cache" in head


def test_a_port_that_is_taken_or_cannot_be(port: int, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--port"), serving(tmp_path, {}, port):
        pass
    with pytest.raises(OverflowError), serving(tmp_path, {}, 70_000):
        pass


def test_headers_against_other_pages(port: int) -> None:
    for path in ("/", "/asset/full.mp4", "/nothing"):
        head = get(port, path)[1].lower()
        assert b"x-content-type-options: nosniff" in head
        assert b"content-security-policy: default-src 'none'" in head
        assert b"cross-origin-resource-policy: same-origin" in head
        assert b"aiohttp" not in head


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "FOO"])
def test_only_get_and_head(port: int, method: str) -> None:
    assert get(port, "/", method=method)[0] in (400, 405)


def test_head_has_no_body(port: int) -> None:
    status, head, body = get(port, "/asset/full.mp4", method="HEAD")
    assert (status, body) == (200, b"") and b"Content-Length: 200" in head


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("bytes=0-0", CONTENT[:1]),
        ("bytes=190-", CONTENT[190:]),
        ("bytes=-5", CONTENT[-5:]),
        ("bytes=-900", CONTENT),
        ("bytes=150-99999999", CONTENT[150:]),
    ],
)
def test_ranges(port: int, header: str, expected: bytes) -> None:
    status, _, body = get(port, "/asset/full.mp4", f"Range: {header}")
    assert (status, body) == (206, expected)


@pytest.mark.parametrize("header", ["200-", "9-3", "-0", "-", "a-b", "0-1,3-4", "9" * 50 + "-", None, ""])
def test_ranges_that_cannot_be(port: int, header: str | None) -> None:
    status, head, _ = get(port, "/asset/full.mp4", f"Range: bytes={header}" if header else f"Range: {header or 'x'}")
    assert status == 416 and b"Content-Range: bytes */200" in head


def test_a_file_that_is_unchanged_is_not_sent_again(port: int) -> None:
    head = get(port, "/asset/full.mp4")[1]
    tag = next(line for line in head.decode().splitlines() if line.startswith("ETag"))[6:]
    assert get(port, "/asset/full.mp4", f"If-None-Match: {tag}")[0] == 304
    assert get(port, "/asset/full.mp4", "Range: bytes=0-1", 'If-Range: "older"')[2] == CONTENT


@pytest.mark.parametrize(
    "request_bytes",
    [
        b"\0\1\2\3",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nX: " + b"a" * 100_000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: a\r\n" * 5000 + b"\r\n",
        b"GET / HTTP/1.1\r\nConnection: close\r\nHost: \xff\xfe\r\n\r\n",
        b"GET http://evil.example/ HTTP/1.1\r\nConnection: close\r\nHost: evil.example\r\n\r\n",
    ],
)
def test_malformed_requests(port: int, request_bytes: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    answer = ask(port, request_bytes, WAIT)
    assert answer == b"" or answer.split()[1].startswith(b"4")
    assert get(port, "/")[0] == 200  # others are served as before
    assert "Traceback" not in "".join(capfd.readouterr())


def test_half_a_second_request_is_not_waited_for(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "IDLE", 0.2)
    with serving(root / "player", {}) as url:
        port = urlsplit(url).port or 0
        with socket.create_connection(("127.0.0.1", port)) as slow:
            slow.settimeout(5)
            slow.sendall(f"HEAD / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
            assert slow.recv(10_000).startswith(b"HTTP/1.1 200")
            slow.sendall(b"GET / HTTP/1.1\r\n")
            assert slow.recv(100) == b""


def test_a_file_that_shrinks_while_it_is_sent(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("")
    path = tmp_path / "large.bin"
    size = 64 << 20
    with path.open("wb") as file:
        file.truncate(size)
    with serving(tmp_path, {}) as url:
        port = urlsplit(url).port or 0
        with socket.create_connection(("127.0.0.1", port)) as client:
            client.settimeout(10)
            client.sendall(f"GET /large.bin HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
            client.recv(1000)
            os.truncate(path, 1000)
            received = 0
            try:
                while part := client.recv(1 << 20):
                    received += len(part)
            except ConnectionError:
                pass
            assert received < size
        assert get(port, "/")[0] == 200
