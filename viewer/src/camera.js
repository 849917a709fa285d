/** Cameras: the captures' K and w2c (OpenCV axes, docs/reference/conventions.md) to OpenGL's matrices, and the orbit. */
import { fromRows, viewFrom } from "./matrices.js";

/**
 * OpenGL's projection of a pinhole camera whose image is fitted into a canvas, whole and centred.
 * @param {{K: number[][], width: number, height: number}} camera pixel centres at (i + 0.5, j + 0.5)
 * @param {number} width of the canvas
 * @param {number} height of the canvas
 * @returns {import("./matrices.js").Matrix}
 */
export function projectionOf({ K, width: w, height: h }, width, height, near, far) {
  const fit = fitted(w, h, width, height);
  const [[fx, skew, cx], [, fy, cy]] = K;
  const s = fit.scale;
  // Image pixels -> canvas pixels -> clip coordinates; the camera looks along -z, y is up.
  const a = (2 * s) / width;
  const b = (2 * s) / height;
  return fromRows([
    [a * fx, -a * skew, 1 - a * cx - (2 * fit.x) / width, 0],
    [0, b * fy, b * cy + (2 * fit.y) / height - 1, 0],
    [0, 0, (near + far) / (near - far), (2 * near * far) / (near - far)],
    [0, 0, -1, 0],
  ]);
}

/** Where an image of w x h lies in a canvas of W x H that shows it whole: {x, y, scale}. */
export function fitted(w, h, W, H) {
  const scale = Math.min(W / w, H / h);
  return { x: (W - scale * w) / 2, y: (H - scale * h) / 2, scale };
}

/** OpenGL's view matrix of w2c (3 x 4 by rows, OpenCV axes). */
export function viewOf(w2c) {
  const [x, y, z] = w2c;
  return fromRows([x, y.map((v) => -v), z.map((v) => -v), [0, 0, 0, 1]]);
}

const DEGREES = 180 / Math.PI;

/**
 * @typedef {{azimuth: number, elevation: number, distance: number, target: number[]}} Orbit degrees; azimuth from +x
 *   (before the subject) to +y (its left)
 */

/** Axes of the camera of an orbit. @param {Orbit} orbit @returns {{right: number[], up: number[], back: number[]}} */
export function axesOf({ azimuth, elevation }) {
  const [a, e] = [azimuth / DEGREES, elevation / DEGREES];
  const [ca, sa, ce, se] = [Math.cos(a), Math.sin(a), Math.cos(e), Math.sin(e)];
  return { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], back: [ce * ca, ce * sa, se] };
}

/** Where the camera of an orbit stands. @param {Orbit} orbit @returns {number[]} */
export function positionOf(orbit) {
  const { back } = axesOf(orbit);
  return back.map((v, i) => orbit.target[i] + orbit.distance * v);
}

/** OpenGL's view matrix of an orbit. @param {Orbit} orbit */
export function orbitView(orbit) {
  const { right, up, back } = axesOf(orbit);
  return viewFrom(right, up, back, positionOf(orbit));
}

/**
 * From where a box fills a picture in a direction, and no more.
 * @param {{low: number[], high: number[]}} box @param {{azimuth: number, elevation: number}} direction
 * @param {[number, number]} slopes of what the picture shows to each side and up, a unit away
 * @returns {{distance: number, target: number[]}}
 */
export function framing({ low, high }, direction, [across, tall]) {
  const { right, up, back } = axesOf(direction);
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? high[i] : low[i])));
  const along = (axis) => corners.map((corner) => corner.reduce((sum, v, i) => sum + v * axis[i], 0));
  const towards = along(back);
  const middle = (Math.min(...towards) + Math.max(...towards)) / 2;
  // A corner at r along the picture and b towards the eye is inside where |r - t| <= slope * (distance - b).
  const distanceOf = (axis, slope) => {
    const end = (sign) => Math.max(...along(axis).map((r, i) => sign * r + slope * (towards[i] - middle)));
    return (end(1) + end(-1)) / 2 / slope;
  };
  const distance = Math.max(distanceOf(right, across), distanceOf(up, tall));
  const centred = (axis) => {
    let t = 0;
    for (let k = 0; k < 8; ++k) {
      const seen = along(axis).map((r, i) => (r - t) / (distance + middle - towards[i]));
      t += ((Math.min(...seen) + Math.max(...seen)) / 2) * distance;
    }
    return t;
  };
  const [x, y] = [centred(right), centred(up)];
  return { distance, target: back.map((v, i) => middle * v + x * right[i] + y * up[i]) };
}
