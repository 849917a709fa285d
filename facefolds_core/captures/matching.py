"""What lies in a capture's folder beside what is asked of it: one of its segments; cameras that have pictures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from facefolds_core.errors import UserError
from facefolds_core.facts import shorten


class Named(Protocol):
    """A camera's calibration."""

    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=Named)


def chosen_segment(names: Collection[str], wanted: str | None, place: Path, missing: str, kind: str = "segment") -> str:
    """The segment that the subject names; the only one, where it names none.

    Args:
        names: of those that there are.
        place: where they were looked for.
        missing: remedy where there are none.
        kind: what the layout calls one; in params.yaml it is `segment` all the same.

    Raises:
        UserError: if there is none, no such one, or several of which none is chosen.
    """
    if wanted in names:
        return str(wanted)
    if wanted is None and len(names) == 1:
        return next(iter(names))
    if not names:
        problem, remedy = f"no {kind}s", missing
    elif wanted is None:
        problem, remedy = f"several {kind}s, and none is chosen", "set `segment` of this subject in params.yaml"
    else:
        problem, remedy = f"no such {kind}", "correct `segment` of this subject in params.yaml"
    raise UserError(
        problem,
        file=place,
        place="segment",
        expected=f"one of {shorten(sorted(names), 100)}" if names else None,
        found=wanted,
        remedy=remedy,
    )


def cameras_with_pictures(
    calibrations: Sequence[N], photos: Mapping[str, Mapping[str, Any]], root: Path
) -> tuple[list[N], list[str], list[str]]:
    """Cameras with both calibration and pictures; names of those without pictures; of those without a calibration.

    Args:
        photos: camera -> frame -> picture.

    Raises:
        UserError: if there is no such camera.
    """
    known = {one.name for one in calibrations}
    used = [one for one in calibrations if photos.get(one.name)]
    if not used:
        raise UserError(
            "no camera has both pictures and a calibration",
            file=root,
            expected=f"pictures of cameras named {shorten([one.name for one in calibrations], 5)}",
            found=shorten(list(photos), 5) or "none",
            remedy="copy calibration and pictures of the same subject",
        )
    bare = [one.name for one in calibrations if not photos.get(one.name)]
    return used, bare, [name for name in photos if name not in known and photos[name]]
