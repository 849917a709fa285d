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

const at = (name) => new URL(`draco/${name}`, document.baseURI).href;
DracoDecoder.DefaultConfiguration = {
  wasmUrl: at("draco_wasm_wrapper.js"),
  wasmBinaryUrl: at("draco_decoder.wasm"),
};
registerLayeredVolumetricVideo();

async function opened(file, width = 64, height = 64) {
  const canvas = Object.assign(document.createElement("canvas"), {
    width,
    height,
  });
  const engine = new Engine(canvas, false, { preserveDrawingBuffer: true });
  const scene = new Scene(engine);
  scene.activeCamera = new FreeCamera("camera", Vector3.Zero(), scene);
  const { meshes } = await ImportMeshAsync(file, scene);
  return {
    canvas,
    engine,
    scene,
    meshes,
    videos: scene.metadata?.volumetricVideos ?? [],
  };
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
    const eye = [0, 1, 2].map(
      (column) =>
        -given.w2c.reduce((sum, row) => sum + row[column] * row[3], 0),
    );
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

/** The frames that a video that plays shows until it has shown some. */
window.play = async (file) => {
  const { engine, videos } = await opened(file);
  const [face] = videos;
  const seen = new Set();
  face.video.playbackRate = 0.0625; // a busy machine draws few pictures a second: each frame lasts for some
  await face.video.play();
  const end = performance.now() + 20000;
  while (seen.size < 3 && performance.now() < end) {
    seen.add(face.frame);
    await new Promise((done) => requestAnimationFrame(done));
  }
  face.dispose();
  engine.dispose();
  return [...seen];
};

/** Bytes of sound that were decoded once it plays. */
window.sound = async (file) => {
  const { videos } = await opened(file);
  const [face] = videos;
  face.video.muted = false;
  await face.video.play();
  const end = performance.now() + 20000;
  while (!face.video.webkitAudioDecodedByteCount && performance.now() < end)
    await new Promise((done) => requestAnimationFrame(done));
  const found = face.video.webkitAudioDecodedByteCount;
  face.dispose();
  return found;
};

/** What is said of a GLB whose video cannot be decoded, and how many meshes show it. */
window.fallback = async (file) => {
  const said = [];
  console.warn = (words) => said.push(words);
  const { engine, meshes, videos } = await opened(file);
  const found = {
    said,
    meshes: meshes.filter((one) => one.geometry).length,
    videos: videos.length,
  };
  engine.dispose();
  return found;
};
