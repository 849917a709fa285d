// Opens a GLB in Google's model-viewer, with its own lights, tone mapping and order; the camera alone is set.
import "@google/model-viewer";

const DEGREES = 180 / Math.PI;

/** Pictures (PNG, base64) of the GLB from upright cameras that look at the origin, all of one size, the subject looking to +x. */
window.show = async (file, cameras, background) => {
  const { width, height, K } = cameras[0];
  const orbits = cameras.map(({ w2c }) => {
    const [x, y, z] = [0, 1, 2].map((column) => -w2c.reduce((sum, row) => sum + row[column] * row[3], 0));
    const radius = Math.hypot(x, y, z);
    return `${Math.atan2(y, x) * DEGREES}deg ${Math.acos(z / radius) * DEGREES}deg ${radius}m`;
  });
  const viewer = document.createElement("model-viewer");
  viewer.style.cssText = `width: ${width}px; height: ${height}px; --poster-color: transparent`;
  const attributes = {
    src: file,
    "camera-target": "0m 0m 0m",
    "camera-orbit": orbits[0],
    "min-camera-orbit": "-Infinity 0deg 0.01m",
    "max-camera-orbit": "Infinity 180deg 100m",
    "field-of-view": `${2 * Math.atan(height / 2 / K[1][1]) * DEGREES}deg`,
    "min-field-of-view": "1deg",
    "max-field-of-view": "120deg",
    "interaction-prompt": "none",
  };
  for (const [name, value] of Object.entries(attributes)) viewer.setAttribute(name, value);
  const loaded = new Promise((done, failed) => {
    viewer.addEventListener("load", done);
    viewer.addEventListener("error", ({ detail }) => failed(new Error(JSON.stringify(detail))));
  });
  document.body.append(viewer);
  await loaded;
  const pictures = [];
  for (const orbit of orbits) {
    viewer.cameraOrbit = orbit;
    await viewer.updateComplete;
    viewer.jumpCameraToGoal();
    await viewer.updateComplete;
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const shown = new Image();
    shown.src = viewer.toDataURL();
    await shown.decode();
    pictures.push(over(shown, background, width, height));
  }
  return pictures;
};

function over(picture, background, width, height) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  context.fillStyle = background;
  context.fillRect(0, 0, width, height);
  context.drawImage(picture, 0, 0, width, height);
  return canvas.toDataURL("image/png").split(",")[1];
}
