"""The player as an npm package: what is in it, and that its types name what there is."""

from __future__ import annotations

import json
import re
import subprocess
import tarfile
from pathlib import Path

import facefolds_core as facefolds
from tests.viewer.conftest import Show


def test_the_package_holds_the_player_and_its_types(project_root: Path, player_folder: Path, tmp_path: Path) -> None:
    viewer = project_root / "viewer"
    # Without its scripts: it would build again, under the feet of tests that are being served from it.
    command = ["npm", "pack", "--silent", "--ignore-scripts", "--pack-destination", str(tmp_path)]
    subprocess.run(command, cwd=viewer, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tgz")
    with tarfile.open(archive) as tar:
        names = {name.removeprefix("package/") for name in tar.getnames()}
    package = json.loads((viewer / "package.json").read_text())
    assert package["private"] is True  # never published by mistake
    entry = package["exports"]["."]
    assert {entry["default"][2:], entry["types"][2:], "dist/draco/worker.js", "README.md", "LICENSE"} <= names
    assert package["version"] == facefolds.__version__
    assert {f"dist/{path.name}" for path in player_folder.glob("*-*.js")} <= names
    assert not any(name.endswith((".map", ".ts")) and name != "types.d.ts" for name in names)


def test_the_types_name_what_the_element_has(show: Show, project_root: Path) -> None:
    text = (project_root / "viewer" / "types.d.ts").read_text()
    body = text[text.index("class FacefoldsPlayer") : text.index("declare global")]
    members = set(re.findall(r"^  (?:readonly )?(\w+)[(:<?]", body, re.M)) - {"addEventListener"}
    assert len(members) > 25
    player = show()
    assert player.run("return v.filter((name) => !(name in e))", sorted(members)) == []
