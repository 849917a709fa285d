"""WebXR, with `iwer` in place of a headset: a picture an eye, each from its own place."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.viewer.conftest import NewPlayer

EMULATOR = """import { XRDevice, metaQuest3 } from "iwer";
window.headset = new XRDevice(metaQuest3);
headset.installRuntime({ forceInstall: true });
headset.stereoEnabled = true;
headset.ipd = 0.064;
"""
LOOK = """
    const half = (rect) => { const [x, y, w, h] = rect; const data = new Uint8Array(4 * w * h);
      gl.readPixels(x, y, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data); return { rect, sum: weigh(data, w, h) }; };
    const weigh = (data, w, h) => { let [n, sx, sy] = [0, 0, 0];
      for (let i = 0; i < w * h; ++i) {
        const far = Math.abs(data[4 * i]) + Math.abs(data[4 * i + 1] - 255) + Math.abs(data[4 * i + 2]);
        if (far > 60) { n += 1; sx += (i % w) / w; sy += Math.floor(i / w) / h; } }
      return [n, sx / n, sy / n]; };
    const { gl } = e.player.renderer.graphics;
    const seen = []; const draw = e.player.renderer.render.bind(e.player.renderer);
    e.player.renderer.render = (projection, view, rect, target) => { draw(projection, view, rect, target);
      if (e.player.immersed) seen.push({ ...half(rect), focal: projection[0], shift: projection[8], x: view[12] }); };
    e.background = '#00ff00';
    e.shadowRoot.querySelector('[data-do="vr"]').click();
    await new Promise((done) => e.player.addEventListener('immersed', done, { once: true }));
    const first = seen.slice(-2);
    const frame = e.frame; e.play();
    await new Promise((done) => { const wait = () => e.frame !== frame ? done() : setTimeout(wait, 20); wait(); });
    await e.player.immersion.end();
    return [first, e.player.immersed];"""


@pytest.fixture(scope="module")
def headset(tmp_path_factory: pytest.TempPathFactory, project_root: Path, player_folder: Path) -> str:
    modules = project_root / "viewer" / "node_modules"
    folder = tmp_path_factory.mktemp("headset")
    (folder / "in.js").write_text(EMULATOR)
    command = [str(modules / ".bin" / "esbuild"), str(folder / "in.js"), "--bundle", f"--outfile={folder / 'out.js'}"]
    subprocess.run([*command, "--log-level=error"], check=True, env={**os.environ, "NODE_PATH": str(modules)})
    return (folder / "out.js").read_text()


def test_each_eye_has_its_picture_with_the_right_disparity(new_player: NewPlayer, rich: Path, headset: str) -> None:
    player = new_player({"asset": rich}, script=headset, viewport={"width": 800, "height": 400})
    player.open("asset")
    player.wait("e.level === 'full' && !e.shadowRoot.querySelector('[data-do=\"vr\"]').hidden")
    (left, right), immersed = player.run(LOOK)  # type: ignore[misc]
    assert immersed is False
    assert left["rect"] != right["rect"]
    assert right["x"] - left["x"] == pytest.approx(-0.064, abs=1e-3)  # the right eye sees the head further left
    assert min(left["sum"][0], right["sum"][0]) > 100

    def place(eye: dict) -> float:
        """Where the head's middle is seen: tangent of the angle to the right."""
        clip = 2 * eye["sum"][1] - 1
        return float((clip + eye["shift"]) / eye["focal"])

    distance = 0.064 / (place(left) - place(right))
    assert np.isclose(distance, 0.9, atol=0.25)  # the head's middle; its front is nearer
