/** Cameras: the captures' K and w2c (OpenCV axes, docs/reference/conventions.md) to OpenGL's matrices, and the orbit's angles. */
import { Matrix4, Vector3 } from "three";

/**
 * OpenGL's projection of a pinhole camera whose image is fitted into a canvas, whole and centred.
 * @param {{K: number[][], width: number, height: number}} camera pixel centres at (i + 0.5, j + 0.5)
 * @param {number} width of the canvas
 * @param {number} height of the canvas
 * @returns {Matrix4}
 */
export function projectionOf({ K, width: w, height: h }, width, height, near, far) {
  const fit = fitted(w, h, width, height);
  const [[fx, skew, cx], [, fy, cy]] = K;
  const s = fit.scale;
  // Image pixels -> canvas pixels -> clip coordinates; the camera looks along -z, y is up.
  const a = (2 * s) / width;
  const b = (2 * s) / height;
  return new Matrix4().set(
    a * fx, -a * skew, 1 - a * cx - (2 * fit.x) / width, 0,
    0, b * fy, b * cy + (2 * fit.y) / height - 1, 0,
    0, 0, (near + far) / (near - far), (2 * near * far) / (near - far),
    0, 0, -1, 0,
  ); // prettier-ignore
}

/** Where an image of w x h lies in a canvas of W x H that shows it whole: {x, y, scale}. */
export function fitted(w, h, W, H) {
  const scale = Math.min(W / w, H / h);
  return { x: (W - scale * w) / 2, y: (H - scale * h) / 2, scale };
}

/** OpenGL's view matrix of w2c (3 x 4 by rows, OpenCV axes). */
export function viewOf(w2c) {
  const [x, y, z] = w2c;
  return new Matrix4().set(...x, ...y.map((v) => -v), ...z.map((v) => -v), 0, 0, 0, 1);
}

const DEGREES = 180 / Math.PI;

/**
 * The orbit's state as numbers to share.
 * @param {Vector3} position
 * @param {Vector3} target
 * @returns {{azimuth: number, elevation: number, distance: number, target: number[]}} degrees; azimuth from +x to +y
 */
export function orbitOf(position, target) {
  const offset = position.clone().sub(target);
  const distance = offset.length();
  return {
    azimuth: Math.atan2(offset.y, offset.x) * DEGREES,
    elevation: Math.asin(Math.max(-1, Math.min(1, offset.z / distance))) * DEGREES,
    distance,
    target: target.toArray(),
  };
}

/** The inverse of `orbitOf`: the camera's position. */
export function positionOf({ azimuth, elevation, distance, target }) {
  const a = azimuth / DEGREES;
  const e = elevation / DEGREES;
  const direction = new Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
  return direction.multiplyScalar(distance).add(new Vector3(...target));
}
