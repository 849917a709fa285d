// Pictures of a GLB in Babylon.js, in its own left-handed axes, as its examples open one, but with exact colours.
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Scene } from "@babylonjs/core/scene.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Matrix, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { DracoDecoder } from "@babylonjs/core/Meshes/Compression/dracoDecoder.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { projectionOf } from "../../../viewer/src/camera.js";

const at = (name) => new URL(`draco/${name}`, document.baseURI).href;
DracoDecoder.DefaultConfiguration = {
  wasmUrl: at("draco_wasm_wrapper.js"),
  wasmBinaryUrl: at("draco_decoder.wasm"),
};

export async function opened(file, width, height) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const engine = new Engine(canvas, false, { preserveDrawingBuffer: true, useExactSrgbConversions: true });
  const scene = new Scene(engine);
  scene.activeCamera = new FreeCamera("camera", Vector3.Zero(), scene);
  const { meshes } = await ImportMeshAsync(file, scene);
  for (const texture of scene.textures) texture.anisotropicFilteringLevel = 1; // the format's sampler knows of none
  return { canvas, engine, scene, meshes };
}

/** The asset's point in the scene: (x, y, z) -> glTF's (y, z, x) -> Babylon's, in which glTF's x is turned round. */
const placed = ([x, y, z]) => new Vector3(-y, z, x);

/** Pictures (PNG, base64) from cameras of the asset, all of one size and upright. */
export async function shown({ canvas, engine, scene }, cameras, background) {
  const { width, height } = cameras[0];
  scene.clearColor = Color4.FromHexString(`${background}ff`);
  scene.render(); // asks for what is only then compiled
  await scene.whenReadyAsync();
  const camera = scene.activeCamera;
  const pictures = cameras.map((given) => {
    const [, , forward] = given.w2c.map((row) => row.slice(0, 3));
    const eye = [0, 1, 2].map((column) => -given.w2c.reduce((sum, row) => sum + row[column] * row[3], 0));
    camera.position = placed(eye);
    camera.setTarget(placed(eye.map((value, i) => value + forward[i])));
    const projection = projectionOf(given, width, height, 0.01, 10);
    for (let i = 8; i < 12; i++) projection[i] *= -1; // it looks along +z
    camera.freezeProjectionMatrix(Matrix.FromArray(projection));
    scene.render();
    return canvas.toDataURL("image/png").split(",")[1];
  });
  engine.dispose();
  return pictures;
}
