/** Where the meshes stand in each frame of an asset whose head moves (docs/reference/asset-format.md, "The head's track"). */
import { PlayerError } from "./errors.js";
import { fromRows } from "./matrices.js";

const NUMBERS = 7;
export const POSE_BYTES = 4 * NUMBERS;

/**
 * @typedef {{quaternion: [number, number, number, number], translation: [number, number, number]}} Pose w, x, y, z
 * @typedef {{normal: number[], offset: number, band: number, rest: import("./matrices.js").Matrix}} Torso what stays in
 *   the room while the head turns: beyond a plane; `rest` is the pose in which the layers were made
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

/**
 * @param {ArrayBuffer} data of the track's file: 7 little-endian float32 a frame
 * @param {string} file its address, for messages
 * @returns {Pose[]}
 */
export function readPoses(data, file) {
  const view = new DataView(data);
  const poses = Array.from({ length: data.byteLength / POSE_BYTES }, (_, k) => {
    const numbers = Array.from({ length: NUMBERS }, (_, i) => view.getFloat32(k * POSE_BYTES + 4 * i, true));
    return { quaternion: numbers.slice(0, 4), translation: numbers.slice(4) };
  });
  if (poses.every(({ quaternion, translation }) => [...quaternion, ...translation].every(Number.isFinite)))
    return poses;
  throw new PlayerError("The asset's track is damaged", { file, remedy: "Copy or make the asset again." });
}
