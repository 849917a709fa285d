/** Loads one level of detail: its meshes, its reflection and the video with its first picture. */
import { PlayerError } from "./errors.js";
import { decodeMesh } from "./meshes.js";

/**
 * @typedef {{info: import("./manifest.js").Level, geometries: import("./meshes.js").Geometry[],
 *   reflection: ImageBitmap | null, source: import("./video/open.js").FrameSource,
 *   video: import("./manifest.js").VideoEntry, dispose: () => void}} LoadedLevel
 * @param {import("./manifest.js").Level} info
 * @param {import("./files.js").Files} files
 * @param {(error: Error) => void} onVideoError
 * @param {Set<string>} refused videos not to try
 * @param {number} at the frame to begin with
 * @param {LoadedLevel | null} like a level that is there: what is the same is not loaded again
 * @returns {Promise<LoadedLevel>}
 */
export async function loadLevel(info, files, onVideoError, refused, at = 0, like = null) {
  const [geometries, opened, reflection] = await allOrNothing([
    sameMeshes(info, like?.info) ? like.geometries : loadMeshes(info, files),
    import("./video/open.js").then(({ openVideo }) => openVideo(info, files, onVideoError, refused, at)),
    info.reflection ? loadPicture(info.reflection.file, files) : null,
  ]); // prettier-ignore
  const dispose = () => {
    reflection?.close();
    opened.source.close();
  };
  return { info, geometries, reflection, source: opened.source, video: opened.video, dispose };
}

/** Levels that can be switched share them. */
function sameMeshes(one, other) {
  const said = ({ meshes, layers }) =>
    JSON.stringify([meshes.map(({ sha256 }) => sha256), layers.map(({ mesh }) => mesh)]);
  return Boolean(other && one.meshes.every(({ sha256 }) => sha256) && said(one) === said(other));
}

/** Each file once; the layers' meshes are parts of them. */
async function loadMeshes({ meshes, layers }, files) {
  const buffers = new Map(meshes.map((entry) => [entry.name, files.bytes(entry)]));
  return Promise.all(
    layers.map(async (layer) => {
      const { name, offset, bytes } = layer.mesh;
      return decodeMesh((await buffers.get(name)).slice(offset, offset + bytes), layer, files.address(name));
    }),
  );
}

/** Like Promise.all, but a video opened in vain is closed. */
async function allOrNothing(work) {
  const done = await Promise.allSettled(work);
  const failed = done.find(({ status }) => status === "rejected");
  if (!failed) return done.map(({ value }) => value);
  done[1].value?.source.close();
  throw failed.reason;
}

async function loadPicture(entry, files) {
  const blob = new Blob([await files.bytes(entry)], { type: "image/png" });
  try {
    return await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  } catch (cause) {
    const file = files.address(entry.name);
    throw new PlayerError(`The picture ${entry.name} is damaged`, {
      file,
      cause,
      remedy: "Copy or make the asset again.",
    });
  }
}

/** Bytes that a level keeps on the GPU: vertex data as uploaded (uint32 or uint16 indices) and RGBA textures. */
export function gpuBytes(level) {
  let bytes = 4 * level.info.texture.width * level.info.texture.height;
  for (const { index, position, uv } of level.geometries)
    bytes += index.byteLength + position.byteLength + uv.byteLength;
  const image = level.reflection;
  return bytes + (image ? 4 * image.width * image.height : 0);
}

/** Texels a unit of the scene, the mean over all layers of a level that is loaded. @param {LoadedLevel} level */
export function texelsAUnit({ info, geometries }) {
  let [texels, surface] = [0, 0];
  geometries.forEach(({ index, position, uv }, i) => {
    const [, , width, height] = info.layers[i].rect;
    for (let k = 0; k < index.length; k += 3) {
      const [a, b, c] = index.subarray(k, k + 3);
      const edge = (data, size, to, axis) => data[size * to + axis] - data[size * a + axis];
      const cross = (data, size, x, y) =>
        edge(data, size, b, x) * edge(data, size, c, y) - edge(data, size, b, y) * edge(data, size, c, x);
      texels += Math.abs(cross(uv, 2, 0, 1)) * width * height;
      surface += Math.hypot(cross(position, 3, 0, 1), cross(position, 3, 1, 2), cross(position, 3, 2, 0));
    }
  });
  return Math.sqrt(texels / surface);
}

/** How fine a level's texture is, to be compared with that of another level of the asset. */
export function fineness({ layers }) {
  const areas = layers.map(({ rect: [, , w, h], window: [u0, u1, v0, v1] }) => (w * h) / ((u1 - u0) * (v1 - v0)));
  return Math.sqrt(areas.reduce((sum, area) => sum + area) / areas.length);
}
