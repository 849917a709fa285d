"""Where the built web player lies: inside an installed wheel, or in a checkout's viewer/dist."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.errors import UserError

_PACKAGE = Path(__file__).resolve().parents[1]
PLACES = (_PACKAGE / "player_dist", _PACKAGE.parent / "viewer" / "dist")


def find_player(places: tuple[Path, ...] = PLACES) -> Path:
    """The folder of the built player.

    Raises:
        UserError: naming the command that builds it.
    """
    for folder in places:
        if (folder / "index.html").is_file():
            return folder
    raise UserError("the web player has not been built", file=places[-1], remedy="run `make view`, which builds it")
