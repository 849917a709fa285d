/** Fetches an asset's files: counts bytes, and refuses a file that is missing, short or changed. */
import { PlayerError } from "./errors.js";

const AGAIN = "Copy or make the asset again.";

export class Files {
  /**
   * @param {string} folder address of the asset's folder, ending in "/"
   * @param {() => void} onProgress called whenever bytes have come in
   */
  constructor(folder, onProgress = () => {}) {
    this.folder = folder;
    this.loaded = 0;
    this.onProgress = onProgress;
    this.abort = new AbortController();
  }

  /** Gives up all that is being fetched. */
  close() {
    this.abort.abort();
  }

  address(name) {
    return new URL(name, this.folder).href;
  }

  /** @returns {Promise<string>} a small text file of unknown size, never from a stale cache */
  async text(name) {
    const response = await this.#request(name, { cache: "no-cache" });
    const text = await response.text();
    this.#count(text.length);
    return text;
  }

  /**
   * @param {import("./manifest.js").FileEntry} entry
   * @returns {Promise<ArrayBuffer>}
   */
  async bytes(entry) {
    const response = await this.#request(entry.name, {});
    const data = new Uint8Array(entry.bytes);
    let filled = 0;
    try {
      for (const reader = response.body.getReader(); ;) {
        const { done, value } = await reader.read();
        if (done) break;
        if (filled + value.length <= data.length) data.set(value, filled);
        filled += value.length;
        this.#count(value.length);
      }
    } catch (cause) {
      if (this.abort.signal.aborted) throw cause;
      throw unreachable(this.address(entry.name), cause);
    }
    const found =
      filled === data.length ? await changed(data.buffer, entry.sha256) : `${filled} bytes instead of ${data.length}`;
    if (found) {
      const file = this.address(entry.name);
      throw new PlayerError(`The file ${entry.name} is damaged: ${found}`, { file, remedy: AGAIN });
    }
    return data.buffer;
  }

  #count(bytes) {
    this.loaded += bytes;
    this.onProgress();
  }

  async #request(name, options) {
    const file = this.address(name);
    let response;
    try {
      response = await fetch(file, { ...options, signal: this.abort.signal });
    } catch (cause) {
      if (this.abort.signal.aborted) throw cause;
      throw unreachable(file, cause);
    }
    if (!response.ok) {
      throw new PlayerError(`The file ${name} is missing (the server says ${response.status})`, {
        file,
        kind: "missing",
        remedy: name === "manifest.json" ? "Check the address: it must be the folder of an asset." : AGAIN,
      });
    }
    return response;
  }
}

function unreachable(file, cause) {
  return new PlayerError("The server cannot be reached", {
    file,
    cause,
    kind: "offline",
    remedy: "Check that the server runs and the connection is up, then load again.",
  });
}

/** What is wrong with the content; "" if nothing, or where it cannot be known (pages without HTTPS have no SubtleCrypto). */
async function changed(buffer, sha256) {
  if (!sha256 || !globalThis.crypto?.subtle) return "";
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", buffer));
  const found = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return found === sha256 ? "" : "its content was changed (SHA-256)";
}
