/**
 * Draws the layers of one level: innermost first, ordinary blending, each layer's nearest sheet only.
 *
 * Each layer has its own slice of the depth range, nearer than those of the layers inside it. So it never hides or is
 * hidden by another layer, and its own folds count once: a pass to depth alone, then colour where the depth is equal.
 * Stored values are blended as they are: no colour management, no tone mapping, no sRGB textures.
 */
import * as THREE from "three";
import { PlayerError } from "./errors.js";
import { COLOUR_FRAGMENT, DEPTH_FRAGMENT, VERTEX, WIRE_FRAGMENT } from "./shaders.js";

THREE.ColorManagement.enabled = false;

const SPREAD = { step: 0.35, all: 3.3 }; // units from layer to layer when fully pulled apart, and at most from end to end

export class LayerRenderer {
  /** @param {HTMLCanvasElement} canvas @throws {PlayerError} if there is no WebGL 2 */
  constructor(canvas) {
    const attributes = { alpha: true, premultipliedAlpha: true, antialias: false, depth: true, stencil: false };
    const context = canvas.getContext("webgl2", { ...attributes, powerPreference: "high-performance" });
    if (!context) {
      throw new PlayerError("This browser offers no WebGL 2", {
        kind: "webgl",
        remedy: "Switch on hardware acceleration in the browser's settings, update the browser, or use another one.",
      });
    }
    this.three = new THREE.WebGLRenderer({ canvas, context, ...attributes });
    this.three.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.three.toneMapping = THREE.NoToneMapping;
    this.three.autoClear = true;
    this.scene = new THREE.Scene();
    this.scene.matrixWorldAutoUpdate = false;
    this.scene.onAfterRender = () => this.three.getContext().depthRange(0, 1);
    this.level = null;
    this.layers = [];
    this.effectsOn = true;
    this.wireframe = false;
    this.spread = 0;
    this.setBackground([0, 0, 0, 1]);
  }

  get maxTextureSize() {
    return this.three.capabilities.maxTextureSize;
  }

  /** @param {number[]} rgba in [0, 1]; alpha 0 lets the page shine through */
  setBackground([r, g, b, a]) {
    this.background = [r, g, b, a];
    this.three.setClearColor(new THREE.Color(r, g, b), a);
  }

  /** After a lost context came back: three uploads all again by itself, but forgets the background. */
  restore() {
    this.setBackground(this.background);
  }

  /**
   * Shows another level from the next picture on; the textures of the old one are set free by the level's owner.
   * @param {import("./levels.js").LoadedLevel} level
   */
  setLevel(level) {
    this.scene.clear();
    for (const layer of this.layers) for (const mesh of layer.meshes) mesh.material.dispose();
    this.level = level;
    const count = level.info.layers.length;
    this.layers = level.info.layers.map((info, i) => this.#makeLayer(level, info, i, count));
    this.#place();
  }

  #makeLayer(level, info, index, count) {
    const [cx, cy] = level.info.texture.colourRect;
    const [ax, ay] = level.info.texture.alphaRect;
    const [x, y, w, h] = info.rect;
    const shared = { shift: { value: new THREE.Vector3() }, eye: { value: new THREE.Vector3() } };
    const colour = {
      ...shared,
      picture: { value: level.texture },
      colourRect: { value: new THREE.Vector4(cx + x, cy + y, w, h) },
      alphaOffset: { value: new THREE.Vector2(ax - cx, ay - cy) },
    };
    if (level.effects) {
      const [ex, ey, ew, eh] = info.effectsRect;
      colour.effects = { value: level.effects };
      colour.planes = {
        value: level.info.effects.planes.map(([px, py]) => new THREE.Vector4(px + ex, py + ey, ew, eh)),
      };
      colour.effectsScale = { value: level.info.effects.scale };
    }
    if (level.reflection) Object.assign(colour, reflectionUniforms(level, info, shared.eye));
    const slice = [(index + 0.05) / count, (index + 0.95) / count];
    const pass = (uniforms, fragmentShader, options, order) => {
      const material = new THREE.ShaderMaterial({
        ...{ glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader, uniforms },
        ...{ side: THREE.DoubleSide, transparent: true, forceSinglePass: true, toneMapped: false, ...options },
      });
      const mesh = new THREE.Mesh(level.geometries[index], material);
      mesh.frustumCulled = false;
      mesh.renderOrder = 3 * (count - index) + order;
      mesh.onBeforeRender = () => this.three.getContext().depthRange(...slice);
      this.scene.add(mesh);
      return mesh;
    };
    const depth = { depthFunc: THREE.LessDepth, depthWrite: true, colorWrite: false, blending: THREE.NoBlending };
    const equal = { depthFunc: THREE.EqualDepth, depthWrite: false, blending: THREE.NormalBlending };
    const defines = { ...(level.effects && { EFFECTS: 1 }), ...(level.reflection && { REFLECTION: 1 }) };
    const meshes = [pass(shared, DEPTH_FRAGMENT, depth, 0), pass(colour, COLOUR_FRAGMENT, { ...equal, defines }, 1)];
    const wire = { ...shared, wire: { value: wireColour(index, count) } };
    const lines = { depthTest: false, depthWrite: false, wireframe: true };
    meshes.push(pass(wire, WIRE_FRAGMENT, lines, 2));
    return { meshes, shared, colour, visible: true };
  }

  /** @param {boolean[]} visible one a layer, outermost first */
  setVisible(visible) {
    this.layers.forEach((layer, i) => (layer.visible = visible[i] ?? true));
    this.#place();
  }

  /** @param {number} spread 0: as they are; 1: fully pulled apart, along the subject's forward axis */
  setSpread(spread) {
    this.spread = spread;
    this.#place();
  }

  setWireframe(on) {
    this.wireframe = on;
    this.#place();
  }

  setEffects(on) {
    this.effectsOn = on;
    this.#place();
  }

  #place() {
    const middle = (this.layers.length - 1) / 2;
    const step = this.spread * Math.min(SPREAD.step, SPREAD.all / (2 * middle || 1));
    this.layers.forEach((layer, i) => {
      layer.shared.shift.value.set(step * (middle - i), 0, 0);
      layer.meshes.forEach((mesh, pass) => (mesh.visible = layer.visible && (pass < 2 || this.wireframe)));
      if (layer.colour.effectsScale)
        layer.colour.effectsScale.value = this.effectsOn ? this.level.info.effects.scale : 0;
      if (layer.colour.reflectionScales)
        layer.colour.reflectionScales.value.fromArray(this.effectsOn ? this.level.info.reflection.scales : [0, 0, 0]);
    });
  }

  /** Draws to the canvas. @param {THREE.Matrix4} projection @param {THREE.Matrix4} view world to camera, OpenGL's axes */
  draw(projection, view) {
    const camera = new THREE.Camera();
    camera.matrixWorldAutoUpdate = false;
    camera.projectionMatrix.copy(projection);
    camera.projectionMatrixInverse.copy(projection).invert();
    camera.matrixWorldInverse.copy(view);
    camera.matrixWorld.copy(view).invert();
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
    for (const { shared } of this.layers) shared.eye.value.copy(eye).sub(shared.shift.value);
    this.three.render(this.scene, camera);
  }

  /**
   * Draws into a picture of its own instead of the canvas, by the same passes.
   * @returns {ImageData} top row first; premultiplied where the background is transparent
   */
  capture(projection, view, width, height) {
    const target = new THREE.WebGLRenderTarget(width, height, { depthBuffer: true, colorSpace: THREE.NoColorSpace });
    const data = new Uint8ClampedArray(4 * width * height);
    try {
      this.three.setRenderTarget(target);
      this.draw(projection, view);
      this.three.readRenderTargetPixels(target, 0, 0, width, height, data);
    } finally {
      this.three.setRenderTarget(null);
      target.dispose();
    }
    const row = 4 * width;
    const upright = new Uint8ClampedArray(data.length);
    for (let y = 0; y < height; ++y) upright.set(data.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
    return new ImageData(upright, width, height);
  }

  /** Sphere around the layers as they stand. @returns {THREE.Sphere} */
  bounds() {
    const box = new THREE.Box3();
    this.layers.forEach((layer, i) => {
      if (!layer.visible) return;
      const geometry = this.level.geometries[i];
      geometry.boundingBox ?? geometry.computeBoundingBox();
      box.union(geometry.boundingBox.clone().translate(layer.shared.shift.value));
    });
    return box.isEmpty() ? new THREE.Sphere(new THREE.Vector3(), 1) : box.getBoundingSphere(new THREE.Sphere());
  }

  dispose() {
    this.scene.clear();
    this.three.dispose();
  }
}

/** What the shader needs of a level's reflection, for one of its layers. */
function reflectionUniforms(level, layer, eye) {
  const { environment, gloss, offset, normals, window, scales } = level.info.reflection;
  const [u0, u1, v0, v1] = layer.window;
  const [mu0, mu1, mv0, mv1] = window;
  const rect = (values) => ({ value: new THREE.Vector4(...values) });
  return {
    reflection: { value: level.reflection },
    ...{
      environmentRect: rect(environment),
      glossRect: rect(gloss),
      offsetRect: rect(offset),
      normalsRect: rect(normals),
    },
    reflectionScales: { value: new THREE.Vector3(...scales) },
    toMaps: rect([
      (v1 - v0) / (mv1 - mv0),
      (u1 - u0) / (mu1 - mu0),
      (v0 - mv0) / (mv1 - mv0),
      (mu1 - u1) / (mu1 - mu0),
    ]),
    viewer: eye,
  };
}

/** From warm (outermost) to cold (innermost). */
function wireColour(index, count) {
  const colour = new THREE.Color().setHSL(0.08 + (0.5 * index) / Math.max(1, count - 1), 0.85, 0.62);
  return new THREE.Vector4(colour.r, colour.g, colour.b, 0.35);
}
