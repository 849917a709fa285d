"""The hero: the embedded actor's whole take at full size, through the whole pipeline, and its asset packed for others.

    make hero                                              or python -m docs.tools.hero; hours on two cores
    python -m docs.tools.hero --frames 12 --seconds 1.5         a shorter one: minutes

In dist/hero: run/ (a project of its own, so that an interrupted run goes on), asset/, hero.html (the finest level of at
most 6 MB; plays by a double click; `make docs` shows it on the first page), frames.jpg (eyes and mouth of 25 frames, a
photo above the asset), hero.zip (asset and page, with the scores and the licence).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from bench.results import ROOT, commit_name
from bench.run import own_params
from docs.tools.pictures import FRAMES, every_frame
from docs.tools.site import HERO_COMMIT, HERO_FRAMES
from facefolds_core.asset import read_asset
from facefolds_core.asset.single_page import write_single_page
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_file, atomic_folder, read_json, write_text
from facefolds_core.params import merged
from facefolds_core.reporting.face import embedded
from facefolds_core.scoring.terminal import HEADLINE_WORDS
from facefolds_core.serving.player import find_player
from facefolds_core.system.processes import own_environment

NAME = "hero"
PARAMS = Path(__file__).with_name("hero.yaml")
SHEET = {**FRAMES, "panel": [240, 275], "columns": 5, "most": 25}
"""Every fourth frame of the whole take."""


def hero_params(capture: dict[str, Any]) -> dict[str, Any]:
    """params.yaml of the hero alone: the actor's, with what hero.yaml says, and `capture` over it."""
    changes: dict[str, Any] = yaml.safe_load(PARAMS.read_text(encoding="utf-8"))
    params = own_params("actor", merged(changes, {"capture": capture}))
    return {**params, "subjects": {NAME: params["subjects"]["actor"]}}


def write_project(folder: Path, params: dict[str, Any]) -> None:
    """A folder in which `dvc repro` works with this checkout's code; what an earlier run made there stays."""
    (folder / ".dvc").mkdir(parents=True, exist_ok=True)
    for name in ("stages", "facefolds_core"):
        if not (folder / name).is_symlink():
            (folder / name).symlink_to(ROOT / name, target_is_directory=True)
    for name in ("dvc.yaml", ".dvcignore"):
        shutil.copy(ROOT / name, folder)
    write_text(
        folder / ".dvc" / "config",
        "[core]\n    analytics = false\n    no_scm = true\n[cache]\n    type = hardlink,copy\n",
    )
    write_text(folder / "params.yaml", yaml.safe_dump(params, sort_keys=False))


def run_pipeline(folder: Path) -> None:
    """All stages of the hero; what is done already is not done again.

    Raises:
        UserError: if a stage failed; it has said why.
    """
    command = [sys.executable, "-m", "dvc", "repro", f"evaluate@{NAME}"]
    if subprocess.run(command, cwd=folder, env=own_environment(), check=False).returncode:
        raise UserError("the hero was not made", file=folder, remedy="see above, then the same command again")


def words_of(metrics: dict[str, Any]) -> str:
    """What the zip says of itself."""
    key = metrics["headline"]
    return (
        f"The embedded actor of facefolds {commit_name()}: {metrics['asset'][key]:.2f} dB {HEADLINE_WORDS[key]}.\n"
        "hero.html plays by a double click; asset/ is for players, engines and your own pages (docs/guide/viewer.md).\n"
        "Nobody was filmed: she is a procedure. Licence: Apache-2.0.\n"
    )


def release(folders: SubjectFolders, out: Path) -> list[Path]:
    """asset/, hero.html and hero.zip in `out`, each whole or not at all.

    Raises:
        UserError: if there is no player, or the asset is not sound.
    """
    asset = read_asset(folders.asset)
    out.mkdir(parents=True, exist_ok=True)
    page, packed = out / "hero.html", out / "hero.zip"
    write_text(out / Path(HERO_COMMIT).name, commit_name())
    level = embedded(asset) or asset.manifest.levels[0]
    write_single_page(page, folders.asset, asset.manifest, level, find_player())
    with atomic_folder(out / "asset") as temporary:
        shutil.copytree(folders.asset, temporary, dirs_exist_ok=True)
    with atomic_file(packed) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as zipped:
        zipped.writestr("README.txt", words_of(read_json(folders.metrics)))
        for path in [page, ROOT / "LICENSE", folders.metrics]:
            zipped.write(path, path.name)
        for path in sorted((out / "asset").rglob("*")):
            zipped.write(path, path.relative_to(out))
    return [page, packed]


def main(
    frames: Annotated[int | None, typer.Option(help="Instead of the whole take's 100.", min=1)] = None,
    seconds: Annotated[float | None, typer.Option(help="Of the take; instead of 4.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for the run and for what is released.")] = ROOT / "dist" / NAME,
) -> None:
    """Film, train, export and score the hero; pack its asset."""
    with report_user_errors(NAME):
        find_player()
        shorter = {"frames": frames, "seconds": seconds}
        write_project(out / "run", hero_params({key: value for key, value in shorter.items() if value is not None}))
        run_pipeline(out / "run")
        every_frame(out / "run" / "data" / NAME, out / Path(HERO_FRAMES).name, SHEET)
        for path in release(SubjectFolders(out / "run" / "data" / NAME), out):
            typer.echo(f"{NAME}: {path} ({path.stat().st_size / 1e6:.1f} MB)")


if __name__ == "__main__":
    typer.run(main)
