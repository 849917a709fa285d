// Opens a GLB with EXT_layered_volumetric_video in Babylon.js, in its own left-handed axes, as its examples do.
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Scene } from "@babylonjs/core/scene.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Matrix, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { DracoDecoder } from "@babylonjs/core/Meshes/Compression/dracoDecoder.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { projectionOf } from "../../../viewer/src/camera.js";
import { registerLayeredVolumetricVideo } from "../../../viewer/gltf/babylon.js";
import { framesOf, soundOf, warnings } from "./video.js";

const at = (name) => new URL(`draco/${name}`, document.baseURI).href;
DracoDecoder.DefaultConfiguration = {
  wasmUrl: at("draco_wasm_wrapper.js"),
  wasmBinaryUrl: at("draco_decoder.wasm"),
};
registerLayeredVolumetricVideo();

async function opened(file, width = 64, height = 64) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const engine = new Engine(canvas, false, { preserveDrawingBuffer: true });
  const scene = new Scene(engine);
  scene.activeCamera = new FreeCamera("camera", Vector3.Zero(), scene);
  const { meshes } = await ImportMeshAsync(file, scene);
  return { canvas, engine, scene, meshes, videos: scene.metadata?.volumetricVideos ?? [] };
}

/** The asset's point in the scene: (x, y, z) -> glTF's (y, z, x) -> Babylon's, in which glTF's x is turned round. */
const placed = ([x, y, z]) => new Vector3(-y, z, x);

/** Pictures (PNG, base64) of a frame from cameras of the asset, all of one size and upright. */
window.show = async (file, cameras, background, frame) => {
  const { width, height } = cameras[0];
  const { canvas, engine, scene, videos } = await opened(file, width, height);
  scene.clearColor = Color4.FromHexString(`${background}ff`);
  await videos[0].seek(frame);
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
};

/** What is done with a file's first video. */
async function withVideo(file, act) {
  const { engine, videos } = await opened(file);
  const found = await act(videos[0]);
  engine.dispose();
  return found;
}

window.play = (file) => withVideo(file, framesOf);
window.sound = (file) => withVideo(file, soundOf);

/** What is said of a GLB whose video cannot be decoded, and how many meshes show it. */
window.fallback = async (file) => {
  const said = warnings();
  const { engine, meshes, videos } = await opened(file);
  const shown = meshes.filter((one) => one.geometry).length;
  engine.dispose();
  return { said, meshes: shown, videos: videos.length };
};
