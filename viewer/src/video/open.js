/** Opens the first of a level's videos that this browser can decode. */
import { PlayerError } from "../errors.js";
import { CodedFrames } from "./coded.js";
import { ElementFrames } from "./element.js";
import { takeApart } from "./packets.js";
import { SegmentPackets } from "./segments.js";
import { WholePackets } from "./whole.js";

/**
 * @typedef {CodedFrames | ElementFrames} FrameSource
 * @param {import("../manifest.js").Level} level
 * @param {import("../files.js").Files} files
 * @param {(error: Error) => void} onError when decoding breaks down later on
 * @param {Set<string>} refused names of files not to try (again)
 * @param {number} at the frame to begin with
 * @returns {Promise<{source: FrameSource, video: import("../manifest.js").VideoEntry, first: VideoFrame | HTMLVideoElement}>}
 * @throws {PlayerError} if none can be played
 */
export async function openVideo(level, files, onError, refused = new Set(), at = 0) {
  const said = [];
  for (const video of level.videos) {
    if (refused.has(video.name)) continue;
    if (!(await mayPlay(video, level.texture))) {
      said.push(`${video.codec}: not supported`);
      continue;
    }
    const buffer = video.segments ? null : await files.bytes(video);
    let source = null;
    try {
      source = video.segments
        ? await openSegments(video, level.texture, files, onError, at)
        : await open(buffer, video, level.texture, onError);
      return { source, video, first: await source.get(at) };
    } catch (error) {
      source?.close();
      if (error instanceof PlayerError || error.name === "AbortError") throw error;
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
  return new CodedFrames(config, new WholePackets(packets), onError);
}

/** A long take: through WebCodecs, or where there is none through hls.js, which is loaded then. */
async function openSegments(video, texture, files, onError, at) {
  if (!globalThis.VideoDecoder && !files.addressFor)
    return ElementFrames.open(await files.bytes(video), video.mime, texture);
  if (!globalThis.VideoDecoder) {
    const { openHls } = await import("./hls.js");
    return openHls(files.address(video.playlist), texture, onError);
  }
  const packets = new SegmentPackets(video, texture, files);
  try {
    const config = await packets.open(at);
    if (!(await VideoDecoder.isConfigSupported(config)).supported) throw new Error(`${config.codec} is not supported`);
    packets.onTrouble = (error) => files.onTrouble(error);
    return new CodedFrames(config, packets, onError);
  } catch (error) {
    packets.close();
    throw error;
  }
}

/** Asks before anything is fetched. What it allows may still fail. */
async function mayPlay({ mime }, { width, height }) {
  if (!globalThis.VideoDecoder) return document.createElement("video").canPlayType(mime) !== "";
  const codec = /codecs="?([^",;]+)/.exec(mime)?.[1];
  if (!codec) return true;
  const config = { codec, codedWidth: width, codedHeight: height };
  return VideoDecoder.isConfigSupported(config).then((answer) => answer.supported, () => false); // prettier-ignore
}
