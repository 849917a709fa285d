/**
 * The coded pictures of a video that is fetched segment by segment. Each begins with a key frame, and order of decoding is
 * order of showing. Kept are the segments of what is wanted and of the seconds after it; the rest is let go.
 */
import { takeApart } from "./packets.js";

const AHEAD = 8; // s that are fetched before they are due
const MOST = 24e6; // bytes of segments that are kept, but always the one that is wanted and the next
const RETRY = [500, 8000]; // ms after a failure of the connection: first and longest

export class SegmentPackets {
  /**
   * @param {import("../manifest.js").VideoEntry} video with `init` and `segments`
   * @param {{fps: number, frames: number}} texture
   * @param {import("../files.js").Files} files
   */
  constructor(video, { fps, frames }, files) {
    Object.assign(this, { video, files, fps, frames });
    let first = 0;
    this.segments = video.segments.map((segment) => {
      first += segment.frames;
      return { ...segment, first: first - segment.frames, packets: null, asked: null };
    });
    this.wanted = 0;
    this.wait = RETRY[0];
    this.onPackets = () => {}; // there are more
    this.onFailure = () => {}; // a segment is damaged
    this.onTrouble = () => {}; // the connection: it is tried again
  }

  /** The header, and the segment with frame `k`. @returns {Promise<VideoDecoderConfig>} */
  async open(k) {
    this.header = new Uint8Array(await this.files.part(this.video, this.video.init));
    this.#move(k);
    const segment = this.segments[this.#index(k)];
    await this.#fetch(segment);
    return segment.config;
  }

  place(k) {
    return k;
  }

  key(place) {
    return this.segments[this.#index(place)].first;
  }

  at(place) {
    const segment = this.segments[this.#index(place)];
    return segment.packets?.[place - segment.first] ?? null;
  }

  /** Frames from `k` on are wanted: what they need is fetched, what is no longer needed let go. */
  want(k) {
    this.#move(k);
    if (!this.busy) this.#fill();
  }

  get kept() {
    return this.segments.reduce((sum, { packets, bytes }) => sum + (packets ? bytes : 0), 0);
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
    for (const { asked } of this.segments) asked?.abort();
  }

  #index(k) {
    let [low, high] = [0, this.segments.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.segments[middle].first <= k) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  #move(k) {
    this.wanted = k;
    const due = new Set(this.#due());
    for (const segment of this.segments) {
      if (due.has(segment)) continue;
      segment.asked?.abort();
      segment.packets = null;
    }
  }

  /** Segments to have, the most urgent first; a sequence that ends goes on at its beginning. */
  #due() {
    const { length } = this.segments;
    const at = this.#index(this.wanted);
    const found = [this.segments[at]];
    let seconds = (this.segments[at].first + this.segments[at].frames - this.wanted) / this.fps;
    let bytes = this.segments[at].bytes;
    for (let i = 1; i < length; ++i) {
      const next = this.segments[(at + i) % length];
      if (i > 1 && (seconds >= AHEAD || bytes + next.bytes > MOST)) break;
      found.push(next);
      seconds += next.frames / this.fps;
      bytes += next.bytes;
    }
    return found;
  }

  async #fill() {
    this.busy = true;
    try {
      for (;;) {
        const next = this.#due().find(({ packets }) => !packets);
        if (!next || this.closed) return;
        await this.#fetch(next);
        this.wait = RETRY[0];
        this.onPackets();
      }
    } catch (error) {
      if (this.closed) return;
      if (error.name === "AbortError") this.timer = setTimeout(() => this.busy || this.#fill());
      else if (error.kind === "offline") this.#again(error);
      else this.onFailure(error);
    } finally {
      this.busy = false;
    }
  }

  #again(error) {
    if (this.wait === RETRY[0]) this.onTrouble(error);
    this.timer = setTimeout(() => this.busy || this.#fill(), this.wait);
    this.wait = Math.min(RETRY[1], 2 * this.wait);
  }

  async #fetch(segment) {
    segment.asked = new AbortController();
    try {
      const data = new Uint8Array(await this.files.part(this.video, segment, segment.asked.signal));
      const both = new Uint8Array(this.header.length + data.length);
      both.set(this.header);
      both.set(data, this.header.length);
      const { config, packets } = await takeApart(both.buffer);
      if (packets.length !== segment.frames) throw new Error(`${packets.length} frames instead of ${segment.frames}`);
      segment.config = config;
      if (!this.#due().includes(segment)) return;
      segment.packets = packets.map((packet) => ({ ...packet, frame: packet.frame + segment.first }));
    } finally {
      segment.asked = null;
    }
  }
}
