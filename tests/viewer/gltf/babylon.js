// Opens a GLB as Babylon.js' own examples do.
import { opened, shown } from "./babylon_pictures.js";

window.show = async (file, cameras, background) =>
  shown(await opened(file, cameras[0].width, cameras[0].height), cameras, background);
