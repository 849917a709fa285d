/**
 * One WebGL 2 context for all players of a page: browsers allow about sixteen, and take the oldest away. It draws on a
 * canvas that nobody sees, from which each player copies its part. It is given back when the last player goes.
 */
import { PlayerError } from "../errors.js";

const ATTRIBUTES = { alpha: true, premultipliedAlpha: true, antialias: false, depth: true, stencil: false };

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
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
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
