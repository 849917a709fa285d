import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, Vector3, Vector4 } from "three";
import { fitted, orbitOf, positionOf, projectionOf, viewOf } from "../src/camera.js";
import { parseManifest } from "../src/manifest.js";
import { Playback } from "../src/playback.js";
import { decode, encode } from "../src/viewstate.js";

const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-9, `${a} is not ${b}`);

test("a point lands on the pixel that K and w2c say", () => {
  const K = [[300, 4, 110], [0, 290, 70], [0, 0, 1]]; // prettier-ignore
  const w2c = [[0, 1, 0, 0.1], [0, 0, -1, 0.05], [-1, 0, 0, 1.2]]; // prettier-ignore
  const camera = { K, w2c, width: 200, height: 150 };
  const p = [0.2, -0.1, 0.15];
  const [x, y, z] = w2c.map((row) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]);
  const pixel = [(300 * x + 4 * y) / z + 110, (290 * y) / z + 70];
  const [W, H] = [800, 400];
  const fit = fitted(200, 150, W, H);
  const clip = new Vector4(...p, 1).applyMatrix4(viewOf(w2c)).applyMatrix4(projectionOf(camera, W, H, 0.1, 10));
  near(((clip.x / clip.w + 1) / 2) * W, fit.x + fit.scale * pixel[0]);
  near(((1 - clip.y / clip.w) / 2) * H, fit.y + fit.scale * pixel[1]);
  near(clip.w, z);
});

test("near and far planes go to the ends of the depth range", () => {
  const projection = projectionOf({ K: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], width: 1, height: 1 }, 1, 1, 0.5, 4); // prettier-ignore
  for (const [z, depth] of [
    [-0.5, -1],
    [-4, 1],
  ]) {
    // prettier-ignore
    const clip = new Vector4(0, 0, z, 1).applyMatrix4(projection);
    near(clip.z / clip.w, depth);
  }
});

test("a view matrix is a rotation and a shift", () => {
  const view = viewOf([[0, 1, 0, 0], [0, 0, -1, 0], [-1, 0, 0, 1]]); // prettier-ignore
  near(view.determinant(), 1);
  const eye = new Vector3().setFromMatrixPosition(new Matrix4().copy(view).invert());
  near(eye.distanceTo(new Vector3(1, 0, 0)), 0);
});

test("orbit and position are inverse to each other", () => {
  const orbit = { azimuth: 33, elevation: -12, distance: 1.7, target: [0.1, 0.2, -0.3] };
  const again = orbitOf(positionOf(orbit), new Vector3(...orbit.target));
  for (const key of ["azimuth", "elevation", "distance"]) near(again[key], orbit[key]);
});

test("a view survives its way through the address", () => {
  const view = { azimuth: 12.5, elevation: -3, distance: 0.9, target: [0, 0.01, 0] };
  const state = { frame: 7, view, level: "full", background: "#102030", hidden: [0, 3], spread: 0.25, speed: 0.5 };
  const flags = { wireframe: true, effects: false, loop: false };
  assert.deepEqual(decode(`#${encode({ ...state, ...flags })}`), { ...state, ...flags });
});

test("nonsense in the address is left out", () => {
  assert.deepEqual(decode("#view=1,2&frame=x&speed=0&background=red&level=A/B&spread=7&photo=-1"), {});
  assert.deepEqual(decode(""), {});
});

test("the clock loops, stops, waits and steps", () => {
  const clock = new Playback({ frames: 10, fps: 30 });
  clock.advance(1, true);
  assert.equal(clock.frame, 0); // at rest
  clock.playing = true;
  clock.advance(0.1, false);
  assert.equal(clock.frame, 0); // the decoder is behind
  clock.advance(0.1001, true);
  assert.equal(clock.frame, 3);
  clock.advance(0.3, true);
  assert.equal(clock.frame, 2); // round once
  clock.speed = 0.5;
  clock.advance(0.1, true);
  near(clock.position, 2.003 + 1 + 0.5);
  clock.loop = false;
  assert.equal(clock.advance(5, true), true);
  assert.equal(clock.frame, 9);
  assert.equal(clock.playing, false);
  clock.step(1);
  assert.equal(clock.frame, 9);
  clock.loop = true;
  clock.step(1);
  assert.equal(clock.frame, 0);
  clock.step(-1);
  assert.equal(clock.frame, 9);
  clock.seek(99);
  assert.equal(clock.frame, 9);
});

test("a still picture needs no clock", () => {
  const clock = new Playback({ frames: 1, fps: 1 });
  clock.playing = true;
  clock.advance(10, true);
  assert.equal(clock.frame, 0);
});

const file = { bytes: 10, sha256: "0".repeat(64) };
const manifest = () => ({
  format: "facefolds",
  version: 2,
  subject: "test",
  levels: [
    {
      name: "full",
      bytes: 20,
      layers: [{ mesh: "full_00.drc", ...file, vertices: 4, triangles: 2, texture_rect: [2, 2, 8, 6] }],
      texture: {
        ...{ width: 16, height: 32, colour_rect: [0, 0, 16, 16], alpha_rect: [0, 16, 16, 16], frames: 2, fps: 30 },
        videos: [{ file: "full.mp4", codec: "h264", mime: 'video/mp4; codecs="avc1.42"', ...file }],
      },
      view_effects: null,
    },
  ],
});

test("a manifest is read", () => {
  const read = parseManifest(JSON.stringify(manifest()), "x");
  assert.deepEqual(read.levels[0].layers[0].rect, [2, 2, 8, 6]);
  assert.equal(read.levels[0].videos[0].name, "full.mp4");
  assert.equal(read.poster, null);
  assert.deepEqual(read.photos, []);
});

test("view effects of an unknown basis are left out", () => {
  const value = manifest();
  value.levels[0].view_effects = { file: "e.png", ...file, basis: "sh9" };
  assert.equal(parseManifest(JSON.stringify(value), "x").levels[0].effects, null);
});

test("a manifest that is wrong is refused, naming the place", () => {
  const cases = [
    [(m) => (m.levels = []), /levels is empty/],
    [(m) => (m.levels[0].layers[0].texture_rect = [1, 2]), /levels\[0\]\.layers\[0\]\.texture_rect/],
    [(m) => (m.levels[0].texture.fps = 0), /texture\.fps is 0/],
    [(m) => (m.levels[0].layers[0].mesh = "../secret"), /names no plain file/],
    [(m) => (m.version = 3), /format version 3/],
    [(m) => (m.format = "gltf"), /not a facefolds asset/],
    [(m) => delete m.levels[0].texture, /texture is missing/],
  ];
  for (const [spoil, said] of cases) {
    const value = manifest();
    spoil(value);
    assert.throws(() => parseManifest(JSON.stringify(value), "x"), said);
  }
});
