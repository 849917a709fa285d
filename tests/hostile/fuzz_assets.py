"""Damaged assets through the validator, the reader and the renderer.

Half of the damage is to files' bytes, or puts something else in their places; the checksums show it. The other half is
to the manifest, or to a file whose checksum is then made anew, so that what lies behind the checksums is reached:
types, bounds, order, decoders. What can be told from data is to be refused; another valid asset is not a defect (how
much damage decoders notice by themselves: tests/asset/test_strict_decoding.py).
"""

from __future__ import annotations

import copy
import hashlib
import json
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.asset import read_asset
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.asset.validation import validate_asset
from facefolds_core.rendering.reference import AssetCaster, composite
from tests.hostile.damage import MUTATIONS, Counts, Outcome, fingerprint, outcome
from tests.hostile.structured import ODD, damage_bytes
from tests.hostile.watch import within
from tests.scenes import look_at_origin
from tests.viewer.fixtures import rich_asset

PATIENCE = 20
"""Seconds for one asset, after which it counts as hung."""
CODES = 2
"""A rendering that differs by more from the undamaged asset's is wrong."""
UNSEALED = "0" * 64
NONSENSE: tuple[Any, ...] = (
    *(None, True, False, "", "1", "nan", "../x", "/etc/passwd", "a\\b", "\x1b[31m", "x" * 5000, "http://127.0.0.1:1/x"),
    *(float("nan"), float("inf"), -1, 0, -0.0, 1e-300, 1e300, 10**9, 10**18, 10**40, 2**63, 0.5),
    *([], {}, [[]], {"a": 1}),
)
LACKING = object()
Damage = tuple[str, bool]
"""(what was done, whether it must be refused)."""


def rendering(level: AssetLevel) -> np.ndarray:
    """(64, 64, 3) codes of the first frame, seen from the front."""
    camera = look_at_origin("front", 10, 5, 64)
    rgb, _ = composite(AssetCaster(level).cast(camera), level.frame(0))
    return np.asarray(255 * np.clip(rgb, 0, 1))


def run(count: int, seed: int, folder: Path) -> Counts:
    """Damage `count` copies of an asset; see the module."""
    whole = rich_asset(folder / "whole" / "asset")
    if problems := validate_asset(whole):
        raise AssertionError(problems)
    (folder / "outside").mkdir()
    (folder / "outside" / "file").write_text("not the asset's")
    outside = fingerprint(folder / "outside")
    truth = [rendering(level) for level in read_asset(whole).levels]
    counts = Counts()
    for index in range(count):
        random = np.random.default_rng([seed, index])
        place = Path(shutil.copytree(whole, folder / "asset", symlinks=True))
        kind = (damage_file, replace_file, damage_sealed_file, damage_manifest, reorder)[int(random.choice(5))]
        what, must_refuse = kind(place, random)
        what = f"assets {seed} {index}: {what}"
        try:
            within(PATIENCE, partial(examine, counts, what, must_refuse, place, truth))()
        except TimeoutError:
            counts.hung.append(what)
        if fingerprint(folder / "outside") != outside:
            counts.harmed.append(what)
        shutil.rmtree(place)
    return counts


def examine(counts: Counts, what: str, must_refuse: bool, place: Path, truth: list[np.ndarray]) -> None:
    """Validate, read and render a damaged asset, and count what came of it."""
    found: list[str] = []
    validated = outcome(lambda: found.extend(validate_asset(place)))
    if validated.kind != "accepted":  # the validator says what is wrong, it raises nothing
        counts.add(f"{what}: validate", Outcome("crashed", validated.text))
        return
    shown: list[np.ndarray] = []
    read = outcome(lambda: shown.extend(rendering(level) for level in read_asset(place).levels))
    if read.kind == "crashed" or not found:
        counts.add(f"{what}: read", read)
    else:
        counts.add(what, Outcome("refused"))
    if found or not must_refuse:
        return
    differs = len(shown) != len(truth) or any(np.abs(a - b).max() > CODES for a, b in zip(shown, truth, strict=True))
    if differs:
        counts.kept_wrong.append(what)


def names(place: Path) -> list[str]:
    return sorted(file.name for file in place.iterdir())


def damage_file(place: Path, random: np.random.Generator) -> Damage:
    """Other bytes; the checksums stay."""
    path = place / random.choice(names(place))
    content = path.read_bytes()
    return f"{damage_bytes(path, random)} {path.name}", path.read_bytes() != content


def replace_file(place: Path, random: np.random.Generator) -> Damage:
    """Something else in a file's place."""
    path = place / random.choice(names(place))
    content = path.read_bytes()
    path.unlink()
    outside = place.parent / "linked"
    kinds: dict[str, Callable[[Path], object]] = {
        **ODD,
        "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
        "a link outside": lambda path: (outside.write_bytes(content), path.symlink_to(outside)),
        "another of its files": lambda path: shutil.copy(place / random.choice(names(place)), path),
    }
    what = random.choice(sorted(kinds))
    kinds[what](path)
    return f"{what} for {path.name}", what != "a link outside"


def damage_sealed_file(place: Path, random: np.random.Generator) -> Damage:
    """Other bytes, with checksums that say they are right: up to the decoders. They may notice, but must not break."""
    value = json.loads((place / "manifest.json").read_text())
    entries = [entry for entry in parts(value) if isinstance(entry, dict) and "sha256" in entry]
    videos = [entry for entry in entries if "codec" in entry]
    chosen = videos if random.random() < 0.5 else entries
    entry = chosen[random.integers(len(chosen))]
    path, mutation = place / entry.get("file", entry.get("mesh")), MUTATIONS[random.integers(len(MUTATIONS))]
    content, header = path.read_bytes(), 0
    if random.random() < 0.5:  # containers' tables, and the heads of meshes and pictures
        header = int(random.integers(1, 2000))
        content = mutation(content[:header], random) + content[header:]
    else:
        content = mutation(content, random)
    path.write_bytes(content)
    entry |= {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    for level in value["levels"]:
        files = [*level["layers"], *level["texture"]["videos"], *filter(None, [level.get("reflection")])]
        level["bytes"] = sum(file["bytes"] for file in files)
    seal(place, value)
    return f"{mutation.__name__} {header or 'all'} bytes of {path.name}, sealed", False


def damage_manifest(place: Path, random: np.random.Generator) -> Damage:
    """One to three values replaced by nonsense, or keys added, left out or doubled."""
    value = json.loads((place / "manifest.json").read_text())
    said = []
    must_refuse = False
    for _ in range(random.integers(1, 4)):
        holders = [part for part in parts(value) if isinstance(part, dict | list) and part]
        holder = holders[random.integers(len(holders))]
        keys: list[Any] = sorted(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = keys[random.integers(len(keys))]
        if isinstance(holder, dict) and random.random() < 0.2:
            if random.random() < 0.5:
                del holder[key]
                said.append(f"no {key}")
            else:
                holder["unknown"] = 1
                said.append("an unknown key")
            must_refuse = True
            continue
        nonsense = copy.deepcopy(NONSENSE[random.integers(len(NONSENSE))])
        # A number may become another number: maybe another valid asset. A string or `true` in a number's place is none.
        must_refuse |= isinstance(holder[key], int | float) and isinstance(nonsense, str | bool | list | dict)
        said.append(f"{key}: {str(nonsense)[:30]!r}")
        holder[key] = nonsense
    seal(place, value)
    return f"manifest {', '.join(said)}", must_refuse


def reorder(place: Path, random: np.random.Generator) -> Damage:
    """Levels or layers in another order, an entry twice, the colours' rectangle in place of the alpha's."""
    value = json.loads((place / "manifest.json").read_text())
    level = value["levels"][random.integers(len(value["levels"]))]
    what = random.choice(["levels", "layers", "layer twice", "halves", "level twice"])
    if what == "levels":
        value["levels"].reverse()
    elif what == "layers":
        level["layers"].reverse()
    elif what == "layer twice":
        level["layers"].append(level["layers"][0])
    elif what == "level twice":
        value["levels"].append(value["levels"][0])
    else:
        swap(level["texture"], "colour_rect", "alpha_rect")
    seal(place, value)
    return f"{what} of {level['name']}", True


def parts(value: Any) -> list[Any]:
    """A value of JSON and all values in it."""
    found, waiting = [], [value]
    while waiting:
        one = waiting.pop()
        found.append(one)
        waiting += one.values() if isinstance(one, dict) else one if isinstance(one, list) else []
    return found


def seal(place: Path, value: Any) -> None:
    """Write a manifest with its own checksum, whatever is in it."""
    text = json.dumps(value | {"manifest_sha256": UNSEALED}, indent=1)
    digest = hashlib.sha256(text.encode()).hexdigest()
    (place / "manifest.json").write_text(text.replace(UNSEALED, digest))


def edit(place: Path, change: Callable[[Any], object]) -> None:
    """Change the manifest as JSON, and seal it again."""
    value = json.loads((place / "manifest.json").read_text())
    change(value)
    seal(place, value)


def swap(value: Any, one: str, other: str) -> None:
    """Two values of an object."""
    value[one], value[other] = value[other], value[one]


def put(*keys: str | int, to: object) -> Callable[[Any], None]:
    """For `edit`: another value at a place, or `LACKING`: none."""

    def change(value: Any) -> None:
        for key in keys[:-1]:
            value = value[key]
        if to is LACKING:
            del value[keys[-1]]
        else:
            value[keys[-1]] = to

    return change
