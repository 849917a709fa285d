/** Long takes through a <video> element that hls.js feeds (or the browser itself, where it knows HLS and nothing else). */
import { ElementFrames } from "./element.js";

const BUFFER = { maxBufferLength: 10, maxMaxBufferLength: 20, backBufferLength: 10, maxBufferSize: 24e6 };
const PATIENCE = 20000; // ms for a seek: what it needs comes over the network

/**
 * @param {string} address of the playlist of one level
 * @param {{frames: number, fps: number}} texture
 * @param {(error: Error) => void} onError when playing breaks down later on
 * @returns {Promise<ElementFrames>}
 */
export async function openHls(address, texture, onError) {
  const video = document.createElement("video");
  Object.assign(video, { muted: true, playsInline: true, preload: "auto", crossOrigin: "anonymous" });
  const { default: Hls } = await import("hls.js/light");
  const frames = new ElementFrames(video, texture, PATIENCE);
  await new Promise((resolve, reject) => {
    video.addEventListener("loadeddata", resolve, { once: true });
    if (!Hls.isSupported()) {
      video.onerror = () => reject(new Error(video.error?.message || "the video element refuses it"));
      video.src = address;
      return;
    }
    const hls = new Hls({ ...BUFFER, autoStartLoad: true });
    frames.feed = hls;
    hls.on(Hls.Events.ERROR, (_, { fatal, details }) => {
      if (!fatal) return;
      const error = new Error(`hls.js: ${details}`);
      reject(error);
      onError(error);
    });
    hls.loadSource(address);
    hls.attachMedia(video);
  });
  return frames;
}
