/** Decodes the layers' meshes with three's Draco decoder, in workers. */
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { PlayerError } from "./errors.js";

let decoder = null;

/** One decoder for all players of a page; its files lie beside the module, in draco/. */
function theDecoder() {
  if (!decoder) {
    const base = new URL("./draco/", import.meta.url);
    const urls = { js: new URL("draco_wasm_wrapper.js", base).href, wasm: new URL("draco_decoder.wasm", base).href };
    decoder = new DRACOLoader().setDecoderPath(urls).setWorkerLimit(2);
  }
  return decoder;
}

export function preloadDecoder() {
  theDecoder().preload();
}

/**
 * @param {ArrayBuffer} buffer handed over: not to be used afterwards
 * @param {import("./manifest.js").LayerEntry} layer what it must hold
 * @param {string} file its address, for messages
 * @returns {Promise<import("three").BufferGeometry>} with index, position and uv
 */
export async function decodeMesh(buffer, layer, file) {
  if (new TextDecoder().decode(buffer.slice(0, 5)) !== "DRACO") throw damaged(layer, file, "it is not a Draco mesh");
  let geometry;
  try {
    geometry = await new Promise((resolve, reject) => theDecoder().parse(buffer, resolve, reject));
  } catch (cause) {
    throw damaged(layer, file, "its Draco data cannot be decoded", cause);
  }
  const { position, uv } = geometry.attributes;
  if (!geometry.index || !position || !uv) throw damaged(layer, file, "it lacks triangles or texture coordinates");
  if (position.count !== layer.vertices || geometry.index.count !== 3 * layer.triangles) {
    const found = `${position.count} vertices and ${geometry.index.count / 3} triangles`;
    throw damaged(layer, file, `${found} instead of ${layer.vertices} and ${layer.triangles}`);
  }
  return geometry;
}

function damaged(layer, file, found, cause) {
  const remedy = "Copy or make the asset again.";
  return new PlayerError(`The mesh ${layer.mesh.name} is damaged: ${found}`, { file, remedy, cause });
}
