/** Where the meshes stand in each frame of an asset whose head moves (docs/reference/asset-format.md, "The head's track"). */
import { fromRows } from "./matrices.js";

/**
 * @typedef {{quaternion: [number, number, number, number], translation: [number, number, number]}} Pose w, x, y, z
 * @param {Pose} pose
 * @returns {import("./matrices.js").Matrix} from the meshes' own frame to the world
 */
export function matrixOf({ quaternion: [w, x, y, z], translation: [a, b, c] }) {
  return fromRows([
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), a],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), b],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), c],
    [0, 0, 0, 1],
  ]);
}
