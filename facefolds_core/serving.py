"""Serve the web player and assets to browsers on this machine: static files with byte ranges, on the loopback only."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path

from aiohttp import web

from facefolds_core.errors import UserError

HOST = "127.0.0.1"


def player_app(player: Path, assets: Mapping[str, Path]) -> web.Application:
    """The player at `/`, each asset's folder at `/NAME/`. Files are revalidated: what is made anew is seen at once."""

    @web.middleware
    async def revalidated(
        request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        response = await handler(request)
        response.headers["Cache-Control"] = "no-cache"
        return response

    async def index(_: web.Request) -> web.FileResponse:
        return web.FileResponse(player / "index.html")

    app = web.Application(middlewares=[revalidated])
    app.router.add_get("/", index)
    for name, folder in assets.items():
        app.router.add_static(f"/{name}/", folder)
    app.router.add_static("/", player)
    return app


@contextmanager
def serving(player: Path, assets: Mapping[str, Path], port: int = 0) -> Iterator[str]:
    """Serve in a thread for as long as the block lasts.

    Args:
        player: the built player's folder.
        assets: name in the address -> folder.
        port: 0 for any free one.

    Yields:
        The address, such as "http://127.0.0.1:8000/".

    Raises:
        UserError: if the port is taken.
    """
    loop = asyncio.new_event_loop()
    address: Future[str] = Future()

    async def start() -> web.AppRunner:
        runner = web.AppRunner(player_app(player, assets), access_log=None)
        await runner.setup()
        try:
            await web.TCPSite(runner, HOST, port).start()
        except OSError as error:
            await runner.cleanup()
            raise UserError(
                "cannot listen on the port",
                place=f"{HOST}:{port}",
                found=error.strerror,
                remedy="choose another one with --port, or leave it out for any free one",
            ) from None
        return runner

    def run() -> None:
        try:
            runner = loop.run_until_complete(start())
        except BaseException as error:  # whatever it is, the caller waits for it
            address.set_exception(error)
            return
        address.set_result(f"http://{HOST}:{runner.addresses[0][1]}/")
        loop.run_forever()
        loop.run_until_complete(runner.cleanup())

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield address.result()
    finally:
        if not address.exception():
            loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
