// Opens a GLB with EXT_layered_volumetric_video in three.js, with the plugin registered as its file says.
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { LayeredVolumetricVideo } from "../../../viewer/gltf/three.js";
import { pictures } from "./three_pictures.js";
import { framesOf, soundOf, warnings } from "./video.js";

async function opened(file) {
  const loader = new GLTFLoader();
  loader.setDRACOLoader(new DRACOLoader().setDecoderPath("draco/"));
  loader.register((parser) => new LayeredVolumetricVideo(parser));
  const { scene, userData } = await loader.loadAsync(file);
  return { scene, videos: userData.volumetricVideos };
}

window.show = async (file, cameras, background, frame) => {
  const { scene, videos } = await opened(file);
  await videos[0].seek(frame);
  const found = pictures(scene, cameras, background);
  videos[0].dispose();
  return found;
};

window.play = async (file) => framesOf((await opened(file)).videos[0]);
window.sound = async (file) => soundOf((await opened(file)).videos[0]);

/** What is said of a GLB whose video cannot be decoded, and how many meshes show it. */
window.fallback = async (file) => {
  const said = warnings();
  const { scene, videos } = await opened(file);
  let meshes = 0;
  scene.traverse((one) => (meshes += one.isMesh ? 1 : 0));
  return { said, meshes, videos: videos.length };
};
