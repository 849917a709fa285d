/** Takes a video file apart into its coded pictures, numbered in the order in which they are shown. */
import { BufferSource, EncodedPacketSink, Input, MP4, WEBM } from "mediabunny";

/**
 * @typedef {{frame: number, key: boolean, data: Uint8Array}} Packet in decoding order
 * @param {ArrayBuffer} buffer an MP4 or WebM file
 * @returns {Promise<{config: VideoDecoderConfig, packets: Packet[]}>}
 */
export async function takeApart(buffer) {
  const input = new Input({ source: new BufferSource(buffer), formats: [MP4, WEBM] });
  try {
    const track = await input.getPrimaryVideoTrack();
    const config = await track?.getDecoderConfig();
    if (!config) throw new Error("it holds no video that this player knows");
    const coded = [];
    for await (const packet of new EncodedPacketSink(track).packets()) coded.push(packet);
    const shown = coded.map((packet) => packet.timestamp).sort((a, b) => a - b);
    const number = new Map(shown.map((time, frame) => [time, frame]));
    const packets = coded.map(({ timestamp, type, data }) => ({
      frame: number.get(timestamp),
      key: type === "key",
      data,
    }));
    return { config, packets };
  } finally {
    input.dispose?.();
  }
}
