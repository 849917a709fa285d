// Ours, one mesh with a video and splats at equal bytes, live beside each other: one turn for all.
import "/player/facefolds-player.js";
import * as SPLATS from "@mkkellogg/gaussian-splats-3d";
import * as THREE from "three";

const { panes, target } = await (await fetch("beside.json")).json();
const distance = 0.9;
const SETTLE = 8; // pictures after a turn until the splats are in order: they are sorted in parts
const turn = document.querySelector("input");
const shows = [];

function caption(figure, { name, bytes }) {
  const text = document.createElement("figcaption");
  text.textContent = `${name}: ${Math.round(bytes / 1000).toLocaleString("en")} KB`;
  figure.append(text);
}

function player(figure, { file }) {
  const element = document.createElement("facefolds-player");
  element.setAttribute("src", file);
  element.setAttribute("controls", "none");
  element.setAttribute("autoplay", "");
  element.setAttribute("background", "#808080");
  element.addEventListener(
    "load",
    () => (element.level = element.levels.at(-1)),
  ); // the bytes that are counted
  figure.append(element);
  shows.push((azimuth) =>
    element.player?.view.set({ azimuth, elevation: 0, distance, target }),
  );
  return new Promise((done) =>
    element.addEventListener("ready", done, { once: true }),
  );
}

async function splats(figure, { file }) {
  const canvas = document.createElement("div");
  figure.append(canvas);
  const renderer = new THREE.WebGLRenderer({
    antialias: false,
    preserveDrawingBuffer: true,
  });
  renderer.setClearColor(0x808080);
  renderer.setSize(canvas.clientWidth, canvas.clientHeight);
  canvas.append(renderer.domElement);
  const camera = new THREE.PerspectiveCamera();
  camera.near = 0.01;
  camera.aspect = canvas.clientWidth / canvas.clientHeight;
  camera.up.set(0, 0, 1);
  const viewer = new SPLATS.Viewer({
    renderer,
    camera,
    selfDrivenMode: false,
    useBuiltInControls: false,
    ignoreDevicePixelRatio: true,
    sharedMemoryForWorkers: false, // needs headers that a plain static server does not send
    gpuAcceleratedSort: false,
    sphericalHarmonicsDegree: 1,
    sceneRevealMode: SPLATS.SceneRevealMode.Instant,
  });
  await viewer.addSplatScene(file, {
    showLoadingUI: false,
    progressiveLoad: false,
    splatAlphaRemovalThreshold: 1,
  });
  let left = SETTLE;
  const draw = () => {
    if (left > 0) {
      if (!viewer.sortRunning) left -= 1;
      viewer.update();
      viewer.render();
    }
    requestAnimationFrame(draw);
  };
  shows.push((azimuth) => {
    const { view } = document.querySelector("facefolds-player").player;
    const height = view.size[1] / view.pixelsAUnit; // of its picture at the target: as large as beside
    camera.fov = (360 / Math.PI) * Math.atan(height / (2 * distance));
    camera.updateProjectionMatrix();
    const a = (azimuth * Math.PI) / 180;
    camera.position.set(
      target[0] + distance * Math.cos(a),
      target[1] + distance * Math.sin(a),
      target[2],
    );
    camera.lookAt(...target);
    camera.updateMatrixWorld();
    left = SETTLE;
  });
  draw();
}

const show = () => shows.forEach((one) => one(Number(turn.value)));
turn.addEventListener("input", show);
const main = document.querySelector("main");
await Promise.all(
  panes.map((pane) => {
    const figure = document.createElement("figure");
    main.append(figure);
    const shown =
      pane.kind === "splats" ? splats(figure, pane) : player(figure, pane);
    caption(figure, pane);
    return shown;
  }),
);
show();
document.body.dataset.ready = "yes";
