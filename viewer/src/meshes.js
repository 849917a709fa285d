/** A layer's mesh, decoded and held against what the manifest says of it. */
import { decode } from "./draco/decoder.js";
import { PlayerError } from "./errors.js";

/**
 * @typedef {{index: Uint16Array | Uint32Array, position: Float32Array, uv: Float32Array,
 *   box: {low: number[], high: number[]}, area: number}} Geometry
 * @param {ArrayBuffer} buffer handed over: not to be used afterwards
 * @param {import("./manifest.js").LayerEntry} layer what it must hold
 * @param {string} file its address, for messages
 * @returns {Promise<Geometry>}
 */
export async function decodeMesh(buffer, layer, file) {
  if (new TextDecoder().decode(buffer.slice(0, 5)) !== "DRACO") throw damaged(layer, file, "it is not a Draco mesh");
  let found;
  try {
    found = await decode(buffer);
  } catch (cause) {
    if (cause instanceof PlayerError) throw cause;
    throw damaged(layer, file, "its Draco data cannot be decoded", cause);
  }
  const { index, position, uv } = found;
  const [vertices, triangles] = [position.length / 3, index.length / 3];
  if (vertices !== layer.vertices || triangles !== layer.triangles) {
    const wanted = `${layer.vertices} and ${layer.triangles}`;
    throw damaged(layer, file, `${vertices} vertices and ${triangles} triangles instead of ${wanted}`);
  }
  const short = vertices <= 65536 ? Uint16Array.from(index) : index;
  return { index: short, position, uv, box: boxOf(position), area: areaOf(index, position) };
}

function areaOf(index, position) {
  const edge = (from, to, k) => position[3 * to + k] - position[3 * from + k];
  let twice = 0;
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [index[i], index[i + 1], index[i + 2]];
    const [x, y, z] = [edge(a, b, 0), edge(a, b, 1), edge(a, b, 2)];
    const [u, v, w] = [edge(a, c, 0), edge(a, c, 1), edge(a, c, 2)];
    twice += Math.hypot(y * w - z * v, z * u - x * w, x * v - y * u);
  }
  return twice / 2;
}

function boxOf(position) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < position.length; ++i) {
    const k = i % 3;
    if (position[i] < low[k]) low[k] = position[i];
    if (position[i] > high[k]) high[k] = position[i];
  }
  return { low, high };
}

function damaged(layer, file, found, cause) {
  const remedy = "Copy or make the asset again.";
  return new PlayerError(`The mesh ${layer.mesh.name} is damaged: ${found}`, { file, remedy, cause });
}
