/**
 * Frames of a video by their numbers, decoded with WebCodecs.
 *
 * Coded pictures come from a store, which has the whole file (a few MB) or fetches what is wanted. Of decoded pictures
 * those of a short window from the wanted frame on are kept, and closed when it moves on. Frame k is the k-th picture, by
 * count. The window wraps round at the end, so that a loop finds its first frame decoded when it gets there.
 */

const AHEAD = { least: 3, most: 8 };
const PATIENCE = 60; // ms that a decoder with nothing left to do may keep the wanted frame before it is flushed

export class CodedFrames {
  /**
   * @param {VideoDecoderConfig} config
   * @param {import("./whole.js").WholePackets | import("./segments.js").SegmentPackets} packets
   * @param {(error: Error) => void} onError called once, when the decoder gives up
   */
  constructor(config, packets, onError) {
    this.kind = "WebCodecs";
    this.frames = packets.frames;
    this.onError = onError;
    this.config = { ...config, optimizeForLatency: true };
    this.packets = packets;
    this.decoded = new Map(); // frame -> VideoFrame
    this.inside = new Set(); // frames that the decoder holds
    this.wanted = 0;
    this.ahead = AHEAD.least;
    this.cursor = -1; // place of the packet fed last; -1: a key frame must come next
    this.waiting = new Map(); // frame -> [resolve, reject]
    this.flushing = false;
    this.decoder = new VideoDecoder({ output: (frame) => this.#keep(frame), error: (error) => this.#fail(error) });
    this.decoder.addEventListener("dequeue", () => this.#feed());
    this.decoder.configure(this.config);
    packets.onPackets = () => this.#feed();
    packets.onFailure = (error) => this.#fail(error);
  }

  /** The decoded frame `k`, or null while it is not there. It stays valid until another one is wanted. */
  peek(k) {
    return this.decoded.get(k) ?? null;
  }

  /** Moves the window: `k` is wanted now, and the frames after it are next. @param {number} stride frames a picture */
  want(k, stride = 1) {
    this.wanted = k;
    this.packets.want(k);
    this.ahead = Math.max(AHEAD.least, Math.min(AHEAD.most, Math.ceil(1.5 * stride) + 2));
    for (const [frame, picture] of this.decoded) {
      if (this.#inWindow(frame)) continue;
      picture.close();
      this.decoded.delete(frame);
    }
    this.#feed();
  }

  /** @returns {Promise<VideoFrame>} frame `k`; rejected if another frame is asked for before it has come */
  get(k) {
    for (const [frame, [, reject]] of this.waiting) {
      if (frame !== k) {
        this.waiting.delete(frame);
        reject(new DOMException("another frame was asked for", "AbortError"));
      }
    }
    this.want(k);
    const there = this.peek(k);
    if (there) return Promise.resolve(there);
    return new Promise((resolve, reject) => {
      const others = this.waiting.get(k);
      this.waiting.set(k, [
        (frame) => (others?.[0](frame), resolve(frame)),
        (error) => (others?.[1](error), reject(error)),
      ]);
    });
  }

  close() {
    clearTimeout(this.timer);
    this.packets.close();
    for (const picture of this.decoded.values()) picture.close();
    this.decoded.clear();
    for (const [, reject] of this.waiting.values()) reject(new DOMException("closed", "AbortError"));
    this.waiting.clear();
    if (this.decoder.state !== "closed") this.decoder.close();
  }

  #inWindow(frame) {
    return (frame - this.wanted + this.frames) % this.frames <= this.ahead;
  }

  /** Gives the decoder what the first missing frame of the window needs. */
  #feed() {
    if (this.decoder.state !== "configured" || this.flushing) return;
    while (this.decoder.decodeQueueSize < 3) {
      const missing = this.#firstMissing();
      if (missing === null) break;
      const place = this.#nextPlace(this.packets.place(missing));
      const packet = this.packets.at(place);
      if (!packet) break; // it is being fetched
      const { frame, key, data } = packet;
      this.decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: frame, data }));
      this.inside.add(frame);
      this.cursor = place;
    }
    this.#watch();
  }

  #firstMissing() {
    for (let i = 0; i <= Math.min(this.ahead, this.frames - 1); ++i) {
      const frame = (this.wanted + i) % this.frames;
      if (!this.decoded.has(frame) && !this.inside.has(frame)) return frame;
    }
    return null;
  }

  /** The packet to feed on the way to the one at `goal`: the one after the last, or the key frame before `goal`. */
  #nextPlace(goal) {
    const key = this.packets.key(goal);
    const onTheWay = this.cursor >= key && this.cursor < goal;
    return onTheWay ? this.cursor + 1 : key;
  }

  /** A decoder may hold back its last pictures until more come. When all was fed and the wanted one stays out: flush. */
  #watch() {
    clearTimeout(this.timer);
    if (this.decoded.has(this.wanted) || !this.inside.has(this.wanted)) return;
    this.timer = setTimeout(async () => {
      if (this.decoder.state !== "configured" || this.decoded.has(this.wanted)) return;
      if (this.decoder.decodeQueueSize > 0) return this.#watch();
      const goal = this.wanted;
      this.flushing = true;
      try {
        await this.decoder.flush();
      } catch {
        return; // closed or failed meanwhile: `error` has said so
      } finally {
        this.flushing = false;
      }
      this.inside.clear();
      this.cursor = -1;
      if (goal === this.wanted && !this.decoded.has(goal)) this.#fail(new Error(`the decoder gave no frame ${goal}`));
      else this.#feed();
    }, PATIENCE);
  }

  #keep(picture) {
    const frame = picture.timestamp;
    this.inside.delete(frame);
    if (!this.#inWindow(frame) || this.decoded.has(frame)) {
      picture.close();
    } else {
      this.decoded.set(frame, picture);
      const waiting = this.waiting.get(frame);
      this.waiting.delete(frame);
      waiting?.[0](picture);
    }
    this.#feed();
  }

  #fail(error) {
    for (const [, reject] of this.waiting.values()) reject(error);
    this.waiting.clear();
    this.onError(error);
  }
}
