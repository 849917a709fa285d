/** manifest.json, format version 4 (docs/reference/asset-format.md): read, checked as far as the player relies on it. */
import { PlayerError } from "./errors.js";
import { matrixOf, POSE_BYTES } from "./track.js";

export const VERSION = 4;
const PLAIN_NAME = /^[A-Za-z0-9_][A-Za-z0-9_.-]*$/;

/**
 * @typedef {[number, number, number, number]} Rect x, y, width, height in pixels, y down
 * @typedef {{name: string, bytes: number, sha256: string}} FileEntry
 * @typedef {{mesh: {name: string, offset: number, bytes: number}, vertices: number, triangles: number, rect: Rect, window: number[]}} LayerEntry
 * @typedef {{offset: number, bytes: number, sha256: string}} Part of a file
 * @typedef {FileEntry & {codec: string, mime: string, init: Part | null, segments: (Part & {frames: number})[] | null,
 *   playlist: string}} VideoEntry `playlist` of HLS, where there are segments
 * @typedef {{width: number, height: number, colourRect: Rect, alphaRect: Rect, frames: number, fps: number}} TextureEntry
 * @typedef {{name: string, meshes: FileEntry[], layers: LayerEntry[], texture: TextureEntry, videos: VideoEntry[],
 *   reflection: ReflectionEntry | null, bytes: number, first: number}} Level `first`: bytes before its first picture
 * @typedef {{file: FileEntry, window: number[], environment: Rect, gloss: Rect, offset: Rect, normals: Rect,
 *   scales: number[]}} ReflectionEntry `scales` of environment, gloss and offset
 * @typedef {{file: FileEntry, camera: string, frame: number, width: number, height: number, K: number[][],
 *   w2c: number[][]}} Photo
 * @typedef {{subject: string, generator: string, centre: number[], levels: Level[], audio: FileEntry & {mime: string} | null,
 *   poster: FileEntry | null, photos: Photo[], view: import("./limits.js").Filmed | null,
 *   track: import("./track.js").Pose[] | null, trackFile: FileEntry | null,
 *   torso: import("./track.js").Torso | null}} Manifest `track`: of its file, once that is read
 */

/**
 * @param {string} text the file
 * @param {string} file its address, for messages
 * @returns {Manifest} levels coarsest first
 * @throws {PlayerError} if it is not the manifest of an asset that this player reads
 */
export function parseManifest(text, file) {
  let value;
  try {
    value = JSON.parse(text);
  } catch (cause) {
    throw damaged(file, "it is not JSON", cause);
  }
  if (value === null || typeof value !== "object" || value.format !== "facefolds") {
    throw new PlayerError("This is not a facefolds asset", {
      file,
      kind: "unsupported",
      remedy: "Give the folder that holds an asset's manifest.json.",
    });
  }
  const newer = Number(value.version) > VERSION;
  if (newer ? !(value.minVersion <= VERSION) : value.version !== VERSION) {
    throw new PlayerError(
      `The asset has format version ${value.version}; this player reads version ${VERSION}${newer ? " and is too old for it" : ""}`,
      {
        file,
        kind: "unsupported",
        remedy: newer
          ? "Put the player of the facefolds that made the asset on this page."
          : "Make the asset again with the facefolds that this player came with.",
      },
    );
  }
  if (value.extensionsRequired?.length) {
    throw new PlayerError(
      `The asset needs an extension that this player does not know: ${value.extensionsRequired[0]}`,
      {
        file,
        kind: "unsupported",
        remedy: "Put the player that the asset was made for on this page.",
      },
    );
  }
  try {
    return readManifest(value);
  } catch (cause) {
    if (cause instanceof TypeError || cause instanceof RangeError) throw damaged(file, cause.message, cause);
    throw cause;
  }
}

function damaged(file, found, cause) {
  return new PlayerError(`The asset's manifest is damaged: ${found}`, {
    file,
    cause,
    remedy: "Copy or make the asset again.",
  });
}

function readManifest(value) {
  const levels = list(value.levels, "levels").map(readLevel);
  check(levels.length > 0, "levels is empty");
  return {
    subject: String(value.subject ?? ""),
    generator: String(value.generator ?? ""),
    centre: value.coordinates?.sphere_centre ?? [0, 0, 0],
    levels,
    audio: value.audio
      ? { ...readFile(value.audio, value.audio.file, "audio"), mime: String(value.audio.mime ?? "") }
      : null,
    poster: value.poster ? readPoster(value.poster) : null,
    bounds: value.bounds ? readBounds(value.bounds) : null,
    photos: (value.photos ?? []).map(readPhoto),
    trackFile: value.track_file ? readTrackFile(value.track_file, levels[0].texture.frames) : null,
    track: null,
    torso: value.torso ? readTorso(value.torso) : null,
    view: value.view ? { ...directions(value.view), good: value.view.good ? directions(value.view.good) : null } : null,
  };
}

/** What may show the same as the first picture: with its camera, and what is behind the layers. */
function readPoster(entry) {
  const { K, w2c, background, width, height } = entry;
  const camera = K && w2c && background ? { K, w2c, width, height, background } : null;
  return { ...readFile(entry, entry.file, "poster"), camera };
}

function readBounds({ min, max }) {
  const [low, high] = [min, max].map((corner) => list(corner, "bounds").map(Number));
  check([...low, ...high].every(Number.isFinite) && low.length === 3 && high.length === 3, "bounds is no box");
  return { low, high, centre: low.map((v, i) => (v + high[i]) / 2) };
}

function readLevel(level, index) {
  const place = `levels[${index}]`;
  const { texture } = level;
  check(texture !== null && typeof texture === "object", `${place}.texture is missing`);
  const videos = list(texture.videos, `${place}.texture.videos`).map((video, i) => ({
    ...readFile(video, video.file, `${place}.texture.videos[${i}]`),
    codec: String(video.codec),
    mime: String(video.mime),
    ...readSegments(video, texture.frames, `${place}.texture.videos[${i}]`),
  }));
  check(videos.length > 0, `${place}.texture.videos is empty`);
  const layers = list(level.layers, `${place}.layers`).map((layer, i) => readLayer(layer, `${place}.layers[${i}]`));
  check(layers.length > 0, `${place}.layers is empty`);
  const meshes = list(level.meshes, `${place}.meshes`).map((file, i) =>
    readFile(file, file.file, `${place}.meshes[${i}]`),
  );
  for (const [i, { mesh }] of layers.entries()) {
    const whole = meshes.find(({ name }) => name === mesh.name);
    check(mesh.offset + mesh.bytes <= whole?.bytes, `${place}.layers[${i}] is not inside a file of meshes`);
  }
  const reflection = level.reflection ? readReflection(level.reflection, `${place}.reflection`) : null;
  return {
    name: String(level.name),
    meshes,
    layers,
    texture: readTexture(texture, `${place}.texture`),
    videos,
    reflection,
    bytes: count(level.bytes, `${place}.bytes`),
    first: bytesBefore(meshes, videos[0]),
  };
}

function readSegments({ init, segments, file }, frames, place) {
  if (!segments) return { init: null, segments: null, playlist: "" };
  const part = (value, where) => ({
    offset: count(value?.offset + 1, `${where}.offset`) - 1,
    bytes: count(value.bytes, `${where}.bytes`),
    sha256: String(value.sha256 ?? ""),
  });
  const read = list(segments, `${place}.segments`).map((segment, i) => ({
    ...part(segment, `${place}.segments[${i}]`),
    frames: count(segment.frames, `${place}.segments[${i}].frames`),
  }));
  const total = read.reduce((sum, segment) => sum + segment.frames, 0);
  check(total === frames, `${place}.segments hold ${total} frames of ${frames}`);
  return { init: part(init, `${place}.init`), segments: read, playlist: file.replace(/\.mp4$/, ".m3u8") };
}

/** Of the files of a level what its first picture needs. */
function bytesBefore(meshes, { bytes, init, segments }) {
  const video = segments ? init.bytes + segments[0].bytes : bytes;
  return meshes.reduce((sum, file) => sum + file.bytes, video);
}

function readTexture(texture, place) {
  const [frames, seconds] = list(texture.frame_rate, `${place}.frame_rate`);
  const fps = frames / seconds;
  check(fps > 0 && fps < Infinity, `${place}.frame_rate is ${texture.frame_rate}`);
  return {
    width: count(texture.width, `${place}.width`),
    height: count(texture.height, `${place}.height`),
    colourRect: rectangle(texture.colour_rect, `${place}.colour_rect`),
    alphaRect: rectangle(texture.alpha_rect, `${place}.alpha_rect`),
    frames: count(texture.frames, `${place}.frames`),
    fps,
  };
}

function readLayer(layer, place) {
  return {
    mesh: { ...readFile(layer, layer.mesh, place), offset: count(layer.offset + 1, `${place}.offset`) - 1 },
    vertices: count(layer.vertices, `${place}.vertices`),
    triangles: count(layer.triangles, `${place}.triangles`),
    rect: rectangle(layer.texture_rect, `${place}.texture_rect`),
    window: rectangle(layer.uv_window, `${place}.uv_window`),
  };
}

function readReflection(entry, place) {
  const rect = (name) => rectangle(entry[`${name}_rect`], `${place}.${name}_rect`);
  const scales = ["environment", "gloss", "offset"].map((name) => Number(entry[`${name}_scale`]));
  check(scales.every(Number.isFinite), `${place} lacks a scale`);
  return {
    file: readFile(entry, entry.file, place),
    window: rectangle(entry.uv_window, `${place}.uv_window`),
    ...{ environment: rect("environment"), gloss: rect("gloss"), offset: rect("offset"), normals: rect("normals") },
    scales,
  };
}

function readPhoto(photo, index) {
  const place = `photos[${index}]`;
  check(photo.K?.length === 3 && photo.w2c?.length === 3, `${place} has no camera`);
  const { camera, frame, K, w2c } = photo;
  const size = { width: count(photo.width, `${place}.width`), height: count(photo.height, `${place}.height`) };
  return { file: readFile(photo, photo.file, place), camera: String(camera), frame: Number(frame), ...size, K, w2c };
}

function readFile(entry, name, place) {
  check(typeof name === "string" && PLAIN_NAME.test(name), `${place} names no plain file`);
  return { name, bytes: count(entry.bytes, `${place}.bytes`), sha256: String(entry.sha256 ?? "") };
}

function list(value, place) {
  check(Array.isArray(value), `${place} is not a list`);
  return value;
}

function count(value, place) {
  check(Number.isInteger(value) && value > 0, `${place} is ${value}`);
  return value;
}

function rectangle(value, place) {
  check(Array.isArray(value) && value.length === 4 && value.every(Number.isFinite), `${place} is not a rectangle`);
  return value;
}

function readTrackFile(entry, frames) {
  check(entry.bytes === POSE_BYTES * frames, `track_file has ${entry.bytes} bytes for ${frames} frames`);
  return readFile(entry, entry.file, "track_file");
}

function readTorso({ normal, offset, band, quaternion, translation }) {
  const [n, q, t] = [
    list(normal, "torso.normal"),
    list(quaternion, "torso.quaternion"),
    list(translation, "torso.translation"),
  ];
  const numbers = [...n, offset, band, ...q, ...t];
  check(
    n.length === 3 && q.length === 4 && t.length === 3 && numbers.every(Number.isFinite) && band >= 1e-6,
    "torso is no plane",
  );
  return { normal, offset, band, rest: matrixOf({ quaternion, translation }) };
}

const directions = (view) => ({ azimuth: range(view, "azimuth"), elevation: range(view, "elevation") });

function range(view, key) {
  const [low, high] = list(view[key], `view.${key}`);
  check(Number.isFinite(low) && Number.isFinite(high) && low <= high, `view.${key} is no range`);
  return [low, high];
}

function check(condition, message) {
  if (!condition) throw new TypeError(message);
}
