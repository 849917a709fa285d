// The floor: one opaque textured mesh, a layer of the asset's GLB. ?first=INDEX&count=INDICES of its shell
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { offer, position } from "./common.js";

const [first, count] = ["first", "count"].map((name) => Number(new URLSearchParams(location.search).get(name)));
const renderer = new THREE.WebGLRenderer({ antialias: false });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const camera = new THREE.PerspectiveCamera(30, innerWidth / innerHeight, 0.01, 10);
const { scene } = await new GLTFLoader().loadAsync("/heads/head.glb");
const meshes = [];
scene.traverse((node) => node.isMesh && meshes.push(node));
meshes.forEach((mesh) => (mesh.visible = mesh.material.transparent));
const shell = meshes.find((mesh) => mesh.visible);
shell.geometry.setDrawRange(first, count);
Object.assign(shell.material, { transparent: false, depthWrite: true });
addEventListener("resize", () => {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
});
const draw = (degrees) => {
  const [x, y, z] = position(degrees);
  camera.position.set(y, z, x); // glTF's axes
  camera.lookAt(0, 0, 0);
  renderer.render(scene, camera);
};
draw(0);
offer(renderer.getContext(), { draw });
