/** Places on the face by the model's UV map, and back: from a place to a point in space, from a pixel to a place. */
import { fromRows, multiplied } from "./matrices.js";

/**
 * @typedef {import("./meshes.js").Geometry} Geometry
 * @typedef {{point: number[], normal: number[]}} Spot in the meshes' own axes; the normal outwards, of any length
 */

/** @returns {number[] | null} of the three corners in a plane; null: the place is outside of them */
function weightsAt([a, b, c], [x, y]) {
  const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
  const second = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
  const third = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
  const weights = [1 - second - third, second, third];
  return weights.every((weight) => weight >= -1e-6) ? weights : null; // false for NaN, too
}

/** Of values of the corners. */
const mixed = (weights, corners) => corners[0].map((_, i) => weights.reduce((sum, w, k) => sum + w * corners[k][i], 0));

/** Calls `found(corners, weights)` for each triangle that has the place, in the plane that `of` takes a vertex to. */
function eachTriangle({ index }, of, place, found) {
  for (let i = 0; i < index.length; i += 3) {
    const corners = [index[i], index[i + 1], index[i + 2]];
    const weights = weightsAt(corners.map(of), place);
    if (weights) found(corners, weights);
  }
}

/**
 * Where a layer has a place of the UV map. @param {Geometry} geometry
 * @param {number[]} window (u0, u1, v0, v1) of its texture coordinates @param {number[]} place u, v
 * @returns {Spot | null} null: it ends before
 */
export function spotAt(geometry, [u0, u1, v0, v1], [u, v]) {
  const { position, uv } = geometry;
  let spot = null;
  eachTriangle(
    geometry,
    (k) => [uv[2 * k], uv[2 * k + 1]],
    [(v - v0) / (v1 - v0), (u1 - u) / (u1 - u0)],
    (corners, weights) => {
      const [a, b, c] = corners.map((k) => [...position.subarray(3 * k, 3 * k + 3)]);
      const [e, f] = [b, c].map((end) => end.map((x, i) => x - a[i]));
      const normal = [0, 1, 2].map((i) => e[(i + 1) % 3] * f[(i + 2) % 3] - e[(i + 2) % 3] * f[(i + 1) % 3]);
      spot ??= { point: mixed(weights, [a, b, c]), normal };
    },
  );
  return spot;
}

/** @param {number[]} matrix @param {ArrayLike<number>} p @returns {number[]} clip coordinates x / w, y / w and w */
export function projected(m, [x, y, z]) {
  const [a, b, w] = [0, 1, 3].map((i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);
  return [a / w, b / w, w];
}

/** What of a layer is nearest where it is drawn at (x, y) of clip space. @returns {{place: number[], point: number[]} | null} */
function nearestUnder(geometry, [u0, u1, v0, v1], matrix, placed, at) {
  const { position, uv } = geometry;
  const seen = Array.from({ length: position.length / 3 }, (_, k) =>
    projected(matrix, placed(position.subarray(3 * k, 3 * k + 3))),
  );
  let [nearest, hit] = [Infinity, null];
  eachTriangle(
    geometry,
    (k) => seen[k],
    at,
    (corners, weights) => {
      const inverse = corners.map((k, i) => weights[i] / seen[k][2]);
      const away = 1 / inverse.reduce((sum, one) => sum + one);
      if (away < 0 || away > nearest) return;
      nearest = away;
      const parts = inverse.map((one) => one * away);
      const [s, t] = mixed(parts, corners.map((k) => [uv[2 * k], uv[2 * k + 1]])); // prettier-ignore
      const point = mixed(parts, corners.map((k) => [...placed(position.subarray(3 * k, 3 * k + 3))])); // prettier-ignore
      hit = { place: [u1 - t * (u1 - u0), v0 + s * (v1 - v0)], point };
    },
  );
  return hit;
}

/** Of the window, to clip space. @param {HTMLElement} canvas @returns {number[]} */
export function clipOf(canvas, clientX, clientY) {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  return [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
}

/**
 * What lies under a pixel: the layer at which half of the light from behind is stopped, and the place on it.
 * @param {import("./player.js").Player} player @param {number[]} at x, y of clip space
 * @returns {{place: number[], point: number[], layer: number} | null} u, v, and in space, in the meshes' own axes; null:
 * nothing is there that hides more than half
 */
export function surfaceUnder(player, at) {
  const { renderer, level, size } = player;
  const { projection, view } = player.view.matrices(...size, renderer.bounds());
  const [w, h] = size;
  const pixel = multiplied(fromRows([[w, 0, 0, -w * at[0]], [0, h, 0, -h * at[1]], [0, 0, 1, 0], [0, 0, 0, 1]]), projection); // prettier-ignore
  const { kind, visible } = renderer;
  let [layer, through] = [-1, 1];
  renderer.setKind("alpha");
  while (through > 0.5 && ++layer < visible.length) {
    if (!visible[layer]) continue;
    renderer.setVisible(visible.map((_, i) => i === layer));
    through *= 1 - renderer.capture(pixel, view, 1, 1).data[0] / 255;
  }
  renderer.setKind(kind);
  renderer.setVisible(visible);
  if (layer === visible.length) return null;
  const matrix = multiplied(projection, renderer.pose ? multiplied(view, renderer.pose) : view);
  const hit = nearestUnder(
    level.geometries[layer],
    level.info.layers[layer].window,
    matrix,
    (p) => renderer.placed(p),
    at,
  );
  return hit && { ...hit, layer };
}
