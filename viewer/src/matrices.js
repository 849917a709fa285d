/** The few 4 x 4 matrices that a picture needs: arrays of 16 numbers, column by column, as WebGL takes them. */

/** @typedef {number[]} Matrix */

/** @param {number[][]} rows four of four @returns {Matrix} */
export const fromRows = (rows) => [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column]));

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** @param {Matrix} m @param {number[]} p @returns {number[]} the first three coordinates of m (p, 1) */
export const transformed = (m, [x, y, z]) => [0, 1, 2].map((i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);

/** Where the camera of a view matrix (a rotation and a shift) stands. @param {Matrix} m @returns {number[]} */
export const eyeOf = (m) => [0, 4, 8].map((i) => -(m[i] * m[12] + m[i + 1] * m[13] + m[i + 2] * m[14]));

/** World to camera, OpenGL's axes. @param {number[]} right @param {number[]} up @param {number[]} back unit vectors */
export function viewFrom(right, up, back, position) {
  const row = (axis) => [...axis, -(axis[0] * position[0] + axis[1] * position[1] + axis[2] * position[2])];
  return fromRows([row(right), row(up), row(back), [0, 0, 0, 1]]);
}

/** @param {Matrix} m a rotation and a shift @returns {Matrix} */
export const inverseOf = (m) => {
  const [x, y, z] = eyeOf(m);
  return [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, x, y, z, 1];
};

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b @returns {Matrix} a b */
export const multiplied = (a, b) =>
  Array.from({ length: 16 }, (_, i) =>
    [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * (i >> 2) + k], 0),
  );
