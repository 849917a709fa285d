import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, Vector3, Vector4 } from "three";
import { fitted, orbitView, positionOf, projectionOf, viewOf } from "../src/camera.js";
import { eyeOf, transformed } from "../src/matrices.js";
import { fieldOfView, orbitOf } from "../src/attributes.js";
import { placesInRow } from "../src/apart.js";
import { Adaptation } from "../src/adapt.js";
import { bounded, hemsFrom, resisted, strength, unwound } from "../src/limits.js";
import { parseManifest } from "../src/manifest.js";
import { Pace } from "../src/pace.js";
import { Playback } from "../src/playback.js";
import { droppedAsset } from "../src/ui/drop.js";
import { matrixOf, readPoses } from "../src/track.js";
import { decode, encode } from "../src/viewstate.js";

/** three's own arithmetic, to hold ours against. */
const matrix = (numbers) => new Matrix4().fromArray(numbers);
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
  const clip = new Vector4(...p, 1)
    .applyMatrix4(matrix(viewOf(w2c)))
    .applyMatrix4(matrix(projectionOf(camera, W, H, 0.1, 10)));
  near(((clip.x / clip.w + 1) / 2) * W, fit.x + fit.scale * pixel[0]);
  near(((1 - clip.y / clip.w) / 2) * H, fit.y + fit.scale * pixel[1]);
  near(clip.w, z);
});

test("scraps stay with the layer before them when layers are pulled apart", () => {
  assert.deepEqual(placesInRow([10, 9, 8, 3, 2]), [0, 1, 2, 2, 2]);
  assert.deepEqual(placesInRow([3, 10]), [0, 1]);
});

test("near and far planes go to the ends of the depth range", () => {
  const projection = projectionOf({ K: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], width: 1, height: 1 }, 1, 1, 0.5, 4); // prettier-ignore
  for (const [z, depth] of [
    [-0.5, -1],
    [-4, 1],
  ]) {
    // prettier-ignore
    const clip = new Vector4(0, 0, z, 1).applyMatrix4(matrix(projection));
    near(clip.z / clip.w, depth);
  }
});

test("a view matrix is a rotation and a shift", () => {
  const view = viewOf([[0, 1, 0, 0], [0, 0, -1, 0], [-1, 0, 0, 1]]); // prettier-ignore
  near(matrix(view).determinant(), 1);
  const eye = new Vector3().setFromMatrixPosition(matrix(view).invert());
  near(eye.distanceTo(new Vector3(1, 0, 0)), 0);
  near(eye.distanceTo(new Vector3(...eyeOf(view))), 0);
});

test("an orbit's view looks at its target, upright", () => {
  const orbit = { azimuth: 33, elevation: -12, distance: 1.7, target: [0.1, 0.2, -0.3] };
  const [position, target] = [new Vector3(...positionOf(orbit)), new Vector3(...orbit.target)];
  const expected = new Matrix4()
    .lookAt(position, target, new Vector3(0, 0, 1))
    .setPosition(position)
    .invert();
  expected.elements.forEach((value, i) => near(value, orbitView(orbit)[i]));
  near(position.distanceTo(target), 1.7);
  near((Math.atan2(position.y - 0.2, position.x - 0.1) * 180) / Math.PI, 33);
});

test("a view survives its way through the address", () => {
  const view = { azimuth: 12.5, elevation: -3, distance: 0.9, target: [0, 0.01, 0] };
  const state = { frame: 7, view, level: "full", background: "#102030", hidden: [0, 3], spread: 0.25, speed: 0.5 };
  const flags = { wireframe: true, effects: false, loop: false, mode: "depth" };
  assert.deepEqual(decode(`#${encode({ ...state, ...flags })}`), { ...state, ...flags });
});

test("an orbit in the words of model-viewer", () => {
  assert.deepEqual(orbitOf("30deg 80deg 120%"), { azimuth: 30, elevation: 10, share: 1.2 });
  assert.deepEqual(orbitOf("-0.5rad auto 1.5m"), { azimuth: -0.5 * (180 / Math.PI), distance: 1.5 });
  for (const nothing of [null, "", "auto auto auto", "30 80 1"]) assert.deepEqual(orbitOf(nothing), {});
  assert.deepEqual(["20deg", "auto", null, "500deg", "0deg"].map(fieldOfView), [20, 30, 30, 90, 5]);
});

test("any colour survives its way through the address", () => {
  for (const background of ["#fff", "#10203080", "rebeccapurple", "rgb(10 20 30 / 50%)"])
    assert.equal(decode(`#${encode({ background })}`).background, background);
});

test("nonsense in the address is left out", () => {
  assert.deepEqual(decode("#view=1,2&frame=x&speed=0&background=url(x)&mode=x&level=A/B&spread=7&photo=-1"), {});
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
  version: 4,
  minVersion: 3,
  subject: "test",
  levels: [
    {
      name: "full",
      bytes: 20,
      meshes: [{ file: "full_meshes.bin", ...file }],
      layers: [
        {
          mesh: "full_meshes.bin",
          offset: 0,
          ...file,
          vertices: 4,
          triangles: 2,
          texture_rect: [2, 2, 8, 6],
          uv_window: [-1, 1, -1, 1],
        },
      ],
      texture: {
        ...{ width: 16, height: 32, colour_rect: [0, 0, 16, 16], alpha_rect: [0, 16, 16, 16], frames: 2 },
        ...{ frame_rate: [30000, 1001], keyframes: [0] },
        videos: [{ file: "full.mp4", codec: "h264", mime: 'video/mp4; codecs="avc1.42"', ...file }],
      },
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

test("a track's file is read, and moves points as its poses say", () => {
  const numbers = new Float32Array([1, 0, 0, 0, 0, 0, 0, Math.SQRT1_2, 0, 0, Math.SQRT1_2, 0.1, 0, -0.2]);
  const track = readPoses(numbers.buffer, "x"); // this machine is little-endian
  const entry = { file: "track.bin", bytes: 56, sha256: file.sha256 };
  const named = parseManifest(JSON.stringify({ ...manifest(), track_file: entry }), "x");
  assert.deepEqual([named.trackFile.name, named.track], ["track.bin", null]);
  assert.equal(track.length, 2);
  const [x, y, z] = transformed(matrixOf(track[1]), [1, 0, 0]); // a quarter turn about z
  for (const [found, expected] of [
    [x, 0.1],
    [y, 1],
    [z, -0.2],
  ])
    assert.ok(Math.abs(found - expected) < 1e-6);
  const short = { ...manifest(), track_file: { ...entry, bytes: 28 } };
  assert.throws(() => parseManifest(JSON.stringify(short), "x"), /track_file has 28 bytes for 2 frames/);
  numbers[9] = NaN;
  assert.throws(() => readPoses(numbers.buffer, "x"), /track is damaged/);
});

test("manifests of other versions are refused, but of newer ones that this player can show", () => {
  const read = (more) => parseManifest(JSON.stringify({ ...manifest(), ...more }), "x");
  for (const version of [1, 2, 3, 3.5, "4", null])
    assert.throws(() => read({ version }), /this player reads version 4$/);
  assert.throws(() => read({ version: 5, minVersion: 5 }), /version 4 and is too old for it/);
  assert.equal(read({ version: 5, minVersion: 4, later: {} }).subject, "test");
  assert.throws(() => read({ levels: 1 }), /damaged/);
});

test("segments are read, and must hold all frames", () => {
  const value = manifest();
  const [video] = value.levels[0].texture.videos;
  const part = (offset, more = {}) => ({ offset, bytes: 3, sha256: "0", ...more });
  Object.assign(video, { init: part(0), segments: [part(3, { frames: 1 }), part(6, { frames: 1 })] });
  const [level] = parseManifest(JSON.stringify(value), "x").levels;
  assert.equal(level.videos[0].segments[1].offset, 6);
  assert.equal(level.videos[0].playlist, "full.m3u8");
  assert.equal(level.first, 10 + 6); // meshes, header and first segment
  video.segments[1].frames = 2;
  assert.throws(() => parseManifest(JSON.stringify(value), "x"), /3 frames of 2/);
});

test("the connection's pace is that of the seconds in which something came", () => {
  const pace = new Pace();
  assert.equal(pace.rate, null);
  pace.start(0);
  pace.start(500); // two at once
  pace.end(100000, 1000);
  pace.end(100000, 2000);
  assert.equal(pace.rate, 100000);
  pace.start(60000); // the pause between counts for nothing
  pace.end(900000, 63000);
  assert.ok(pace.rate > 200000 && pace.rate < 300000);
});

test("a newer manifest that says so is read without what it added", () => {
  const newer = { ...manifest(), version: 5, something: "new" };
  assert.deepEqual(parseManifest(JSON.stringify(newer), "x"), parseManifest(JSON.stringify(manifest()), "x"));
});

test("a manifest that is wrong is refused, naming the place", () => {
  const cases = [
    [(m) => (m.levels = []), /levels is empty/],
    [(m) => (m.levels[0].layers[0].texture_rect = [1, 2]), /levels\[0\]\.layers\[0\]\.texture_rect/],
    [(m) => (m.levels[0].texture.frame_rate = [0, 1]), /texture\.frame_rate is 0/],
    [(m) => (m.levels[0].layers[0].offset = 1), /layers\[0\] is not inside a file of meshes/],
    [(m) => (m.levels[0].layers[0].offset = -1), /offset/],
    [(m) => (m.extensionsRequired = ["A_b"]), /extension.*A_b/],
    [(m) => (m.levels[0].layers[0].mesh = "../secret"), /names no plain file/],
    [(m) => (m.version = m.minVersion = 5), /format version 5.*too old/],
    [(m) => (m.version = 0), /format version 0/],
    [(m) => (m.view = { azimuth: [10, -10], elevation: [0, 0] }), /view\.azimuth/],
    [(m) => (m.format = "gltf"), /not a facefolds asset/],
    [(m) => delete m.levels[0].texture, /texture is missing/],
  ];
  for (const [spoil, said] of cases) {
    const value = manifest();
    spoil(value);
    assert.throws(() => parseManifest(JSON.stringify(value), "x"), said);
  }
});

test("movements beyond the middle of what was filmed meet resistance, and fade", () => {
  const range = bounded({ azimuth: [-40, 60], elevation: [-10, 20] });
  assert.deepEqual(range, { azimuth: [-30, 50], elevation: [-7, 17] });
  assert.equal(resisted(50, range.azimuth), 50);
  const [little, far] = [resisted(65, range.azimuth), resisted(500, range.azimuth)];
  assert.ok(little > 54 && little < 65 && far > little && far < 80);
  assert.equal(strength({ azimuth: 50, elevation: 0 }, range), 1);
  const faintest = strength({ azimuth: far, elevation: 0 }, range);
  assert.ok(faintest > 0.25 && faintest < 0.35); // faded, not gone
  assert.equal(strength({ azimuth: 170, elevation: 60 }, bounded(null)), 1);
  assert.equal(bounded({ azimuth: [-170, 175], elevation: [0, 0] }).azimuth[1], Infinity); // filmed all round
  assert.equal(unwound(350, range.azimuth), -10);
  // The front stays where it was filmed, and where one camera stood there is room to move.
  assert.deepEqual(bounded({ azimuth: [-3, 57], elevation: [7, 7] }), { azimuth: [0, 51], elevation: [3, 11] });
  // What was measured goes before any rule.
  const good = { azimuth: [-44, 12], elevation: [-2, 30] };
  assert.deepEqual(bounded({ azimuth: [-40, 60], elevation: [-10, 20], good }), good);
  assert.equal(bounded({ azimuth: [-170, 170], elevation: [0, 0], good }).azimuth[1], 12);
});

/** What is said while pictures come every `seconds` and take `work`, for `total` seconds. */
const played = (adaptation, total, seconds, work, budget = 1 / 30) => {
  const said = [];
  for (let time = 0; time < total; time += seconds) {
    const move = adaptation.note(seconds, work, budget);
    if (move) said.push(move);
  }
  return said;
};

test("hems fade on both sides, beyond what is good in any direction", () => {
  const filmed = { azimuth: [-30, 120], elevation: [-10, 20] };
  const good = { azimuth: [-30, 110], elevation: [-8, 24] };
  const at = (azimuth, elevation) =>
    hemsFrom({ azimuth, elevation }, filmed, good)?.map((angle) => Math.round((angle * 180) / Math.PI)) ?? null;
  for (const [azimuth, elevation] of [[0, 0], [110, 20], [-30, -8]]) assert.equal(at(azimuth, elevation), null); // prettier-ignore
  for (const [azimuth, elevation] of [[-34, 0], [114, 0], [0, 24], [0, -12]])
    assert.deepEqual(at(azimuth, elevation), [100, 146]); // prettier-ignore
  assert.deepEqual(at(0, 22), [140, 163]);
  assert.equal(hemsFrom({ azimuth: 170, elevation: 80 }, filmed, bounded(null)), null);
});

test("a level that is too much is left, and tried again after a longer wait", () => {
  const adaptation = new Adaptation();
  assert.deepEqual(played(adaptation, 30, 1 / 30, 1 / 30), []); // just in time: it stays
  assert.deepEqual(played(adaptation, 30, 1 / 60, 0.004).slice(0, 1), [1]); // plenty of time
  const { wait } = adaptation;
  adaptation.restart();
  assert.equal(played(adaptation, 8, 0.1, 0.1)[0], -1); // late
  assert.ok(adaptation.wait >= 2 * wait);
  adaptation.restart();
  assert.deepEqual(played(adaptation, wait, 1 / 60, 0.004), []); // not so soon again
});

/** What a browser gives for a folder that is dropped; its reader gives a few entries at a time. */
const folderEntry = (path, children) => ({
  fullPath: path,
  createReader() {
    const left = [...children];
    return { readEntries: (resolve) => resolve(left.splice(0, 2)) };
  },
});
const fileEntry = (path) => ({ fullPath: path, isFile: true, file: (resolve) => resolve(new Blob([path])) });

test("a folder that is dropped is read whole; files of folders inside it are none of the asset's", async () => {
  const inner = folderEntry("/a/old", [fileEntry("/a/old/manifest.json"), fileEntry("/a/old/x.drc")]);
  const names = ["manifest.json", "full_00.drc", "full_01.drc", "full.mp4"];
  const entry = folderEntry("/a", [inner, ...names.map((name) => fileEntry(`/a/${name}`))]);
  const found = await droppedAsset({ items: [{ webkitGetAsEntry: () => entry }], files: [] });
  assert.deepEqual([...found.keys()].sort(), [...names].sort());
  assert.equal(await found.get("manifest.json").text(), "/a/manifest.json");
  const empty = { items: [{ webkitGetAsEntry: () => folderEntry("/b", []) }], files: [] };
  await assert.rejects(droppedAsset(empty), /no manifest\.json/);
});
