"""The guide's component for React: it compiles against the package's types, and plays."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

from tests.viewer.conftest import NewPlayer, page_of_yours

PAGE = """
import { createElement, createRef } from "react";
import { createRoot } from "react-dom/client";
import { Face } from "./face";

const player = createRef();
const onFrame = () => (window.drawn = (window.drawn ?? 0) + 1);
const root = createRoot(document.getElementById("root"));
const show = (frame) => root.render(createElement(Face, { ref: player, src: "asset/", state: { frame }, onFrame }));
Object.assign(window, { show, player });
show(2);
"""


def test_the_guides_component_compiles_and_plays(
    new_player: NewPlayer, rich: Path, player_folder: Path, project_root: Path, tmp_path: Path
) -> None:
    guide = (project_root / "docs" / "guide" / "viewer.md").read_text()
    (component,) = re.findall(r"```tsx\n(.*?)```", guide, flags=re.DOTALL)
    (tmp_path / "face.tsx").write_text(component)
    (tmp_path / "page.jsx").write_text(PAGE)
    viewer = project_root / "viewer"
    options = {
        "strict": True, "noEmit": True, "target": "es2022", "module": "esnext", "moduleResolution": "bundler",
        "lib": ["es2022", "dom"], "types": [],
        "paths": {
            "facefolds-player": [str(viewer / "types.d.ts")],
            "react": [str(viewer / "node_modules" / "@types" / "react")],
        },
    }  # fmt: skip
    (tmp_path / "tsconfig.json").write_text(json.dumps({"compilerOptions": options, "files": ["face.tsx"]}))
    binaries = viewer / "node_modules" / ".bin"
    done = subprocess.run([binaries / "tsc", "-p", tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    command = [str(binaries / "esbuild"), str(tmp_path / "page.jsx"), "--bundle", "--format=esm"]
    command += [f"--outfile={tmp_path / 'page.js'}", "--log-level=error"]
    environment = {**os.environ, "NODE_PATH": str(viewer / "node_modules")}
    subprocess.run(command, check=True, env=environment)
    player = new_player({"asset": rich}, viewport={"width": 400, "height": 300})
    page = player.page
    page.route("**/page.js", lambda route: route.fulfill(path=tmp_path / "page.js", content_type="text/javascript"))
    page.route("**/player/**", lambda route: route.continue_(url=route.request.url.replace("/player/", "/")))
    page_of_yours(player, '<div id="root"></div>', "page.js")
    player.wait("e?.ready && e.frame === 2")
    page.evaluate("show(4)")
    player.wait("e.frame === 4")
    assert page.evaluate("window.drawn > 0 && player.current.frames === 6")
