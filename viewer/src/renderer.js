/**
 * Draws the layers of one level: innermost first, ordinary blending, each layer's nearest sheet only.
 *
 * Each layer has its own slice of the depth range, nearer than those of the layers inside it. So it never hides or is
 * hidden by another layer, and its own folds count once: a pass to depth alone, then colour where the depth is equal.
 * Stored values are blended as they are: no colour management, no tone mapping, no sRGB textures.
 * A pixel is the mean of SIDE x SIDE rays: the picture is drawn SIDE times as large, and averaged.
 */
import { placesInRow } from "./apart.js";
import { Graphics, SIDE } from "./gl/graphics.js";
import { Target } from "./gl/target.js";
import { Upload } from "./gl/upload.js";
import { drawBackdrop, drawShadow, fillBackdrop } from "./ground.js";
import { eyeOf, IDENTITY, inverseOf, multiplied, transformed } from "./matrices.js";
import { COLOUR_FRAGMENT, DEPTH_FRAGMENT, KINDS, VERTEX, WIRE_FRAGMENT } from "./shaders.js";

const SPREAD = { step: 0.6, all: 3.2 }; // heights of the head from layer to layer when fully pulled apart, and at most in all
const LOOK = 96; // pixels a side of the picture that the range of depths is taken from

export class LayerRenderer {
  /** @param {HTMLCanvasElement} canvas that is looked at @throws {PlayerError} if there is no WebGL 2 */
  constructor(canvas) {
    this.graphics = Graphics.acquire();
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.level = null;
    this.pose = null;
    this.turn = null;
    this.torso = null;
    this.stay = null;
    this.upload = null;
    this.visible = [];
    this.effectsOn = true;
    this.wireframe = false;
    this.spread = 0;
    this.places = [0]; // of the layers in the row when they are pulled apart
    this.kind = "colour";
    this.range = null; // distances from the eye that are shown bright and dark, for depth; null: of all there is
    this.background = [0, 0, 0, 1];
    this.backdrop = null; // colours at its middle and corners, before the background
    this.shadow = 0;
    this.exposure = 1;
    this.hems = null;
    this.side = 1; // rays along each side of a pixel of the last picture
  }

  get maxTextureSize() {
    return this.graphics.maxTextureSize;
  }

  /** @param {number[]} rgba in [0, 1], straight; alpha 0 lets the page shine through */
  setBackground(rgba) {
    this.background = rgba;
  }

  /** @param {number[][] | null} colours RGBA at the middle and at the corners */
  setBackdrop(colours) {
    this.backdrop = colours;
  }

  /** @param {number} intensity of the shadow on the floor, 0 to 1 */
  setShadow(intensity) {
    this.shadow = intensity;
  }

  /** @param {number} factor of the layers' light */
  setExposure(factor) {
    this.exposure = factor;
  }

  /** What fades where the view is beyond what was filmed. @param {import("./limits.js").Hems | null} hems null: nothing */
  setHems(hems) {
    this.hems = hems;
  }

  /** Shows another level from the next picture on. @param {import("./levels.js").LoadedLevel} level */
  setLevel(level) {
    this.upload?.dispose();
    this.level = level;
    const ends = level.geometries.flatMap(({ box }) => [box.low[2], box.high[2]]);
    this.tall = Math.max(...ends) - Math.min(...ends);
    this.places = placesInRow(level.geometries.map(({ area }) => area));
    this.upload = new Upload(this.graphics.gl, level);
  }

  /** @param {VideoFrame | HTMLVideoElement} image */
  setFrame(image) {
    this.upload.show(image);
  }

  /**
   * Where the head stands from the next picture on.
   * @param {import("./matrices.js").Matrix | null} matrix null: at rest
   * @param {boolean} held it is drawn at rest; the light of the room turns around it
   */
  setPose(matrix, held) {
    this.pose = held ? null : matrix;
    this.turn = matrix;
    this.stay = this.pose && this.torso ? multiplied(inverseOf(this.pose), this.torso.rest) : null;
  }

  /** What stays in the room while the head turns. @param {import("./track.js").Torso | null} torso */
  setTorso(torso) {
    this.torso = torso;
  }

  /** Where a point of the layers is in this frame, in the meshes' own axes; the shader's own. @param {ArrayLike<number>} p */
  placed(p) {
    if (!this.stay) return p;
    const { normal, offset, band } = this.torso;
    const along = normal.reduce((sum, n, i) => sum + n * p[i], 0);
    const share = Math.max(0, Math.min(1, (along - offset) / band));
    return transformed(this.stay, p).map((there, i) => p[i] + share * (there - p[i]));
  }

  /** After a lost context came back. The frame has to be given again. */
  restore() {
    if (this.level) this.upload = new Upload(this.graphics.gl, this.level);
  }

  setVisible(visible) {
    this.visible = visible;
  }

  /** @param {number} spread 0: as they are; 1: fully pulled apart, along the subject's forward axis */
  setSpread(spread) {
    this.spread = spread;
  }

  setWireframe(on) {
    this.wireframe = on;
  }

  setEffects(on) {
    this.effectsOn = on;
  }

  /** @param {string} kind one of KINDS */
  setKind(kind) {
    this.kind = kind;
  }

  resize(width, height) {
    this.canvas.width = width;
    this.canvas.height = height;
    this.graphics.claim(this, [width, height]);
  }

  #shift(index) {
    const middle = this.places.at(-1) / 2;
    return (
      this.spread * this.tall * Math.min(SPREAD.step, SPREAD.all / (2 * middle || 1)) * (middle - this.places[index])
    );
  }

  /**
   * Draws to the canvas.
   * @param {import("./matrices.js").Matrix} projection
   * @param {import("./matrices.js").Matrix} view world to camera, OpenGL's axes
   * @param {number} [strength] below 1 the picture fades into the background
   * @param {boolean} [quick] one ray a pixel
   */
  draw(projection, view, strength = 1, quick = false) {
    const { width, height } = this.canvas;
    const { context, graphics } = this;
    this.#filtered(projection, view, quick ? null : graphics.fine, width, height, null);
    context.globalCompositeOperation = "copy";
    context.globalAlpha = 1;
    if (strength < 1) {
      context.fillStyle = cssOf(this.#ground());
      context.fillRect(0, 0, width, height);
      if (this.#stands()) fillBackdrop(context, width, height, this.backdrop);
      context.globalCompositeOperation = "source-over";
      context.globalAlpha = strength;
    }
    const top = graphics.canvas.height - height; // WebGL counts rows from below
    context.drawImage(graphics.canvas, 0, top, width, height, 0, 0, width, height);
  }

  /** Draws through a finer picture, if there is one. @param {WebGLFramebuffer | null} target null: the graphics' canvas */
  #filtered(projection, view, fine, width, height, target) {
    this.range = this.kind === "depth" ? this.#visibleRange(projection, view) : null;
    this.side = fine ? SIDE : 1;
    const rect = [0, 0, this.side * width, this.side * height];
    this.render(projection, view, rect, fine ? fine.framebuffer : target);
    if (fine) this.graphics.average(fine, target, width, height);
  }

  /** Distances from the eye of what is seen, but for the nearest and the farthest hundredth. @returns {number[] | null} */
  #visibleRange(projection, view) {
    const { gl } = this.graphics;
    const data = new Uint8Array(4 * LOOK * LOOK);
    const target = new Target(gl, LOOK, LOOK);
    this.range = null;
    this.render(projection, view, [0, 0, LOOK, LOOK], target.framebuffer, [0, 0, 0, 0]);
    gl.readPixels(0, 0, LOOK, LOOK, gl.RGBA, gl.UNSIGNED_BYTE, data);
    target.dispose();
    const seen = [];
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 127) seen.push(1 - data[i] / data[i + 3]);
    if (!seen.length) return null;
    seen.sort((a, b) => a - b);
    const [near, far] = this.#wholeRange(eyeOf(this.pose ? multiplied(view, this.pose) : view));
    const place = (part) => near + seen[Math.round(part * (seen.length - 1))] * (far - near);
    return [place(0.01), Math.max(place(0.99), place(0.01) + 1e-3)];
  }

  /** Distances that hold all that there is. */
  #wholeRange(eye) {
    const { centre, radius } = this.bounds();
    const away = Math.hypot(...centre.map((v, i) => v - eye[i]));
    return [away - radius, away + radius];
  }

  /** Whether a backdrop is behind the picture. */
  #stands() {
    return this.backdrop !== null && this.kind === "colour";
  }

  /** Opacity is shown white on black. */
  #ground() {
    return this.kind === "alpha" ? [0, 0, 0, 1] : this.background;
  }

  /**
   * Draws into a part of a framebuffer. @param {number[]} rect x, y, width, height
   * @param {WebGLFramebuffer | null} target null: the graphics' own canvas
   * @param {number[] | null} [ground] RGBA behind the layers and nothing else; null: what was set, with its shadow
   */
  render(projection, view, rect, target, ground = null) {
    const { gl } = this.graphics;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(...rect);
    gl.scissor(...rect);
    gl.enable(gl.SCISSOR_TEST);
    const [r, g, b, a] = ground ?? this.#ground();
    gl.clearColor(a * r, a * g, a * b, a);
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.CULL_FACE);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    if (!ground) this.#drawGround(projection, view, rect);
    const passes = this.#passes(projection, this.pose ? multiplied(view, this.pose) : view);
    const count = this.level.geometries.length;
    for (let index = count - 1; index >= 0; --index) {
      if (!this.visible[index]) continue;
      gl.depthRange((index + 0.05) / count, (index + 0.95) / count);
      for (const pass of passes) pass(index, this.upload.layers[index]);
    }
    gl.depthRange(0, 1);
    gl.bindVertexArray(null);
  }

  /** Backdrop and shadow; the shadow goes where the layers are pulled apart. */
  #drawGround(projection, view, rect) {
    if (this.#stands()) drawBackdrop(this.graphics, rect, this.backdrop);
    const intensity = this.kind === "colour" ? this.shadow * (1 - this.spread) : 0;
    if (intensity > 0) drawShadow(this.graphics, projection, view, this.bounds(), intensity);
  }

  /** What is done for each layer: the uniforms that all share are set. */
  #passes(projection, view) {
    const { graphics, level, upload } = this;
    const { gl } = graphics;
    const eye = eyeOf(view);
    const prepared = (fragment) => {
      const { program, at } = graphics.program(VERTEX, fragment);
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.projection, false, projection);
      gl.uniformMatrix4fv(at.view, false, view);
      gl.uniform1f(at.band, this.stay ? this.torso.band : 0);
      if (this.stay) {
        gl.uniform4f(at.torso, ...this.torso.normal, this.torso.offset);
        gl.uniformMatrix4fv(at.stay, false, this.stay);
      }
      return { program, at };
    };
    const depth = prepared(DEPTH_FRAGMENT);
    const colour = this.#colourProgram(prepared, eye);
    const wire = this.wireframe ? prepared(WIRE_FRAGMENT) : null;
    const begin = ({ program, at }, index) => {
      gl.useProgram(program);
      gl.uniform3f(at.shift, this.#shift(index), 0, 0);
    };
    const toDepth = (index, layer) => {
      begin(depth, index);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LESS);
      gl.depthMask(true);
      gl.colorMask(false, false, false, false);
      gl.disable(gl.BLEND);
      upload.drawTriangles(layer);
    };
    const toColour = (index, layer) => {
      begin(colour, index);
      this.#setLayer(colour.at, level.info, index);
      gl.uniform3f(colour.at.eye, eye[0] - this.#shift(index), eye[1], eye[2]);
      gl.depthFunc(gl.EQUAL);
      gl.depthMask(false);
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND);
      upload.drawTriangles(layer);
    };
    const toLines = (index, layer) => {
      begin(wire, index);
      gl.uniform4f(wire.at.wire, ...wireColour(index, level.geometries.length, this.side));
      gl.disable(gl.DEPTH_TEST);
      upload.drawLines(layer);
    };
    return wire ? [toDepth, toColour, toLines] : [toDepth, toColour];
  }

  #colourProgram(prepared, eye) {
    const { level, upload } = this;
    const { gl } = this.graphics;
    const head = "#version 300 es\n";
    const defines = upload.reflection ? "#define REFLECTION 1\n" : "";
    const colour = prepared(COLOUR_FRAGMENT.replace(head, head + defines));
    const { at } = colour;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, upload.reflection);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, upload.picture);
    gl.uniform1i(at.picture, 0);
    gl.uniform1f(at.exposure, this.exposure);
    gl.uniform3fv(at.centre, this.bounds().centre);
    gl.uniform2fv(at.hems, this.hems ?? [Math.PI, Math.PI]);
    gl.uniform1i(at.kind, KINDS.indexOf(this.kind));
    gl.uniform2f(at.range, ...(this.range ?? this.#wholeRange(eye)));
    if (upload.reflection) {
      const { environment, gloss, offset, normals, scales } = level.info.reflection;
      gl.uniform1i(at.reflection, 1);
      gl.uniform4fv(at.environmentRect, environment);
      gl.uniform4fv(at.glossRect, gloss);
      gl.uniform4fv(at.offsetRect, offset);
      gl.uniform4fv(at.normalsRect, normals);
      const m = this.turn ?? IDENTITY;
      gl.uniformMatrix3fv(
        at.toRoom,
        false,
        [0, 1, 2, 4, 5, 6, 8, 9, 10].map((i) => m[i]),
      );
      gl.uniform3fv(at.reflectionScales, this.effectsOn ? scales : [0, 0, 0]);
    }
    return colour;
  }

  #setLayer(at, info, index) {
    const { gl } = this.graphics;
    const [cx, cy] = info.texture.colourRect;
    const [ax, ay] = info.texture.alphaRect;
    const [x, y, w, h] = info.layers[index].rect;
    gl.uniform4f(at.colourRect, cx + x, cy + y, w, h);
    gl.uniform2f(at.alphaOffset, ax - cx, ay - cy);
    if (info.reflection) gl.uniform4fv(at.toMaps, toWindow(info.layers[index].window, info.reflection.window));
  }

  /**
   * Draws into a picture of its own instead of the canvas, by the same passes and with the same filter.
   * @returns {ImageData} top row first; premultiplied where the background is transparent
   */
  capture(projection, view, width, height) {
    const { graphics, side } = this;
    const { gl } = graphics;
    const data = new Uint8ClampedArray(4 * width * height);
    const target = new Target(gl, width, height);
    const fine = graphics.allows(width, height) ? new Target(gl, SIDE * width, SIDE * height) : null;
    try {
      this.#filtered(projection, view, fine?.whole ? fine : null, width, height, target.framebuffer);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
    } finally {
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      target.dispose();
      fine?.dispose();
      this.side = side;
    }
    const row = 4 * width;
    const upright = new Uint8ClampedArray(data.length);
    for (let y = 0; y < height; ++y) upright.set(data.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
    return new ImageData(upright, width, height);
  }

  /** Box and sphere around the layers as they stand. @returns {{centre: number[], radius: number, low: number[], high: number[]}} */
  bounds() {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    this.level?.geometries.forEach(({ box }, i) => {
      if (!this.visible[i]) return;
      for (const k of [0, 1, 2]) {
        const shift = k === 0 ? this.#shift(i) : 0;
        low[k] = Math.min(low[k], box.low[k] + shift);
        high[k] = Math.max(high[k], box.high[k] + shift);
      }
    });
    if (!Number.isFinite(low[0])) return { centre: [0, 0, 0], radius: 1, low: [-1, -1, -1], high: [1, 1, 1] };
    const centre = low.map((v, k) => (v + high[k]) / 2);
    const moved = this.pose ? transformed(this.pose, centre) : centre; // a ball that holds the head as it stands, too
    const away = Math.hypot(...moved.map((v, k) => v - centre[k]));
    return { centre, radius: away + Math.hypot(...low.map((v, k) => (high[k] - v) / 2)), low, high };
  }

  dispose() {
    this.upload?.dispose();
    this.graphics.release(this);
  }
}

const cssOf = ([r, g, b, a]) => `rgb(${255 * r} ${255 * g} ${255 * b} / ${a})`;

/** (s, t) over one window of (u, v) -> that over another: times the first two, plus the last two. @returns {number[]} */
function toWindow([u0, u1, v0, v1], [wu0, wu1, wv0, wv1]) {
  const [height, width] = [wu1 - wu0, wv1 - wv0];
  return [(v1 - v0) / width, (u1 - u0) / height, (v0 - wv0) / width, (wu1 - u1) / height];
}

/** From warm (outermost) to cold (innermost). Lines are one pixel wide, in a finer picture less. @returns {number[]} RGBA */
function wireColour(index, count, side) {
  const hue = 0.08 + (0.5 * index) / Math.max(1, count - 1);
  const channel = (n) => {
    const k = (n + 12 * hue) % 12;
    return 0.62 - 0.85 * 0.38 * Math.max(-1, Math.min(k - 3, 9 - k, 1)); // HSL: saturation 0.85, lightness 0.62
  };
  return [channel(0), channel(8), channel(4), 0.35 * side];
}
