"""Serve the web player and assets to browsers on this machine: what it needs, nothing else (docs/guide/viewer.md).

Every page that a browser shows can send requests to 127.0.0.1. So the Host header must be this machine's name (a page
whose own name was made to point here, DNS rebinding, sends its own), nobody else may embed what is served, and of an
asset's folder only what its manifest names can be had.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from aiohttp import web

from facefolds_core.errors import UserError
from facefolds_core.serving.files import asset_file, player_file, send

HOST = "127.0.0.1"
NAMES = (HOST, "localhost", "[::1]")
IDLE = 30.0
"""Seconds that a connection may be kept without a request."""

HEADERS = {
    "Cache-Control": "no-cache",  # what is made anew is seen at once
    # WebAssembly and a worker from a blob: the Draco decoder. Styles: the page's and the element's own. Blobs: videos.
    "Content-Security-Policy": "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; "
    "connect-src 'self' blob: data:; img-src 'self' blob: data:; media-src 'self' blob:; "
    "style-src 'self' 'unsafe-inline'; frame-src 'self'; frame-ancestors 'self'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Server": "facefolds",
}

_quiet = logging.getLogger("facefolds.serving")  # malformed requests are the client's affair, not the user's
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


def player_app(player: Path, assets: Mapping[str, Path]) -> web.Application:
    """The player at `/`, each asset at `/NAME/`; GET and HEAD only. Files are revalidated."""

    async def serve(request: web.Request) -> web.StreamResponse:
        first, _, rest = request.path.removeprefix("/").partition("/")
        if first in assets:
            file = await asyncio.to_thread(asset_file, assets[first], rest)
        else:
            rest = request.path.removeprefix("/") or "index.html"
            file = await asyncio.to_thread(player_file, player, rest)
        if file is None:
            raise web.HTTPNotFound
        with file:
            return await send(request, file, rest)

    async def describe(_: web.Request, response: web.StreamResponse) -> None:
        response.headers.update(HEADERS)

    app = web.Application(middlewares=[_checked])
    app.on_response_prepare.append(describe)
    app.router.add_route("*", "/{path:.*}", serve)
    return app


@web.middleware
async def _checked(
    request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
) -> web.StreamResponse:
    """Refuse requests that no browser sends to this server for its own pages."""
    port = request.transport.get_extra_info("sockname")[1] if request.transport else None
    hosts = request.headers.getall("Host", [])
    if len(hosts) != 1 or hosts[0].lower() not in {f"{name}:{port}" for name in NAMES} | set(NAMES * (port == 80)):
        raise web.HTTPForbidden(text=f"403: this server answers to {HOST}:{port} and localhost:{port} only")
    if request.method not in ("GET", "HEAD"):
        raise web.HTTPMethodNotAllowed(request.method, ["GET", "HEAD"])
    if not request.raw_path.startswith("/"):
        raise web.HTTPBadRequest
    return await handler(request)


async def _start(player: Path, assets: Mapping[str, Path], port: int) -> tuple[web.AppRunner, int]:
    """A running server, and the port that it listens on."""
    runner = web.AppRunner(
        player_app(player, assets),
        access_log=None,
        logger=_quiet,
        keepalive_timeout=IDLE,
        lingering_time=1.0,
        shutdown_timeout=1.0,
    )
    await runner.setup()
    try:
        await web.TCPSite(runner, HOST, port).start()
    except BaseException:
        await runner.cleanup()
        raise
    return runner, int(runner.addresses[0][1])


@contextmanager
def serving(player: Path, assets: Mapping[str, Path], port: int = 0) -> Iterator[str]:
    """Serve in a thread for as long as the block lasts.

    Args:
        player: the built player's folder; all regular files in it and below are served.
        assets: name in the address -> folder, of which the manifest and what it names are served.
        port: 0 for any free one.

    Yields:
        The address, such as "http://127.0.0.1:8000/".

    Raises:
        UserError: if the port is taken.
    """
    loop = asyncio.new_event_loop()
    address: Future[str] = Future()

    def run() -> None:
        try:
            runner, own = loop.run_until_complete(_start(player, assets, port))
        except BaseException as error:  # whatever it is, the caller waits for it
            remedy = "choose another one with --port, or leave it out for any free one"
            taken = partial(UserError, "cannot listen on the port", place=f"{HOST}:{port}", remedy=remedy)
            address.set_exception(taken(found=error.strerror) if isinstance(error, OSError) else error)
            return
        address.set_result(f"http://{HOST}:{own}/")
        loop.run_forever()
        loop.run_until_complete(runner.cleanup())
        loop.run_until_complete(loop.shutdown_default_executor())

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield address.result()
    finally:
        if not address.exception():
            loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
