/** What a level has on the graphics card: vertex arrays, the textures of the picture and the reflection. */

export class Upload {
  /** @param {WebGL2RenderingContext} gl @param {import("../levels.js").LoadedLevel} level */
  constructor(gl, level) {
    this.gl = gl;
    this.layers = level.geometries.map((geometry) => this.#layer(geometry));
    this.picture = this.#texture();
    this.reflection = level.reflection ? this.#texture(level.reflection) : null;
  }

  #layer({ index, position, uv }) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attribute = (location, data, size) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
      return buffer;
    };
    const buffers = [attribute(0, position, 3), attribute(1, uv, 2)];
    const triangles = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    const type = index.BYTES_PER_ELEMENT === 2 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
    return { array, buffers: [...buffers, triangles], triangles, lines: null, count: index.length, type, index };
  }

  #texture(image) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    if (image) this.#fill(image);
    return texture;
  }

  /** Stored values as they are; rows run down, as in the format. */
  #fill(image) {
    const { gl } = this;
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
  }

  /** @param {VideoFrame | HTMLVideoElement} image the frame to show */
  show(image) {
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.picture);
    this.#fill(image);
  }

  drawTriangles({ array, count, type }) {
    this.gl.bindVertexArray(array);
    this.gl.drawElements(this.gl.TRIANGLES, count, type, 0);
  }

  /** The edges of all triangles; their indices are made when they are first wanted. */
  drawLines(layer) {
    const { gl } = this;
    gl.bindVertexArray(layer.array);
    if (!layer.lines) {
      const edges = new Uint32Array(2 * layer.count);
      for (let i = 0, k = 0; i < layer.count; i += 3) {
        const [a, b, c] = layer.index.subarray(i, i + 3);
        for (const corner of [a, b, b, c, c, a]) edges[k++] = corner;
      }
      layer.lines = gl.createBuffer();
      layer.buffers.push(layer.lines);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, layer.lines);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, edges, gl.STATIC_DRAW);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, layer.lines);
    gl.drawElements(gl.LINES, 2 * layer.count, gl.UNSIGNED_INT, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, layer.triangles);
  }

  dispose() {
    const { gl } = this;
    for (const { array, buffers } of this.layers) {
      gl.deleteVertexArray(array);
      for (const buffer of buffers) gl.deleteBuffer(buffer);
    }
    gl.deleteTexture(this.picture);
    if (this.reflection) gl.deleteTexture(this.reflection);
  }
}
