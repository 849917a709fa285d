"""WebXR, with `iwer` in place of a device: a picture an eye, each from its own place; in the room, nothing behind."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.viewer.conftest import Show

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
    e.player.renderer.render = (projection, view, rect, ...rest) => { draw(projection, view, rect, ...rest);
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


def test_each_eye_has_its_picture_with_the_right_disparity(show: Show, headset: str) -> None:
    player = show(script=headset, viewport={"width": 800, "height": 400})
    player.wait("e.level === 'full' && !e.shadowRoot.querySelector('[data-do=\"vr\"]').hidden")
    (left, right), immersed = player.run(LOOK)
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


ROOM = """
    const { gl } = e.player.renderer.graphics;
    const next = () => new Promise((done) => e.player.addEventListener('immersed', done, { once: true }));
    const draw = e.player.renderer.render.bind(e.player.renderer);
    let seen; // of the left eye: RGBA of the corner, and how much of the inner and outer half is covered
    e.player.renderer.render = (projection, view, rect, ...rest) => { draw(projection, view, rect, ...rest);
      const [x, y, w, h] = rect; const data = new Uint8Array(4 * w * h);
      if (x > 0) return;
      gl.readPixels(x, y, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data);
      let [inner, outer] = [0, 0];
      for (let i = 0; i < w * h; ++i) if (data[4 * i + 3] > 200)
        if (Math.abs(((i % w) + 0.5) / w - 0.5) < 0.25) inner += 1; else outer += 1;
      seen = { corner: [...data.subarray(0, 4)], inner: inner / (w * h), outer: outer / (w * h) }; };
    const look = async () => { await next(); await next(); return seen; };
    e.background = '#00ff00';
    const offered = e.canActivateAR;
    await e.activateAR();
    const before = await look();
    headset.quaternion.set(0, Math.SQRT1_2, 0, Math.SQRT1_2);
    const aside = await look();
    const { right } = headset.controllers;
    right.updateButtonValue('trigger', 1); await next(); await next(); right.updateButtonValue('trigger', 0);
    const moved = await look();
    await e.activateAR();
    return { offered, before, aside, moved, immersed: e.player.immersed };"""


def test_in_the_room_the_head_stands_where_one_looks_with_nothing_behind_it(show: Show, headset: str) -> None:
    player = show(script=headset, viewport={"width": 800, "height": 400})
    player.wait("e.level === 'full' && e.canActivateAR")
    seen: dict = player.run(ROOM)
    assert seen["offered"] is True and seen["immersed"] is False
    assert seen["before"]["corner"] == [0, 0, 0, 0]
    assert seen["before"]["inner"] > 0.01
    assert seen["aside"]["inner"] + seen["aside"]["outer"] == 0  # it stays in the room when the viewer turns away
    assert seen["moved"]["inner"] == pytest.approx(seen["before"]["inner"], rel=0.05)


def test_without_a_headset_nothing_is_offered(show: Show) -> None:
    player = show()
    assert player.run("return e.canActivateAR") is False
    assert not player.page.get_by_role("button", name="Place it in your room").is_visible()
