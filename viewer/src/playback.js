/** Which frame is due: a clock that counts frames, loops or stops at the end, and never runs ahead of the decoder. */

export class Playback {
  /** @param {{frames: number, fps: number}} sequence */
  constructor({ frames, fps }) {
    this.frames = frames;
    this.fps = fps;
    this.position = 0; // frames, with a fraction
    this.playing = false;
    this.loop = true;
    this.speed = 1;
  }

  /** The frame that is due. */
  get frame() {
    return Math.min(this.frames - 1, Math.floor(this.position));
  }

  /** @param {number} k brought into the sequence */
  seek(k) {
    this.position = Math.max(0, Math.min(this.frames - 1, Math.round(k)));
  }

  /** @param {number} by frames; wraps round when looping */
  step(by) {
    const next = this.frame + by;
    this.seek(this.loop ? ((next % this.frames) + this.frames) % this.frames : next);
  }

  /**
   * Lets time pass.
   * @param {number} seconds since the last picture
   * @param {boolean} there whether the frame that is due has been decoded: if not, the clock waits
   * @returns {boolean} whether the end has been reached (playing stops)
   */
  advance(seconds, there) {
    if (!this.playing || !there || this.frames === 1) return false;
    const next = this.position + seconds * this.fps * this.speed;
    if (next < this.frames) {
      this.position = next;
      return false;
    }
    if (this.loop) {
      this.position = next % this.frames;
      return false;
    }
    this.position = this.frames - 1;
    this.playing = false;
    return true;
  }
}
