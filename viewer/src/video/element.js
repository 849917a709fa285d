/**
 * Frames of a video by their numbers through a <video> element: the fallback where there is no WebCodecs (older browsers,
 * and pages that come neither over HTTPS nor from this machine). It plays by itself and says which frame it shows; at
 * rest it seeks to the middle of a frame's time, where rounding of time stamps cannot reach the neighbours.
 */

const PRESENTED = 1500; // ms to wait at most, after a seek, for word of the frame that is presented
const STUCK = 4000; // ms after which a seek has failed

export class ElementFrames {
  /**
   * @param {HTMLVideoElement} video loaded, muted
   * @param {{frames: number, fps: number}} texture
   * @param {number} patience ms after which a seek has failed
   */
  constructor(video, { frames, fps }, patience = STUCK) {
    this.patience = patience;
    this.feed = null; // what feeds the element, to be ended with it
    this.kind = "video element";
    this.playsItself = true;
    this.video = video;
    this.frames = frames;
    this.fps = fps;
    this.shown = -1; // number of the frame that the element shows
    this.wish = null; // the latest frame asked for: {k, resolve, reject}
    this.seeking = false;
    this.#note();
  }

  /** @param {ArrayBuffer} buffer the file @returns {Promise<ElementFrames>} */
  static async open(buffer, mime, texture) {
    const video = document.createElement("video");
    Object.assign(video, { muted: true, playsInline: true, preload: "auto" });
    video.src = URL.createObjectURL(new Blob([buffer], { type: mime.split(";")[0] }));
    await new Promise((resolve, reject) => {
      video.onloadeddata = resolve;
      video.onerror = () => reject(new Error(video.error?.message || "the video element refuses it"));
    });
    return new ElementFrames(video, texture);
  }

  /** The element, where it shows frame `k`; else null. */
  peek(k) {
    return this.shown === k && !this.seeking ? this.video : null;
  }

  /** Plays or rests. @returns {boolean} whether it is at its end */
  run(playing, speed, loop) {
    this.video.loop = loop;
    this.video.playbackRate = speed;
    if (playing && this.video.paused && !this.seeking && !this.video.ended) this.video.play().catch(() => {});
    if (!playing && !this.video.paused) this.video.pause();
    return this.video.ended;
  }

  /** @returns {Promise<HTMLVideoElement>} the element, showing frame `k`; rejected if another is asked for before */
  get(k) {
    this.wish?.reject(new DOMException("another frame was asked for", "AbortError"));
    return new Promise((resolve, reject) => {
      this.wish = { k, resolve, reject };
      if (!this.seeking) this.#seek();
    });
  }

  async #seek() {
    this.seeking = true;
    while (this.wish) {
      const { wish } = this;
      const failure = await this.#goTo(wish.k).catch((error) => error);
      if (this.wish !== wish) continue;
      this.wish = null;
      if (failure) wish.reject(failure);
      else wish.resolve(this.video);
    }
    this.seeking = false;
  }

  async #goTo(k) {
    this.video.pause();
    if (this.shown === k) return;
    const seeked = new Promise((resolve, reject) => {
      this.video.addEventListener("seeked", resolve, { once: true });
      setTimeout(() => reject(new Error(`the video does not seek to frame ${k}`)), this.patience);
    });
    this.shown = -1;
    this.video.currentTime = Math.min((k + 0.5) / this.fps, this.video.duration);
    await seeked;
    for (const end = performance.now() + PRESENTED; this.shown !== k && performance.now() < end;) {
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
    this.shown = k;
  }

  /** Keeps `shown` up to date from what the element says that it presents. */
  #note() {
    this.video.requestVideoFrameCallback?.((_, { mediaTime }) => {
      this.shown = Math.min(this.frames - 1, Math.round(mediaTime * this.fps));
      if (this.video.src) this.#note();
    });
  }

  close() {
    const { src } = this.video;
    this.feed?.destroy();
    this.video.removeAttribute("src");
    this.video.load(); // lets go of what it was still reading, before that is revoked
    URL.revokeObjectURL(src);
  }
}
