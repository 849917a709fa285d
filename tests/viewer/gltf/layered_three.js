// Opens a GLB with EXT_layered_volumetric_video in three.js, with the plugin registered as its file says.
import * as THREE from "three";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { projectionOf, viewOf } from "../../../viewer/src/camera.js";
import { LayeredVolumetricVideo } from "../../../viewer/gltf/three.js";

const TO_Y_UP = new THREE.Matrix4().set(0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1); // (x, y, z) -> (y, z, x)

async function opened(file) {
  const loader = new GLTFLoader();
  loader.setDRACOLoader(new DRACOLoader().setDecoderPath("draco/"));
  loader.register((parser) => new LayeredVolumetricVideo(parser));
  return loader.loadAsync(file);
}

/** Pictures (PNG, base64) of a frame from cameras of the asset, all of one size. */
window.show = async (file, cameras, background, frame) => {
  const { scene, userData } = await opened(file);
  await userData.volumetricVideos[0].seek(frame);
  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.setSize(cameras[0].width, cameras[0].height, false);
  renderer.setClearColor(new THREE.Color(background), 1);
  const pictures = cameras.map((given) => {
    const camera = new THREE.Camera();
    camera.projectionMatrix.fromArray(projectionOf(given, given.width, given.height, 0.01, 10));
    camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    const place = new THREE.Matrix4().fromArray(viewOf(given.w2c)).invert().premultiply(TO_Y_UP);
    place.decompose(camera.position, camera.quaternion, camera.scale);
    renderer.render(scene, camera);
    return renderer.domElement.toDataURL("image/png").split(",")[1];
  });
  userData.volumetricVideos[0].dispose();
  renderer.dispose();
  return pictures;
};

/** The frames that a video that plays shows until it has shown some. */
window.play = async (file) => {
  const { userData } = await opened(file);
  const [face] = userData.volumetricVideos;
  const seen = new Set();
  face.video.playbackRate = 0.0625; // a busy machine draws few pictures a second: each frame lasts for some
  await face.video.play();
  const end = performance.now() + 20000;
  while (seen.size < 3 && performance.now() < end) {
    seen.add(face.frame);
    await new Promise((done) => requestAnimationFrame(done));
  }
  face.dispose();
  return [...seen];
};

/** Bytes of sound that were decoded once it plays. */
window.sound = async (file) => {
  const { userData } = await opened(file);
  const [face] = userData.volumetricVideos;
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
  const { scene, userData } = await opened(file);
  let meshes = 0;
  scene.traverse((one) => (meshes += one.isMesh ? 1 : 0));
  return { said, meshes, videos: userData.volumetricVideos.length };
};
