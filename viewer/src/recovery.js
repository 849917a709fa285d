/** After a failure of the connection: waits until the server answers again. */

const FIRST = 2000; // ms
const LONGEST = 30000;

export class Recovery {
  /** @param {() => boolean} wanted whether anybody would see the result @param {() => void} again loads what failed */
  constructor(wanted, again) {
    this.wanted = wanted;
    this.again = again;
    this.address = null; // of the file that could not be had; null: nothing is waited for
    this.online = () => this.#try();
  }

  /** @param {string} address of the file that could not be had */
  start(address) {
    if (this.address !== null) return;
    this.address = address;
    this.wait = FIRST;
    addEventListener("online", this.online);
    this.#later();
  }

  stop() {
    this.address = null;
    clearTimeout(this.timer);
    removeEventListener("online", this.online);
  }

  #later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#try(), this.wait);
    this.wait = Math.min(LONGEST, 2 * this.wait);
  }

  async #try() {
    const { address } = this;
    if (address === null) return;
    try {
      if (!this.wanted() || !navigator.onLine) return this.#later();
      await fetch(address, { method: "HEAD", cache: "no-store" });
    } catch {
      if (this.address === address) this.#later();
      return;
    }
    if (this.address !== address) return;
    this.stop();
    this.again();
  }
}
