// Opens a GLB with EXT_layered_volumetric_video in Babylon.js, in its own left-handed axes, as its examples do.
import { registerLayeredVolumetricVideo } from "../../../viewer/gltf/babylon.js";
import { opened, shown } from "./babylon_pictures.js";
import { framesOf, soundOf, warnings } from "./video.js";

registerLayeredVolumetricVideo();

const videosOf = (scene) => scene.metadata?.volumetricVideos ?? [];

window.show = async (file, cameras, background, frame) => {
  const { width, height } = cameras[0];
  const one = await opened(file, width, height);
  await videosOf(one.scene)[0].seek(frame);
  return shown(one, cameras, background);
};

/** What is done with a file's first video. */
async function withVideo(file, act) {
  const { engine, scene } = await opened(file, 64, 64);
  const found = await act(videosOf(scene)[0]);
  engine.dispose();
  return found;
}

window.play = (file) => withVideo(file, framesOf);
window.sound = (file) => withVideo(file, soundOf);

/** What is said of a GLB whose video cannot be decoded, and how many meshes show it. */
window.fallback = async (file) => {
  const said = warnings();
  const { engine, scene, meshes } = await opened(file, 64, 64);
  const drawn = meshes.filter((one) => one.geometry).length;
  engine.dispose();
  return { said, meshes: drawn, videos: videosOf(scene).length };
};
