"""What pyproject.toml cannot say: a wheel carries the web player, where `npm` has built it."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

PLAYER = Path(__file__).parent / "viewer" / "dist"


class BuildWithPlayer(build_py):
    """Copies viewer/dist into the package as `player_dist`; without it `facefolds view` says how to build it."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode and (PLAYER / "index.html").is_file():
            target = Path(self.build_lib) / "facefolds_core" / "player_dist"
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(PLAYER, target, ignore=shutil.ignore_patterns("*.map"))


setup(cmdclass={"build_py": BuildWithPlayer})
