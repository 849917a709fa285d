"""Damaged captures through the real reading and normalising: no traceback, no hang, nothing wrong taken for good."""

from __future__ import annotations

import io
import shutil
from contextlib import redirect_stderr
from pathlib import Path

import numpy as np

from facefolds_core.captures.assembly import write_plan
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.captures.visibility import in_picture
from facefolds_core.params import NormalizeParams
from tests.captures.fixtures import SEGMENT, plan_of, save_wav, write_multiface, write_transforms
from tests.hostile.damage import Counts, attempt, fingerprint
from tests.hostile.structured import damage_bytes, damage_json, damage_lines, damage_path

SECONDS = 10
"""Of one run; a sound one takes a tenth of a second."""
PARAMS = NormalizeParams()
Images = dict[tuple[str, str], np.ndarray]


def normalise(source: str, root: Path) -> Scene:
    """What the stage does, without its command: into `scene` beside the capture."""
    plan = plan_of(root, PARAMS, source)
    write_plan(plan, PARAMS)
    return read_scene(plan.scene.folder)


def images_of(scene: Scene) -> Images:
    """(camera, frame) by their names -> the picture in the scene."""
    store = scene.open_frames()
    return {(scene.cameras[c].name, scene.frame_ids[f]): store.image(c, f).copy() for c, f in store}


def make(source: str, root: Path) -> None:
    if source == "transforms":
        write_transforms(root)
        return
    made = write_multiface(root)
    for camera in ("400002", "400003"):
        mask = root / "masks" / SEGMENT / camera / "000003.png"
        mask.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(made.image(camera, "000003"), mask)
    save_wav(root / "audio" / f"{SEGMENT}.wav", np.arange(4000), 8000)


def damage(root: Path, random: np.random.Generator) -> str:
    """Damage one file of a capture; says which and how."""
    files = sorted(path for path in root.rglob("*") if path.is_file())
    kinds = sorted({path.suffix or path.name for path in files})
    kind = str(random.choice(kinds))
    those = [file for file in files if (file.suffix or file.name) == kind]
    path = those[int(random.integers(len(those)))]
    name = path.relative_to(root).as_posix()
    ways = [damage_bytes, damage_path]
    ways += [damage_lines] * 4 if path.suffix in ("", ".txt", ".obj") else []
    ways += [damage_json] * 6 if path.suffix == ".json" else []
    return f"{name}: {ways[int(random.integers(len(ways)))](path, random)}"


def wrong(scene: Scene, sound: Images, pictures: bool) -> str:
    """What is wrong with an accepted scene: pixels changed, or a camera that sees nothing of the subject.

    Args:
        pictures: whether a picture was damaged; other values of a lens may change pixels rightly.
    """
    for key, image in images_of(scene).items():
        if pictures and key in sound and not np.array_equal(image, sound[key]):
            return f"pixels of {key} changed"
    surface = scene.load_surface()
    points = np.zeros((1, 3)) if surface is None else surface[0].reshape(-1, 3).astype(float)
    around = points + 0.25 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[:, None] * (surface is None)
    for camera in scene.cameras:
        if not in_picture(camera, around.reshape(-1, 3)).any():
            return f"camera {camera.name} does not see the subject"
    return ""


def remove(path: Path) -> None:
    """A folder, or what damage put in its place."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def try_one(counts: Counts, what: str, source: str, root: Path, out: Path, sound: Images) -> None:
    """Normalise one damaged capture, and count what became of it."""
    with redirect_stderr(io.StringIO()):  # bars of progress
        result, scenes = attempt(counts, what, SECONDS, lambda: normalise(source, root))
    if scenes and (words := wrong(scenes[0], sound, ".png" in what)):
        counts.kept_wrong.append(f"{what}: {words}")
    if result.kind == "refused" and out.exists():
        counts.harmed.append(f"{what}: left a scene behind")


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` damaged captures, one damage each, in both layouts by turns."""
    counts, sound = Counts(), {}
    for source in ("multiface", "transforms"):
        make(source, folder / source)
        sound[source] = images_of(normalise(source, folder / source))
    for i in range(count):
        random = np.random.default_rng([seed, i])
        source = ("multiface", "transforms")[i % 2]
        root = folder / "damaged"
        remove(root)
        shutil.copytree(folder / source, root)
        what = f"captures, seed {seed}, case {i}, {source}, {damage(root, random)}"
        before = fingerprint(root)
        shutil.rmtree(folder / "scene", ignore_errors=True)
        try_one(counts, what, source, root, folder / "scene", sound[source])
        if fingerprint(root) != before:
            counts.harmed.append(what)
    return counts
