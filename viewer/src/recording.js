/** A film of the head that turns from side to side while the sequence plays: made picture by picture, not as fast as it plays. */
import {
  AudioBufferSource,
  BufferTarget,
  CanvasSource,
  getFirstEncodableAudioCodec,
  getFirstEncodableVideoCodec,
  Mp4OutputFormat,
  Output,
  QUALITY_HIGH,
  QUALITY_VERY_HIGH,
  WebMOutputFormat,
} from "mediabunny";
import { PlayerError } from "./errors.js";

const CODECS = ["avc", "vp9", "vp8"];
const WIDEST = 40; // degrees to each side, and no further than the picture is good
const RATE = 30; // pictures a second, or as many as the sequence has: the camera moves in each

/**
 * @typedef {{seconds?: number, degrees?: number, signal?: AbortSignal, onPart?: (part: number) => void}} Wanted `degrees`:
 *   to each side; the signal ends it early; `onPart` hears how much there is, 0 to 1
 *
 * Makes a film of one turn from the present view, from the first frame on; all is as before afterwards.
 * @param {import("./player.js").Player} player that has something to show
 * @param {Wanted} [wanted]
 * @returns {Promise<Blob>} MP4 or WebM, the size of the canvas, with the asset's sound
 */
export async function recordTurn(player, { seconds = 8, degrees = WIDEST, signal, onPart = () => {} } = {}) {
  const { view, playing, playback } = player;
  const [orbit, atHome, frame] = [view.get(), view.atHome, playback.frame];
  const [width, height] = player.size.map((side) => 2 * Math.floor(side / 2)); // as H.264 wants it
  const canvas = new OffscreenCanvas(width, height);
  const codec = globalThis.VideoEncoder && (await getFirstEncodableVideoCodec(CODECS, { width, height }));
  if (!codec)
    throw new PlayerError("This browser cannot record", {
      kind: "unsupported",
      remedy: "`facefolds render ASSET --kind turntable --out turn.mp4` makes the film without a browser.",
    });
  const format = codec === "avc" ? new Mp4OutputFormat() : new WebMOutputFormat();
  const output = new Output({ format, target: new BufferTarget() });
  const pictures = new CanvasSource(canvas, { codec, quality: QUALITY_VERY_HIGH });
  const rate = Math.max(RATE, playback.fps * playback.speed);
  output.addVideoTrack(pictures, { frameRate: rate });
  player.pause();
  try {
    const sound = await addSound(output, player);
    await output.start();
    const count = Math.round(seconds * rate);
    let k = 0;
    for (; k < count && !(k && signal?.aborted) && !player.closed; ++k) {
      view.set({ ...orbit, azimuth: swung(orbit.azimuth, degrees, k / count, view.range.azimuth) });
      await player.seek(frameAt(k / rate, playback));
      canvas.getContext("2d").drawImage(player.canvas, 0, 0);
      await pictures.add(k / rate, 1 / rate);
      onPart((k + 1) / count);
    }
    await sound?.(k / rate);
    await output.finalize();
  } finally {
    if (output.state !== "finalized") await output.cancel();
    view.set(orbit);
    view.atHome = atHome;
    await player.seek(frame);
    if (playing) player.play();
  }
  return new Blob([output.target.buffer], { type: format.mimeType });
}

/** From the middle to the one side, the other and back, evenly. */
function swung(azimuth, degrees, part, range) {
  const [low, high] = range.map((end) => Math.min(degrees, Math.abs(end - azimuth)));
  const swing = Math.sin(2 * Math.PI * part);
  return azimuth + (swing > 0 ? high : low) * swing;
}

/** The frame that is due after that many seconds of playing. */
function frameAt(seconds, { fps, speed, frames, loop }) {
  const due = Math.floor(seconds * fps * speed + 1e-6);
  return loop ? due % frames : Math.min(due, frames - 1);
}

/** @returns {Promise<((seconds: number) => Promise<void>) | null>} adds the sound of a film that long; null: there is none */
async function addSound(output, { manifest, files, playback }) {
  const codec = manifest.audio && (await getFirstEncodableAudioCodec(output.format.getSupportedAudioCodecs()));
  if (!codec) return null;
  const source = new AudioBufferSource({ codec, quality: QUALITY_HIGH });
  output.addAudioTrack(source);
  return async (seconds) => {
    const sound = await files.bytes(manifest.audio);
    await source.add(await mixed(sound, playback, seconds));
  };
}

const SOUND_RATE = 48000;

/** A sound as long as a film, at the speed of the pictures, and again from the beginning when they are. */
async function mixed(bytes, { fps, frames, speed, loop }, seconds) {
  const context = new OfflineAudioContext(2, Math.ceil(SOUND_RATE * seconds), SOUND_RATE);
  const given = await context.decodeAudioData(bytes);
  const turn = context.createBuffer(given.numberOfChannels, Math.ceil((SOUND_RATE * frames) / fps), SOUND_RATE);
  for (let i = 0; i < given.numberOfChannels; ++i)
    turn.copyToChannel(given.getChannelData(i).subarray(0, turn.length), i);
  const node = new AudioBufferSourceNode(context, { buffer: turn, loop, playbackRate: speed });
  node.connect(context.destination);
  node.start();
  return context.startRendering();
}
