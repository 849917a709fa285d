/** Opens the first of a level's videos that this browser can decode. */
import { PlayerError } from "../errors.js";
import { CodedFrames } from "./coded.js";
import { ElementFrames } from "./element.js";
import { takeApart } from "./packets.js";

/**
 * @typedef {CodedFrames | ElementFrames} FrameSource
 * @param {import("../manifest.js").Level} level
 * @param {import("../files.js").Files} files
 * @param {(error: Error) => void} onError when decoding breaks down later on
 * @param {Set<string>} refused names of files not to try (again)
 * @returns {Promise<{source: FrameSource, video: import("../manifest.js").VideoEntry, first: VideoFrame | HTMLVideoElement}>}
 * @throws {PlayerError} if none can be played
 */
export async function openVideo(level, files, onError, refused = new Set()) {
  const said = [];
  for (const video of level.videos) {
    if (refused.has(video.name)) continue;
    if (!(await mayPlay(video, level.texture))) {
      said.push(`${video.codec}: not supported`);
      continue;
    }
    const buffer = await files.bytes(video);
    let source = null;
    try {
      source = await open(buffer, video, level.texture, onError);
      return { source, video, first: await source.get(0) };
    } catch (error) {
      source?.close();
      said.push(`${video.codec}: ${error.message}`);
    }
  }
  throw new PlayerError(`This browser cannot decode the asset's video (${said.join("; ")})`, {
    kind: "codec",
    file: files.address(level.videos[0].name),
    remedy: "Use a recent Chrome, Edge, Firefox or Safari, or export the asset with a second video (WebM).",
  });
}

async function open(buffer, video, texture, onError) {
  if (!globalThis.VideoDecoder) return ElementFrames.open(buffer, video.mime, texture);
  const { config, packets } = await takeApart(buffer);
  if (packets.length !== texture.frames) throw new Error(`${packets.length} frames instead of ${texture.frames}`);
  if (!(await VideoDecoder.isConfigSupported(config)).supported) throw new Error(`${config.codec} is not supported`);
  return new CodedFrames(config, packets, onError);
}

/** Asks before anything is fetched. What it allows may still fail. */
async function mayPlay({ mime }, { width, height }) {
  if (!globalThis.VideoDecoder) return document.createElement("video").canPlayType(mime) !== "";
  const codec = /codecs="?([^",;]+)/.exec(mime)?.[1];
  if (!codec) return true;
  const config = { codec, codedWidth: width, codedHeight: height };
  return VideoDecoder.isConfigSupported(config).then((answer) => answer.supported, () => false); // prettier-ignore
}
