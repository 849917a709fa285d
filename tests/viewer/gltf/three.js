// Opens a GLB as three.js' own examples do.
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { pictures } from "./three_pictures.js";

window.show = async (file, cameras, background) =>
  pictures((await new GLTFLoader().loadAsync(file)).scene, cameras, background);
