"""Malformed requests to the player's server on the loopback: it must answer or close, serve on, and keep files."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

from facefolds_core.serving.server import serving
from tests.hostile.damage import MUTATIONS, Counts, Outcome, fingerprint

SECRET = b"not to be seen"
ANSWER = 0.25
"""Seconds that an answer to a broken request may take; some get none until the server's patience ends."""
PATIENCE = 5.0
"""Seconds for an answer to a sound one."""
EVERY = 10
"""A sound request is sent after so many broken ones."""
PATHS = (
    *("/", "/asset/manifest.json", "/asset/full.mp4", "/page.js", "/asset/notes.txt", "/asset/", "/asset/link.drc"),
    *("/asset/pipe.drc", "/../secret", "/asset/../../secret", "/asset/%2e%2e/secret", "/%2e%2e%2fsecret", "//secret"),
    *("/asset/..%5csecret", "/asset/full.mp4%00", "/asset/" + "a" * 4000, "/" + "../" * 1000 + "etc/passwd", "*"),
    *("http://evil.example/", "/asset/full.mp4?x=" + "b" * 7000, "/%", "/%zz", "/\u00e9", "/a b", "", "/.hidden"),
)
METHODS = ("GET", "GET", "GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", "", "G" * 5000)
VERSIONS = ("HTTP/1.1", "HTTP/1.1", "HTTP/1.0", "HTTP/0.9", "HTTP/2.0", "HTTP/99999999999", "", "FTP/1.0")
HEADERS = (
    *("Range: bytes=0-", "Range: bytes=-1", "Range: bytes=5-1", "Range: bytes=0-1,2-3"),
    *("Range: bytes=99999999999999999999-", "Range: \x00", "Connection: close"),
    *("Connection: upgrade\r\nUpgrade: websocket", "Transfer-Encoding: chunked"),
    *("Content-Length: 99999999999999999999", "Content-Length: -1", "Content-Length: 5", "Expect: 100-continue"),
    *("If-None-Match: *", 'If-None-Match: "', "If-Modified-Since: never", "X: " + "y" * 9000),
    "Accept-Encoding: gzip, br, \xff",
    *("Host: evil.example", "Cookie: " + "c=d;" * 3000, ": empty", "no colon", " folded", "X-\x00: 1"),
)


def site(folder: Path, more: Mapping[str, bytes] | None = None) -> None:
    """A player, an asset, what must not be given out, and other or more files."""
    for name, content in {
        "player/index.html": b"<!doctype html>",
        "player/page.js": b"1",
        "player/.hidden": SECRET,
        "asset/manifest.json": b'{"levels": [{"file": "full.mp4"}, {"mesh": "link.drc"}, {"mesh": "pipe.drc"}]}',
        "asset/full.mp4": bytes(range(256)) * 40,
        "asset/notes.txt": SECRET,
        "secret": SECRET,
        **(more or {}),
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / "asset" / "link.drc").symlink_to(folder / "secret")
    os.mkfifo(folder / "asset" / "pipe.drc")


def run(count: int, seed: int, folder: Path) -> Counts:
    """Send `count` broken requests; "accepted" were answered with 2xx or 304, "refused" with 4xx or closed."""
    site(folder)
    before, counts = fingerprint(folder), Counts()
    with serving(folder / "player", {"asset": folder / "asset"}) as address:
        port = urlsplit(address).port or 0
        for index in range(count):
            request = broken_request(np.random.default_rng([seed, index]), port)
            what = f"server {seed} {index}: {request[:60]!r}"
            answer = ask(port, request, ANSWER)
            if SECRET in answer or b"root:" in answer:
                counts.harmed.append(f"{what}: another file was served")
            status = answer.split(b" ", 2)[1] if answer.startswith(b"HTTP/1.") and b" " in answer else b""
            if status.startswith(b"5"):
                counts.add(what, Outcome("crashed", answer[:200].decode("latin-1")))
            else:
                counts.add(what, Outcome("accepted" if status[:1] == b"2" or status == b"304" else "refused"))
            if index % EVERY == EVERY - 1 and not serves(port):
                counts.hung.append(what)
                break
    if fingerprint(folder) != before:
        counts.harmed.append(f"server {seed}: files were changed")
    return counts


def broken_request(random: np.random.Generator, port: int) -> bytes:
    """A request of odd parts, maybe with damaged bytes, maybe only a part of it, maybe several at once."""
    sound = ("GET", "/asset/full.mp4", "HTTP/1.1", f"Host: 127.0.0.1:{port}", "\r\n")
    hosts = (f"Host: localhost:{port}", "Host: evil.example", "Host:", "X: no host")
    odd = [str(random.choice(part)) for part in (METHODS, PATHS, VERSIONS, hosts, ("\n", "\r"))]
    method, path, version, host, end = np.where(random.random(5) < 0.85, sound, odd).tolist()
    lines = [f"{method} {path} {version}", host]
    lines += [str(header) for header in random.choice(HEADERS, random.integers(0, 3))]
    request = (end.join(lines) + 2 * end).encode("latin-1", "replace") + random.bytes(int(random.choice([0, 0, 20])))
    if random.random() < 0.3:
        request = MUTATIONS[random.integers(len(MUTATIONS))](request, random)
    return request * int(random.choice([1, 1, 1, 3]))


def ask(port: int, request: bytes, wait: float) -> bytes:
    """What comes back until the server closes, says nothing for `wait` seconds, or has said a MB."""
    answer = b""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=wait) as connection:
            connection.sendall(request)
            while len(answer) < 1 << 20 and (part := connection.recv(1 << 16)):
                answer += part
    except OSError:
        pass
    return answer


def serves(port: int) -> bool:
    """Whether a sound request is answered."""
    start = time.monotonic()
    request = f"GET /asset/full.mp4 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode()
    answer = ask(port, request, PATIENCE)
    return answer.endswith(bytes(range(256))) and time.monotonic() - start < PATIENCE
