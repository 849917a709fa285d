/** In a worker: decodes Draco meshes. The decoder's wrapper (DracoDecoderModule) has been loaded before this. */

let ready;

/** @param {object} draco @param {ArrayBuffer} buffer @returns {{index: Uint32Array, position: Float32Array, uv: Float32Array}} */
function decode(draco, buffer) {
  const decoder = new draco.Decoder();
  const mesh = new draco.Mesh();
  const bytes = new Int8Array(buffer);
  try {
    const type = new draco.DecoderBuffer();
    type.Init(bytes, bytes.length);
    const kind = decoder.GetEncodedGeometryType(type);
    draco.destroy(type);
    if (kind !== draco.TRIANGULAR_MESH) throw new Error("no triangles");
    const status = decoder.DecodeArrayToMesh(bytes, bytes.length, mesh);
    if (!status.ok()) throw new Error(status.error_msg());
    const attribute = (name, size) => {
      const id = decoder.GetAttributeId(mesh, draco[name]);
      if (id < 0) throw new Error(`no ${name}`);
      const found = decoder.GetAttribute(mesh, id);
      if (found.num_components() !== size) throw new Error(`${name} of ${found.num_components()} numbers`);
      const count = size * mesh.num_points();
      return copied(draco, 4 * count, (to) =>
        decoder.GetAttributeDataArrayForAllPoints(mesh, found, draco.DT_FLOAT32, 4 * count, to),
      );
    };
    const corners = 12 * mesh.num_faces();
    return {
      position: new Float32Array(attribute("POSITION", 3)),
      uv: new Float32Array(attribute("TEX_COORD", 2)),
      index: new Uint32Array(copied(draco, corners, (to) => decoder.GetTrianglesUInt32Array(mesh, corners, to))),
    };
  } finally {
    draco.destroy(mesh);
    draco.destroy(decoder);
  }
}

/** What `fill` wrote to a place of `size` bytes in the decoder's memory. */
function copied(draco, size, fill) {
  const place = draco._malloc(size);
  fill(place);
  const data = draco.HEAPU8.slice(place, place + size).buffer;
  draco._free(place);
  return data;
}

self.onmessage = async ({ data: { id, wasm, buffer } }) => {
  if (wasm) {
    ready = new Promise((resolve, reject) => {
      // Wrapped: the module has a `then` of its own, which would never end an `await`.
      self.DracoDecoderModule({ wasmBinary: wasm, onModuleLoaded: (draco) => resolve({ draco }) }).catch?.(reject);
    });
    return;
  }
  try {
    const { draco } = await ready;
    const found = decode(draco, buffer);
    self.postMessage(
      { id, ...found },
      Object.values(found).map((array) => array.buffer),
    );
  } catch (error) {
    self.postMessage({ id, error: error?.message ?? String(error) });
  }
};
