// A Gaussian-splat player from npm. ?file=NAME
import * as SPLATS from "@mkkellogg/gaussian-splats-3d";
import * as THREE from "three";
import { offer, position } from "./common.js";

const file = new URLSearchParams(location.search).get("file");
const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
renderer.setPixelRatio(1);
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const camera = new THREE.PerspectiveCamera(30, innerWidth / innerHeight, 0.01, 10);
camera.up.set(0, 0, 1);
const look = (degrees) => {
  camera.position.set(...position(degrees));
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
};
const fit = () => {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
};
addEventListener("resize", fit);
look(0);
const viewer = new SPLATS.Viewer({
  ...{ renderer, camera, selfDrivenMode: false, useBuiltInControls: false, ignoreDevicePixelRatio: true },
  sharedMemoryForWorkers: false, // needs headers that a plain static server does not send
  gpuAcceleratedSort: false,
  sceneRevealMode: SPLATS.SceneRevealMode.Instant,
});
await viewer.addSplatScene(`/heads/${file}`, { showLoadingUI: false, progressiveLoad: false });
const draw = (degrees) => {
  look(degrees);
  renderer.autoClear = true;
  viewer.update();
  viewer.render();
};
draw(0);
while (viewer.sortRunning) await new Promise((next) => setTimeout(next, 5));
draw(0);
offer(renderer.getContext(), { draw });
