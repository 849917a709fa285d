/** Gets an asset's files, from a server or from memory: counts bytes, and refuses a file that is missing, short or changed. */
import { PlayerError } from "./errors.js";
import { Pace } from "./pace.js";

const AGAIN = "Copy or make the asset again.";

/** Addresses that the page's own policy has refused: their fetches fail without a reason. */
const forbidden = new Map();
globalThis.document?.addEventListener("securitypolicyviolation", ({ blockedURI, effectiveDirective }) =>
  forbidden.set(new URL(blockedURI, location.href).origin, effectiveDirective),
);

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
    this.pace = new Pace();
    this.onTrouble = () => {}; // the connection fails while something plays
  }

  /** Gives up all that is being fetched. */
  close() {
    this.abort.abort();
  }

  address(name) {
    return new URL(name, this.folder).href;
  }

  /** An address that the page's own elements can take. */
  addressFor({ name }) {
    return this.address(name);
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
    const data = new Uint8Array(entry.bytes);
    let filled = 0;
    this.pace.start();
    try {
      const response = await this.#request(entry.name, {});
      for (const reader = response.body.getReader(); ;) {
        const { done, value } = await reader.read();
        if (done) break;
        if (filled + value.length <= data.length) data.set(value, filled);
        filled += value.length;
        this.#count(value.length);
      }
    } catch (cause) {
      if (this.abort.signal.aborted || cause instanceof PlayerError) throw cause;
      throw await unreachable(this.address(entry.name), cause, this.abort.signal);
    } finally {
      this.pace.end(filled);
    }
    await checked(data.buffer, filled, entry, this.address(entry.name));
    return data.buffer;
  }

  /**
   * Some bytes of a file.
   * @param {import("./manifest.js").FileEntry} entry
   * @param {{offset: number, bytes: number, sha256: string}} part
   * @param {AbortSignal} [signal] of who no longer needs it
   * @returns {Promise<ArrayBuffer>}
   */
  async part(entry, { offset, bytes, sha256 }, signal = this.abort.signal) {
    const both = AbortSignal.any([signal, this.abort.signal]);
    const headers = { Range: `bytes=${offset}-${offset + bytes - 1}` };
    const data = new Uint8Array(bytes);
    let filled = 0;
    this.pace.start();
    try {
      const response = await this.#request(entry.name, { headers }, both);
      let before = response.status === 206 ? 0 : offset; // a server without ranges sends it all
      for (const reader = response.body.getReader(); filled < bytes;) {
        const { done, value } = await reader.read();
        if (done) break;
        this.#count(value.length);
        const wanted = value.subarray(Math.min(before, value.length)).subarray(0, bytes - filled);
        before -= Math.min(before, value.length);
        data.set(wanted, filled);
        filled += wanted.length;
        if (filled === bytes) reader.cancel().catch(() => {});
      }
    } catch (cause) {
      if (both.aborted) throw new DOMException("no longer wanted", "AbortError");
      if (cause instanceof PlayerError) throw cause;
      throw await unreachable(this.address(entry.name), cause, both);
    } finally {
      this.pace.end(filled);
    }
    await checked(data.buffer, filled, { name: entry.name, bytes, sha256 }, this.address(entry.name));
    return data.buffer;
  }

  #count(bytes) {
    this.loaded += bytes;
    this.onProgress();
  }

  async #request(name, options, signal = this.abort.signal) {
    const file = this.address(name);
    let response;
    try {
      response = await fetch(file, { ...options, signal });
    } catch (cause) {
      if (signal.aborted) throw cause;
      throw await unreachable(file, cause, signal);
    }
    if (!response.ok) throw missing(name, file, `the server says ${response.status}`);
    return response;
  }
}

/** An asset whose files are at hand: dropped on the player, in an archive, or in the page itself. */
export class MemoryFiles {
  /**
   * @param {Map<string, Blob>} given file's name -> content
   * @param {() => void} onProgress
   */
  constructor(given, onProgress = () => {}) {
    this.given = given;
    this.loaded = 0;
    this.onProgress = onProgress;
    this.pace = new Pace();
    this.onTrouble = () => {};
  }

  close() {}

  address(name) {
    return name;
  }

  async text(name) {
    return new TextDecoder().decode(await this.#read(name));
  }

  async bytes(entry) {
    const buffer = await this.#read(entry.name);
    await checked(buffer, buffer.byteLength, entry, entry.name);
    return buffer;
  }

  async part({ name }, { offset, bytes, sha256 }) {
    const buffer = await this.#blob(name)
      .slice(offset, offset + bytes)
      .arrayBuffer();
    await checked(buffer, buffer.byteLength, { name, bytes, sha256 }, name);
    return buffer;
  }

  #blob(name) {
    const blob = this.given.get(name);
    if (!blob) throw missing(name, name, "it is not among the files given");
    return blob;
  }

  async #read(name) {
    const buffer = await this.#blob(name).arrayBuffer();
    this.loaded += buffer.byteLength;
    this.onProgress();
    return buffer;
  }
}

function missing(name, file, why) {
  return new PlayerError(`The file ${name} is missing (${why})`, {
    file,
    kind: "missing",
    remedy: name === "manifest.json" ? "Check the address: it must be the folder of an asset." : AGAIN,
  });
}

/** Why a fetch failed, as far as a page may know. @returns {Promise<PlayerError>} */
async function unreachable(file, cause, signal) {
  const { protocol, origin, host } = new URL(file);
  if (protocol === "file:") {
    return new PlayerError("A page that was opened as a file may not read other files", {
      ...{ file, cause, kind: "file" },
      remedy:
        "Serve the folder (`facefolds view ASSET`), or make one file that plays by itself: `facefolds export-html ASSET --out face.html`.",
    });
  }
  await new Promise((resolve) => setTimeout(resolve)); // the browser's word about its policy comes after the failure
  const directive = forbidden.get(origin);
  if (directive) {
    return new PlayerError("This page's Content-Security-Policy does not let the player read the asset", {
      ...{ file, cause, kind: "csp" },
      remedy: `Allow ${origin} in the page's ${directive}.`,
    });
  }
  if (origin !== location.origin && (await answers(file, signal))) {
    return new PlayerError(`The server ${host} does not let this page read the asset (CORS)`, {
      ...{ file, cause, kind: "cors" },
      remedy: "Let it send the header Access-Control-Allow-Origin, or put the asset beside the page.",
    });
  }
  return new PlayerError("The server cannot be reached", {
    ...{ file, cause, kind: "offline" },
    remedy: "Check that the server runs and the connection is up. The player goes on by itself when they are back.",
  });
}

/** Whether there is an answer that the page may not read. */
async function answers(file, signal) {
  try {
    await fetch(file, { mode: "no-cors", method: "HEAD", signal });
    return true;
  } catch {
    return false;
  }
}

/** @throws {PlayerError} if the content is not what the manifest says */
async function checked(buffer, filled, { name, bytes, sha256 }, file) {
  const found = filled === bytes ? await changed(buffer, sha256) : `${filled} bytes instead of ${bytes}`;
  if (found) throw new PlayerError(`The file ${name} is damaged: ${found}`, { file, remedy: AGAIN });
}

/** What is wrong with the content; "" if nothing, or where it cannot be known (pages without HTTPS have no SubtleCrypto). */
async function changed(buffer, sha256) {
  if (!sha256 || !globalThis.crypto?.subtle) return "";
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", buffer));
  const found = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return found === sha256 ? "" : "its content was changed (SHA-256)";
}
