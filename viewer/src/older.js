/** Manifests of format versions 1 and 2, brought into the form of version 3. What makes no sense is left to the checks. */

/** @param {object} value of manifest.json @returns {object} */
export function broughtUp(value) {
  const second = value.version === 1 ? fromFirst(value) : value;
  if (!Array.isArray(second.levels)) return second;
  return { ...second, version: 3, levels: second.levels.map(fromSecond) };
}

/** One level without a name, one video. */
function fromFirst({ layers, texture, ...rest }) {
  if (!texture || !Array.isArray(layers)) return { ...rest, levels: [{ layers, texture }] };
  const { video, bytes, sha256, codec, level, ...kept } = texture;
  const videos = [{ file: video, bytes, sha256, codec, level, mime: "video/mp4" }];
  const total = layers.reduce((sum, layer) => sum + layer.bytes, bytes);
  return { ...rest, levels: [{ name: "full", layers, texture: { ...kept, videos }, bytes: total }] };
}

/** A file a mesh, frames a second as a decimal number. */
function fromSecond(level) {
  const { layers, texture } = level ?? {};
  if (!Array.isArray(layers) || !texture) return level;
  return {
    ...level,
    meshes: layers.map(({ mesh, bytes, sha256 }) => ({ file: mesh, bytes, sha256 })),
    layers: layers.map((layer) => ({ ...layer, offset: 0 })),
    texture: { ...texture, frame_rate: [texture.fps, 1] },
  };
}
