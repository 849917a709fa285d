/** A film of the head that turns from side to side while the sequence plays, recorded as it is drawn. */
import { PlayerError } from "./errors.js";

const TYPES = ["video/mp4;codecs=avc1.640028", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
const WIDEST = 40; // degrees to each side, and no further than was filmed
const BITS = 12e6; // a second

/** @returns {string | undefined} what this browser can record */
export const recordable = () =>
  typeof MediaRecorder === "undefined" ? undefined : TYPES.find((type) => MediaRecorder.isTypeSupported(type));

/**
 * Records one turn from the present view, which is there again afterwards.
 * @param {import("./player.js").Player} player that has something to show
 * @param {{seconds?: number, degrees?: number, signal?: AbortSignal}} [wanted] to each side; the signal ends it early
 * @returns {Promise<Blob>} MP4 or WebM, the size of the canvas, without sound
 */
export async function recordTurn(player, { seconds = 8, degrees = WIDEST, signal } = {}) {
  const mimeType = recordable();
  if (!mimeType)
    throw new PlayerError("This browser cannot record", {
      kind: "unsupported",
      remedy: "`facefolds render ASSET --kind turntable --out turn.mp4` makes the film without a browser.",
    });
  const { view, playing } = player;
  const [orbit, atHome] = [view.get(), view.atHome];
  const recorder = new MediaRecorder(player.canvas.captureStream(), { mimeType, videoBitsPerSecond: BITS });
  const parts = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  const stopped = new Promise((resolve, reject) => {
    recorder.addEventListener("stop", resolve);
    recorder.addEventListener("error", ({ error }) => reject(error));
  });
  recorder.start();
  player.play();
  try {
    await turn(player, orbit, seconds, degrees, signal);
    recorder.stop();
    await stopped;
  } finally {
    if (recorder.state !== "inactive") recorder.stop();
    if (!playing) player.pause();
    view.set(orbit);
    view.atHome = atHome;
  }
  return new Blob(parts, { type: mimeType.split(";")[0] });
}

/** From the middle to the one side, the other and back, evenly. */
function turn(player, orbit, seconds, degrees, signal) {
  const { azimuth } = orbit;
  const [low, high] = player.view.range.azimuth.map((end) => Math.min(degrees, Math.abs(end - azimuth)));
  let began = 0;
  return new Promise((resolve) => {
    const step = (now) => {
      began ||= now;
      const part = (now - began) / (1000 * seconds);
      if (part >= 1 || signal?.aborted || player.closed) return resolve();
      const swing = Math.sin(2 * Math.PI * part);
      player.view.set({ ...orbit, azimuth: azimuth + (swing > 0 ? high : low) * swing });
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
}
