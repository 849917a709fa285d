/**
 * One WebGL 2 context for all players of a page: browsers allow about sixteen, and take the oldest away. It draws on a
 * canvas that nobody sees, from which each player copies its part. It is given back when the last player goes.
 */
import { PlayerError } from "../errors.js";
import { MEANS_FRAGMENT, MEANS_VERTEX } from "../shaders.js";
import { Target } from "./target.js";

const ATTRIBUTES = { alpha: true, premultipliedAlpha: true, antialias: false, depth: true, stencil: false };

/** Rays along each side of a pixel: docs/reference/asset-format.md, "The pixel filter". */
export const SIDE = 2;
const MOST = 1 << 24; // pixels of the finer picture: 128 MiB with its depth

let shared = null;

/** Events: "lost", "restored". */
export class Graphics extends EventTarget {
  /** @returns {Graphics} the page's own; to be given back with `release` @throws {PlayerError} if there is no WebGL 2 */
  static acquire() {
    shared ??= new Graphics();
    ++shared.users;
    return shared;
  }

  constructor() {
    super();
    this.canvas = document.createElement("canvas");
    this.users = 0;
    this.sizes = new Map(); // user -> [width, height] of its picture
    this.programs = new Map();
    this.finer = null; // SIDE times as large as the canvas; false: this machine cannot
    this.lost = false;
    this.gl = this.canvas.getContext("webgl2", { ...ATTRIBUTES, powerPreference: "high-performance" });
    if (!this.gl) {
      throw new PlayerError("This browser offers no WebGL 2", {
        kind: "webgl",
        remedy: "Switch on hardware acceleration in the browser's settings, update the browser, or use another one.",
      });
    }
    this.listening = new AbortController();
    const { signal } = this.listening;
    this.canvas.addEventListener(
      "webglcontextlost",
      (event) => {
        event.preventDefault();
        this.lost = true;
        this.programs.clear();
        this.finer = null;
        this.dispatchEvent(new Event("lost"));
      },
      { signal },
    );
    this.canvas.addEventListener(
      "webglcontextrestored",
      () => {
        this.lost = false;
        this.dispatchEvent(new Event("restored"));
      },
      { signal },
    );
  }

  get maxTextureSize() {
    return this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE);
  }

  /** Makes the canvas large enough for all. @param {object} user @param {number[]} size pixels; [0, 0]: no longer */
  claim(user, size) {
    if (size[0]) this.sizes.set(user, size);
    else this.sizes.delete(user);
    const [width, height] = [0, 1].map((i) => Math.max(1, ...Array.from(this.sizes.values(), (other) => other[i])));
    if (this.canvas.width === width && this.canvas.height === height) return;
    Object.assign(this.canvas, { width, height });
    if (this.finer) this.finer.dispose();
    this.finer = null;
  }

  /** Whether a picture of that many pixels can be drawn SIDE times as large. */
  allows(width, height) {
    const { gl } = this;
    const longest = Math.min(...[gl.MAX_RENDERBUFFER_SIZE, gl.MAX_TEXTURE_SIZE].map((name) => gl.getParameter(name)));
    return SIDE * Math.max(width, height) <= longest && SIDE * SIDE * width * height <= MOST;
  }

  /** @returns {Target | null} SIDE times as large as the canvas, shared by all players; null: this machine cannot */
  get fine() {
    const { width, height } = this.canvas;
    if (this.finer === null) {
      const finer = this.allows(width, height) ? new Target(this.gl, SIDE * width, SIDE * height) : null;
      this.finer = finer?.whole ? finer : false;
      if (!this.finer) finer?.dispose();
    }
    return this.finer || null;
  }

  /**
   * Means over SIDE x SIDE pixels. @param {Target} fine from its lower left corner on
   * @param {WebGLFramebuffer | null} framebuffer null: the canvas
   */
  average(fine, framebuffer, width, height) {
    const { gl } = this;
    const { program, at } = this.program(MEANS_VERTEX, MEANS_FRAGMENT);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, 0, width, height);
    for (const part of [gl.DEPTH_TEST, gl.BLEND]) gl.disable(part);
    gl.colorMask(true, true, true, true);
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, fine.texture);
    gl.uniform1i(at.fine, 0);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  release(user) {
    this.claim(user, [0, 0]);
    if (--this.users > 0) return;
    this.listening.abort();
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    if (shared === this) shared = null;
  }

  /** @param {string} vertex @param {string} fragment sources @returns {{program: WebGLProgram, at: object}} */
  program(vertex, fragment) {
    const key = vertex + fragment;
    if (!this.programs.has(key)) this.programs.set(key, link(this.gl, vertex, fragment));
    return this.programs.get(key);
  }
}

function link(gl, ...sources) {
  const program = gl.createProgram();
  [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((type, i) => {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, sources[i]);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader); // kept by the program
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const [vertex, fragment] = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`a shader was refused: ${gl.getProgramInfoLog(program)} ${vertex} ${fragment}`);
  }
  const at = {};
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; ++i) {
    const { name } = gl.getActiveUniform(program, i);
    at[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}
