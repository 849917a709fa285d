/** How fast the connection is: bytes that came, by the seconds in which anything was being fetched; the past counts less. */

const REMEMBERED = 4; // s
const ENOUGH = 60000; // bytes that say something

export class Pace {
  constructor() {
    Object.assign(this, { active: 0, since: 0, bytes: 0, seconds: 0 });
  }

  start(now = performance.now()) {
    if (!this.active++) this.since = now;
  }

  /** @param {number} bytes that this one brought */
  end(bytes, now = performance.now()) {
    this.bytes += bytes;
    this.seconds += (now - this.since) / 1000;
    this.since = now;
    this.active--;
    if (this.seconds < REMEMBERED) return;
    const share = REMEMBERED / 2 / this.seconds;
    this.bytes *= share;
    this.seconds *= share;
  }

  /** Bytes a second; null while too little is known. */
  get rate() {
    return this.bytes < ENOUGH || !this.seconds ? null : this.bytes / this.seconds;
  }
}
