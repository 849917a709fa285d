"""The project as jobs see it: a copy of what the pipeline reads, taken when the run starts, and DVC's settings."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from configobj import ConfigObj
from distributed import WorkerPlugin
from dvc.config import Config

from facefolds_core.cluster.lockfile import LOCK
from facefolds_core.errors import UserError
from facefolds_core.files.reading import is_regular

CODE = ("facefolds_core", "stages")
FILES = ("dvc.yaml", "params.yaml", ".dvcignore", ".dvc/config", ".dvc/config.local")
LEFT_OUT = (".pyc", ".pyo")
SETTLED = 1.0
"""Seconds after which a folder that is still empty stays so: DVC makes it and writes its file at once."""


@dataclass
class Project(WorkerPlugin):
    """Handed to every worker of a run, to those that come later, too; each unpacks the code once.

    numba's compiled kernels, which lie beside the code, travel along: they are compiled once, not in each job.

    Attributes:
        name: of the run.
        files: path relative to the project -> time of its last change (ns, part of numba's key) and content.
        cache: DVC's cache folder.
        mark: name of a file in it; who sees that shares the cache.
        remotes: of DVC's settings, with whole addresses.
        remote: DVC's default remote, through which results travel: where the cache is not shared, or `always`.
    """

    name: str
    files: Mapping[str, tuple[int, bytes]]
    cache: Path
    mark: str
    remotes: Mapping[str, Mapping[str, str]]
    remote: str | None
    always: bool
    scratch: Path | None = field(default=None, compare=False)

    def setup(self, worker: Any) -> None:
        self.scratch = Path(worker.local_directory)
        for name, (changed, content) in self.files.items():
            path = self.code / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            os.utime(path, ns=(changed, changed))

    @property
    def code(self) -> Path:
        assert self.scratch is not None
        return self.scratch / f"code-{self.name}"

    def unfold(self, place: Path, links: Mapping[str, str], params: str | None, lock: str) -> tuple[Path, bool]:
        """Make a project's folder for one job.

        Args:
            place: an empty folder.
            links: see `Job`.
            params: the text of params.yaml; None for the project's.
            lock: that of dvc.lock.

        Returns:
            its path, and whether results travel through a remote.

        Raises:
            UserError: if this worker sees neither the cache nor a remote.
        """
        shared = not self.always and (self.cache / self.mark).is_file()
        if not shared and self.remote is None:
            raise UserError(
                "a worker that has no way to hand over results",
                file=self.cache,
                expected="the project's DVC cache on a disk that all machines share, or a DVC remote",
                found="neither",
                remedy="`dvc cache dir` on a shared disk, or `dvc remote add -d` (docs/guide/clusters.md)",
            )
        # As deep as relative paths of captures lead up, so that they stay in `place`.
        ups = max((Path(os.path.normpath(name)).parts.count("..") for name in links), default=0)
        root = place.joinpath(*["up"] * ups, "project")
        (root / ".dvc").mkdir(parents=True)
        for name in CODE:
            (root / name).symlink_to(self.code / name)
        for name in FILES:
            if name in self.files:
                (root / name).write_bytes(self.files[name][1])
        if params is not None:
            (root / "params.yaml").write_text(params, encoding="utf-8")
        if lock:
            (root / LOCK).write_text(lock, encoding="utf-8")
        for name, target in links.items():
            path = Path(os.path.normpath(root / name))
            path.parent.mkdir(parents=True, exist_ok=True)
            path.symlink_to(target)
        cache = self.cache if shared else self.code.with_name("cache")
        drop_empty_runs(cache)
        self._settle(root, place, cache)
        return root, not shared

    def _settle(self, root: Path, place: Path, cache: Path) -> None:
        """DVC's settings for one job: no git, its own bookkeeping, and whole paths where the project's are relative."""
        path = root / ".dvc" / "config.local"
        settings = ConfigObj(str(path), encoding="utf-8", list_values=False)
        settings.setdefault("core", {}).update({"no_scm": "true", "site_cache_dir": str(place / "site")})
        settings.setdefault("cache", {})["dir"] = str(cache)
        for name, values in self.remotes.items():
            settings.setdefault(f'remote "{name}"', {}).update(values)
        settings.write()


def snapshot(root: Path, run: str, always: bool) -> Project:
    """The project as it is now, what is not committed included; git is not needed.

    Args:
        run: a name for it.
        always: results travel through DVC's default remote even where the cache is shared.

    Raises:
        UserError: if it is not a DVC project, or has no such remote.
    """
    if not (root / ".dvc").is_dir():
        raise UserError("not a DVC project", file=root, remedy="run the command in the project's root folder")
    config = Config(str(root / ".dvc"))
    remotes = {name: {"url": str(values["url"])} for name, values in config["remote"].items()}
    remote = config["core"].get("remote")
    if always and remote is None:
        raise UserError("no default DVC remote", file=root, remedy="`dvc remote add -d NAME URL` adds one")
    paths = [root / name for name in FILES]
    for folder in CODE:
        paths += [path for path in sorted((root / folder).rglob("*")) if path.suffix not in LEFT_OUT]
    files = {
        str(path.relative_to(root)): (path.stat().st_mtime_ns, path.read_bytes()) for path in paths if is_regular(path)
    }
    return Project(
        name=run,
        files=files,
        cache=Path(config["cache"].get("dir") or root / ".dvc" / "cache").resolve(),
        mark=f".{run}",
        remotes=remotes,
        remote=remote,
        always=always,
    )


def drop_empty_runs(cache: Path) -> None:
    """Remove empty folders of the run cache, over which every later DVC stumbles: "join() argument must be str".

    A DVC that is killed between making the folder of an entry and writing it leaves one (dvc/stage/cache.py, 3.x:
    `_load` takes the newest file of a folder, and there is none).

    Args:
        cache: DVC's cache folder, which need not exist.
    """
    for folder in (cache / "runs").glob("??/*"):
        with suppress(OSError):  # it holds entries, as all others do, or is gone
            if time.time() - folder.stat().st_mtime > SETTLED:
                folder.rmdir()
