"""What a folder is, and what would read it: for users who have footage, and for those who named the wrong source."""

from __future__ import annotations

from collections import Counter
from itertools import chain, islice
from pathlib import Path

from facefolds_core.captures.gathering import SUFFIXES, Recognised, inside
from facefolds_core.captures.videos import CONTAINERS
from facefolds_core.errors import UserError
from facefolds_core.facts import shorten
from facefolds_core.files.reading import is_folder, is_regular
from facefolds_core.registry import SOURCES

MOST = 2000
"""Files that are looked at in a folder that nothing recognises."""
NEAR = 50
"""Folders in it, and files of each of them, likewise."""
_COLMAP = "calibrate with COLMAP (a folder of pictures a camera), then `source: colmap`"
_SIGNS: tuple[tuple[str, str, str], ...] = (
    ("annots.npy", "ZJU-MoCap with annots.npy, a pickle, which can run code and is not read",
     "write intri.yml and extri.yml from it with EasyMocap or EasyVolcap, then `source: easymocap`"),
    ("database.db", "a COLMAP project without a model", "run `colmap mapper`, then `source: colmap`"),
    ("sparse", "a COLMAP project without a model", "run `colmap mapper`, then `source: colmap`"),
    ("poses_bounds.npy", "poses of LLFF without videos beside them",
     "use the COLMAP model that they were made from (`source: colmap`), or put cam*.mp4 there (`source: neural3d`)"),
    ("*.psx", "a project of Metashape", "export its cameras to COLMAP or nerfstudio's transforms.json"),
    ("*.mg", "a project of Meshroom", "convert it with `ns-process-data`, then `source: transforms`"),
    ("cameras.sfm", "cameras of Meshroom", "convert them with `ns-process-data`, then `source: transforms`"),
    ("cameras.npz", "cameras of IDR or NeuS", "write transforms.json or a COLMAP model from them"),
    ("scene.json", "a scene that facefolds has normalised", "`path` must be the capture that it was made from"),
    ("manifest.json", "an asset, not a capture", "`facefolds view` plays it"),
    ("*.zip", "packed archives", "unpack them first"),
    ("*.tar*", "packed archives", "unpack them first"),
)  # fmt: skip
"""Name or pattern in a folder -> what it tells, what to do."""


def look(path: Path) -> list[tuple[str, Recognised]]:
    """(source, what it says) of each source that would read `path`; nothing of the files' contents is believed yet."""
    found = []
    for name in SOURCES.names:
        recognise = getattr(SOURCES[name], "recognise", None)
        try:
            said = None if recognise is None else recognise(path)
        except UserError:  # it has the marks of this layout, and what it says of itself is damaged
            said = Recognised(f"a damaged capture of source {name}", path)
        if said is not None:
            found.append((name, said))
    return found


def describe(path: Path) -> tuple[str, str]:
    """What a folder or file looks like that nothing recognises, and what can be done, in words."""
    if not is_folder(path):
        kind = "a film" if path.suffix.lower() in CONTAINERS else "a file"
        return f"{kind}, {path.name}", "point `path` at the folder that holds cameras and pictures"
    below = [(folder, look(folder)) for folder in islice(filter(is_folder, inside(path)), NEAR)]
    known = [f"{folder.name} ({said[0][0]})" for folder, said in below if said]
    if known:
        return f"a folder that holds captures: {shorten(known)}", "point `path` at one of them"
    above = look(path.parent)
    if above:
        name, said = above[0]
        return f"a part of {said.what}", f"point `path` at the folder above, {said.path} (`source: {name}`)"
    for pattern, what, remedy in _SIGNS:
        if next(path.glob(pattern), None) is not None:
            return what, remedy
    return _contents(path)


def _contents(path: Path) -> tuple[str, str]:
    levels = chain.from_iterable(path.glob(level) for level in ("*", "*/*", "*/*/*"))
    files = (file for file in levels if not file.name.startswith(".") and is_regular(file))
    kinds = Counter(file.suffix.lower() for file in islice(files, MOST))
    pictures = sum(kinds[suffix] for suffix in SUFFIXES)
    films = sum(kinds[suffix] for suffix in CONTAINERS)
    listed = ", ".join(f"{count} {suffix or 'without extension'}" for suffix, count in kinds.most_common(5))
    if films:
        return f"{films} films without a calibration ({listed})", f"cut them into pictures and {_COLMAP}"
    if pictures:
        return f"{pictures} pictures without a calibration ({listed})", _COLMAP
    if not kinds:
        return "an empty folder", "put a capture there, or correct the path"
    return f"files of no capture ({listed})", f"{_needs()}, or correct the path"


def _needs() -> str:
    """The layouts that are read."""
    names = [name for name in SOURCES.names if hasattr(SOURCES[name], "recognise")]
    first = [f"{name}: {(SOURCES[name].__doc__ or '').splitlines()[0].rstrip('.')}" for name in names]
    return "bring it into a layout that is read: " + "; ".join(first)


def check_layout(source: str, path: Path) -> None:
    """Refuse a place that is no capture of this source, and say what it is; an absent place is left to the reader."""
    recognise = getattr(SOURCES[source], "recognise", None)
    if recognise is None or not (is_folder(path) or is_regular(path)):
        return
    said = recognise(path)
    if said is not None and said.path == path:
        return
    if said is not None:
        found, remedy = said.what, f"set `path: {said.path}`"
    elif others := look(path):
        found = " or ".join(f"{other.what} (source: {name})" for name, other in others)
        remedy = f"set `source: {others[0][0]}`"
    else:
        found, remedy = describe(path)
    raise UserError(
        f"not a capture of source {source}",
        file=path,
        place="source and path of this subject in params.yaml",
        expected=(SOURCES[source].__doc__ or "").splitlines()[0],
        found=found,
        remedy=f"{remedy}; `facefolds doctor {path}` tells more",
    )
