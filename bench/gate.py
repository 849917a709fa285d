"""The gate: every capture that is there through the default pipeline, held against figures that are kept.

python -m bench.gate FOLDER [--only "actor; sparse"] [--accept]        (`make gate`)

It prints a table and fails, aloud, where a score, bytes, processor time or memory is worse than it was in
bench/results/gate.json by more than its tolerance. FOLDER keeps what was measured, and a strip of each asset from -90
to 90 degrees over white, black and green: look at it before you accept anything.
"""

from __future__ import annotations

import resource
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image
from pydantic import Field

from bench.results import ROOT, Entry, Means, Store, commit_name, now
from bench.run import Project, chosen, own_params
from bench.tables import markdown, number
from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.actor import make_rig
from facefolds_core.cli.render import far_enough
from facefolds_core.errors import report_user_errors
from facefolds_core.files.writing import atomic_folder, read_json
from facefolds_core.params import STAGE_SECTIONS, CaptureParams
from facefolds_core.rendering.areas import view_of
from facefolds_core.rendering.camera_paths import Eye, camera_of
from facefolds_core.spacing import spread

KEPT = ROOT / "bench" / "results" / "gate.json"
COLOURS = ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.1, 0.7, 0.2))
TWO: dict[str, Any] = {"source": "multiface", "holdout": ["400013", "400060"], "pixel_centres": 0.5}
SPARSE: dict[str, Any] = {"source": "multiface", "holdout": ["06", "13"], "front": "07", "pixel_centres": 0.5}
CLUTTER = {"clutter": 1.0, "plates": False, "frames": 12}

TOLERANCES: dict[str, tuple[int, float, int]] = {
    "psnr_any": (1, 0.15, 2),
    "psnr_over_plate": (1, 0.15, 2),
    "psnr_subject": (1, 0.25, 2),
    "psnr_found": (1, 0.15, 2),
    "psnr_interior": (1, 0.15, 2),
    "psnr_band": (1, 0.3, 2),
    "psnr_moving": (1, 0.3, 2),
    "worst_patch": (1, 1.0, 1),
    "temporal": (1, 0.02, 2),
    "ssim_high": (1, 0.005, 3),
    "opacity_inside": (-1, 0.003, 3),
    "opacity_edge": (-1, 0.005, 3),
    "opacity_outside": (-1, 0.003, 3),
    "without_reflection": (1, 0.3, 2),
    "training_worst": (1, 1.0, 2),
}
"""Score -> 1 where more is better and -1 where less is, by how much it may be worse, digits. The seeds 0 and 1 of the
actor differ by 0.05 dB over any background, 0.09 of the subject, 0.10 in the band and of what moves, 0.14 in the worst
patch, 0.22 in the worst training view."""
SHARES = {"bytes": 1.2, "cpu_seconds": 1.3, "peak_bytes": 1.2}
"""Cost -> how many times as much as before it may be; bytes of these seeds differ by 9 %."""


def strip(
    asset: Asset,
    azimuths: Sequence[float],
    colours: Sequence[tuple[float, float, float]],
    size: tuple[int, int],
    field_of_view: float,
) -> NDArray[np.uint8]:
    """(rows, columns, 3): a row a colour, a column an azimuth, of the first frame; the whole asset is in each picture.

    Args:
        azimuths: degrees from the front.
        colours: RGB in [0, 1].
        size: width and height of a picture, pixels.
        field_of_view: degrees, of its shorter side.
    """
    eyes = [Eye(azimuth) for azimuth in azimuths]
    away = far_enough(asset, eyes, *size, field_of_view)
    cameras = [camera_of(Eye(eye.azimuth, distance=away), *size, field_of_view) for eye in eyes]
    textures = asset.frame(0)
    seen = [view_of(asset.full, camera).composite(textures) for camera in cameras]
    rows = [np.hstack([rgb + (1 - alpha[..., None]) * np.array(colour) for rgb, alpha in seen]) for colour in colours]
    return np.asarray(np.rint(255 * np.vstack(rows).clip(0, 1)), np.uint8)


def aside(count: int) -> list[str]:
    """Names of the actor's cameras but the held-out ones and `count` others, spread by azimuth."""
    rig = [camera for camera in make_rig(CaptureParams()).cameras if camera.name not in ("A011", "A023")]
    rig.sort(key=lambda camera: float(np.arctan2(camera.centre[0], 1000 - camera.centre[2])))
    kept = spread(range(len(rig)), count)
    return [camera.name for k, camera in enumerate(rig) if k not in kept]


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "actor": ("", {}),
    "mugsy": ("mugsy", TWO),
    "sparse": ("sparse", SPARSE),
    "studio": ("studio", TWO),
    "studio, no plates": ("studio", TWO),
    "moving": ("moving", TWO),
    "buddha": ("buddha", {"source": "transforms", "front": "00036", "holdout": ["00022", "00031"]}),
    "fox": ("fox", {"source": "transforms", "front": "0019", "holdout": {"every": 7}}),
    **{f"actor, {count} cameras": ("", {"validate": aside(count), "capture": {"frames": 12}}) for count in (12, 8)},
    "plain room": ("", {"capture": {"plates": False, "frames": 12}}),
    "clutter": ("", {"capture": CLUTTER}),
    **{f"actor, seed {seed}": ("", {"train": {"seed": seed}}) for seed in (1, 2)},
}
"""Name -> folder in shared/captures ("" is the actor of params.yaml), the subject's keys."""


class Found(Entry):
    """What a case has: scores of its asset on held-out cameras, and what it took."""

    KEY: ClassVar[tuple[str, ...]] = ("case",)
    case: str
    scores: Means = Field(default_factory=dict)
    bytes: int = 0
    cpu_seconds: float = 0.0
    peak_bytes: int = 0
    commit: str = ""


def params_of(case: str, captures: Path) -> dict[str, Any]:
    """params.yaml of a case, whose subject is called actor."""
    capture, keys = CASES[case]
    if not capture:
        return own_params("actor", keys)
    subject = {**keys, "path": str((captures / capture).resolve())}
    return {**own_params("actor", {}), "subjects": {"actor": subject}}


def there(captures: Path) -> list[str]:
    """The cases whose captures are there."""
    return [name for name, (capture, _) in CASES.items() if not capture or (captures / capture).is_dir()]


def scores_of(metrics: Mapping[str, Any]) -> Means:
    """Of the asset, in a metrics.json."""
    found = {name: metrics["asset"].get(name) for name in TOLERANCES}
    training = metrics.get("training_views") or {}
    plain = (metrics.get("asset_diffuse") or {}).get(metrics["headline"])
    return found | {"without_reflection": plain, "training_worst": (training.get("worst") or {}).get("psnr")}


def strip_of(folder: Path, case: str) -> Path:
    return folder / f"{case.replace(', ', '_').replace(' ', '-')}.jpg"


def run(case: str, folder: Path, captures: Path) -> Found:
    """Run the stages, draw the strip, keep the figures; in a process of its own, whose children alone are measured."""
    project, params = Project(strip_of(folder, case).with_suffix(""), "actor"), params_of(case, captures)
    if CASES[case][0]:
        own, linked = params["subjects"]["actor"], folder / f"{project.root.name}_capture"
        with atomic_folder(linked) as place:
            for path in Path(own["path"]).iterdir():
                if path.name != "plates" or "no plates" not in case:
                    (place / path.name).symlink_to(path)
        own["path"] = str(linked.resolve())
    project.write(params)
    project.run("configure", *STAGE_SECTIONS)
    used, metrics = resource.getrusage(resource.RUSAGE_CHILDREN), read_json(project.folders.metrics)
    asset = read_asset(project.folders.asset)
    Image.fromarray(strip(asset, range(-90, 91, 20), COLOURS, (130, 165), 20.0)).save(strip_of(folder, case))
    return Found(
        case=case,
        scores=scores_of(metrics),
        bytes=sum(metrics["cost"][part] for part in ("mesh_bytes", "texture_bytes", "reflection_bytes")),
        cpu_seconds=round(used.ru_utime + used.ru_stime, 1),
        peak_bytes=1024 * used.ru_maxrss,
        commit=commit_name(),
        date=now(),
    )


def apart(case: str, folder: Path, captures: Path) -> Found:
    """`run` in a new process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(run, case, folder, captures).result()


def stale(store: Store[Found], names: Sequence[str]) -> list[str]:
    """The cases that were not measured with the code as it is."""
    commit = commit_name()
    same = {one.case for one in store.read() if one.commit == commit and not commit.endswith("+")}
    return [name for name in names if name not in same]


def falls(kept: Found, found: Found) -> Iterator[str]:
    """What is worse than it was by more than its tolerance, in words."""
    for name, (sign, most, digits) in TOLERANCES.items():
        before, here = kept.scores.get(name), found.scores.get(name)
        if before is None:
            continue
        if here is None:
            yield f"{name}: {before:.{digits}f} to nothing"
        elif sign * (before - here) > most:
            yield f"{name}: {before:.{digits}f} to {here:.{digits}f}, tolerance {most:g}"
    for name, share in SHARES.items():
        before, here = getattr(kept, name), getattr(found, name)
        if before and here > share * before:
            yield f"{name}: {before:.3g} to {here:.3g}, tolerance {share - 1:.0%}"


def table(found: Mapping[str, Found]) -> str:
    """A row a case; what nothing has is left out."""
    names = [name for name in TOLERANCES if any(one.scores.get(name) is not None for one in found.values())]
    rows = [
        [
            case,
            *(number(one.scores.get(name), TOLERANCES[name][2]) for name in names),
            f"{one.bytes / 1000:.0f}",
            f"{one.cpu_seconds:.0f}",
            f"{one.peak_bytes / 1e9:.1f}",
            one.commit[:7],
        ]
        for case, one in found.items()
    ]
    return markdown(["", *(name.replace("_", " ") for name in names), "KB", "processor s", "GB", "commit"], rows)


@report_user_errors("gate")
def main(
    folder: Annotated[Path, typer.Argument(help="Where captures are filmed and trained; some GB.")],
    only: Annotated[str, typer.Option(help="Some cases, separated by semicolons; by default all.")] = "",
    captures: Annotated[Path, typer.Option(help="Folder of mugsy, sparse, ...")] = ROOT / "../shared/captures",
    accept: Annotated[bool, typer.Option("--accept", help="Keep the figures, whatever they are.")] = False,
) -> None:
    """Measure what FOLDER/gate.json does not have of this commit, and hold it against what is kept."""
    names = chosen(only, tuple(CASES), "--only") if only else there(captures)
    for case in CASES.keys() - {*there(captures)}:
        typer.echo(f"skipped: {case}: no {CASES[case][0]} in {captures}")
    store = Store(folder / "gate.json", "gate", Found)
    for case in stale(store, names):
        store.add(apart(case, folder, captures))
        typer.echo(f"{case}: measured")
    measured = {one.case: one for one in store.read() if one.case in names}
    typer.echo(f"\n{table(measured)}\n")
    keeping = Store(KEPT, "gate", Found)
    kept = {one.case: one for one in keeping.read()}
    worse = {case: list(falls(kept[case], one)) for case, one in measured.items() if case in kept}
    for case, lines in worse.items():
        for line in lines:
            typer.echo(f"WORSE  {case}: {line}")
    for case in measured.keys() - kept.keys():
        typer.echo(f"new: {case}: nothing is kept to hold it against")
    if accept:
        for one in measured.values():
            keeping.add(one)
        typer.echo(f"kept in {KEPT}")
    elif any(worse.values()):
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
