"""params.yaml and the stages' configuration files, damaged and hostile: each is refused clearly, or harmless.

Two kinds, in turn: bytes of a sound file damaged as a disk or an editor would, and a sound file with one place replaced
by something that a user (or an attacker) might write.
"""

from __future__ import annotations

import copy
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from facefolds_core.config.params_file import load_params, write_configs
from facefolds_core.config.stages import read_stage, read_subject, read_train
from facefolds_core.files.paths import SubjectFolders, check_place, subject_folders
from facefolds_core.params import SECTIONS, STAGE_SECTIONS
from tests.hostile.damage import MUTATIONS, Counts, fingerprint, outcome

LEVEL = {"name": "small", "mesh_resolution": 16, "texture_resolution": 128, "crf": 30}
SOUND: dict[str, Any] = {
    "subjects": {
        "actor": {"source": "actor", "path": "facefolds_core/captures/actor", "texture": {"resolution": 256}},
        "anna": {"source": "multiface", "path": "../captures/anna", "frames": {"start": 0, "stop": 9}, "fps": 30},
    },
    "capture": {"cameras": 24, "frames": 12},
    "normalize": {"long_side": 768},
    "subject": {"iterations": 300},
    "train": {"preset": "fast", "seed": 0},
    "sample": {"resolution": 512},
    "reconstruct": {"method": "grid"},
    "decimate": {"resolution": 64},
    "texture": {"resolution": 512},
    "bake": {"hold": 0.01},
    "compress": {"video": {"codec": "h264", "crf": 20}, "levels": [LEVEL]},
    "evaluate": {"background": [0, 0, 0]},
}
NAMES = (
    *("..", "../precious", "../../outside", "a;touch X", "$(touch X)", "`x`", "", " ", "-x", "a/b", "a\nb", "\u00e9"),
    *("x" * 65, ".config", "~", "con", "1", "yes", "null", "@", "a@b", "\u202e", "<<"),
)
VALUES = (
    *(None, True, False, -1, 0, 2**63, 10**400, 1e308, float("inf"), float("nan"), -0.0, 1e-300, "3", "true", ""),
    *([], {}, [[]], [None], {"a": None}, "x" * 100_000, "a\0b", "https://x/y", "/", "..", "\ud800", "${key}"),
    *(list(range(1000)), {"every": 0}, {"every": 2}, {str(i): i for i in range(100)}, [{}], "!!python/name:os.system"),
)
LINES = (
    *("a: &a [*a]", "<<: *none", "? [a]\n: b", "a: !!int x", "a: !!timestamp x", "a: 2024-13-45", "a: !!binary '='"),
    *("a: !!python/object/apply:os.system ['touch X']", "%YAML 9.9\n---", "a: " + "9" * 5000, "[" * 3000, "\ta: b"),
    *("train: {}\ntrain: {}", "a: {" * 200, "---\nb: 1", "a: !!set {b, c}", "a: !!omap [b: 1]", "a: 1:99:99.9", "\x00"),
)


def run(count: int, seed: int, folder: Path) -> Counts:
    """Try `count` files in `folder`, and see that nothing but them changed."""
    counts = Counts()
    precious = folder / "precious"
    for name in ("config", "capture"):
        (precious / name).mkdir(parents=True)
        (precious / name / "kept.txt").write_text("kept")
    before = fingerprint(precious)
    for index in range(count):
        random = np.random.default_rng([seed, index])
        path = folder / "work" / "params.yaml"
        path.parent.mkdir(exist_ok=True)
        what = f"params, seed {seed}, number {index}"
        if index % 4 == 3:
            counts.add(what, outcome(partial(_read_damaged_config, path.parent, random)))
        else:
            path.write_bytes((_damaged_bytes, _hostile_value, _hostile_line)[index % 4](random))
            counts.add(what, outcome(partial(_configure, path)))
        if fingerprint(precious) != before or list(folder.rglob("X")):
            counts.harmed.append(what)
    return counts


def _damaged_bytes(random: np.random.Generator) -> bytes:
    return _pick(MUTATIONS, random)(yaml.safe_dump(SOUND).encode(), random)


def _hostile_value(random: np.random.Generator) -> bytes:
    """One value, or one key, anywhere in the tree replaced."""
    tree = copy.deepcopy(SOUND)
    place: Any = tree if random.random() < 0.7 else tree["subjects"]
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = _pick(keys, random)
        inner = place[key]
        if not isinstance(inner, (dict, list)) or not inner or random.random() < 0.25:
            break
        place = inner
    if isinstance(place, dict) and random.random() < 0.35:
        place[_pick(NAMES, random)] = place.pop(key)
    elif isinstance(inner, int) and random.random() < 0.5:
        place[key] = int(inner * random.uniform(0, 3))
    else:
        place[key] = _pick(VALUES, random)
    try:
        return yaml.safe_dump(tree, allow_unicode=True).encode("utf-8", "surrogatepass")
    except (yaml.YAMLError, ValueError):  # what YAML cannot write, and an integer too long for Python to print
        return json.dumps(SOUND).replace("512", "9" * 5000).encode()


def _hostile_line(random: np.random.Generator) -> bytes:
    lines = yaml.safe_dump(SOUND).splitlines()
    at = int(random.integers(0, len(lines) + 1))
    indent = "  " * int(random.integers(0, 3))
    return "\n".join([*lines[:at], indent + _pick(LINES, random), *lines[at:]]).encode("utf-8", "surrogatepass")


def _configure(path: Path) -> None:
    """What the stage `configure` does with it."""
    params = load_params(path)
    data = path.parent / "data"
    for name, subject in params.subjects.items():
        folders = subject_folders(data, name)
        check_place(subject.path, folders, "path")
        write_configs(params, name, folders.config)


def _read_damaged_config(folder: Path, random: np.random.Generator) -> None:
    folders = SubjectFolders(folder / "data" / "sound")
    sound = folder / "sound.yaml"
    tree = {**SOUND, "subjects": {"sound": SOUND["subjects"]["anna"]}, "compress": {}}
    sound.write_text(yaml.safe_dump(tree))
    name = _pick(["subject", *STAGE_SECTIONS], random)
    write_configs(load_params(sound), "sound", folders.config)
    path = folders.config / f"{name}.json"
    content = path.read_bytes()
    hostile = [b"[" * 10_000, b'{"a":' * 10_000, b"9" * 5000, content.replace(b"{", b'{"a": 1, "a": 2,', 1)]
    content = _pick(hostile, random) if random.random() < 0.3 else _pick(MUTATIONS, random)(content, random)
    path.write_bytes(content)
    if name == "subject":
        read_subject(folders.config)
    elif name == "train":
        read_train(folders.config)
    else:
        read_stage(SECTIONS[name][0], folders.config)


def _pick(choices: Any, random: np.random.Generator) -> Any:
    return choices[int(random.integers(len(choices)))]
