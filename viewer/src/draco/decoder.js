/** Google's Draco decoder in two workers, for all players of a page. Its files lie beside the module, in draco/. */
import { PlayerError } from "../errors.js";

const WORKERS = 2;
const FILES = { wrapper: "draco_wasm_wrapper.js", wasm: "draco_decoder.wasm", worker: "worker.js" };

/** Bytes of WebAssembly: counted in the progress. `total` is replaced by the build. */
export const weight = { loaded: 0, total: typeof DRACO_BYTES === "undefined" ? 1 : DRACO_BYTES };

/** Where the files are, if not beside the module: name in FILES -> address (one file that holds all). */
export const places = {};

let started = null;
let last = 0;
let turn = 0;
const waiting = new Map(); // number of a task -> {resolve, reject}

const address = (name) => places[name] ?? new URL(`./draco/${FILES[name]}`, import.meta.url).href;

/** @param {() => void} [onProgress] @returns {Promise<Worker[]>} the workers, started once */
export function startDecoder(onProgress = () => {}) {
  started ??= start(onProgress).catch((error) => {
    started = null; // the next one tries again
    throw error;
  });
  return started;
}

async function start(onProgress) {
  weight.loaded = 0;
  const [wasm, workers] = await Promise.all([fetched("wasm", onProgress), makeWorkers()]);
  for (const worker of workers) {
    worker.onmessage = ({ data: { id, error, ...found } }) => {
      const task = waiting.get(id);
      waiting.delete(id);
      if (error === undefined) task?.resolve(found);
      else task?.reject(new Error(error));
    };
    worker.onerror = (event) => fail(new Error(event.message || "the Draco decoder does not start"));
    worker.postMessage({ wasm });
  }
  return workers;
}

function fail(error) {
  for (const { reject } of waiting.values()) reject(error);
  waiting.clear();
}

/** From their own files where the page may do that; else (another server, one file) from a text. */
async function makeWorkers() {
  const count = Array.from({ length: WORKERS });
  const here = new URL(address("worker"), location.href);
  if (here.origin === location.origin && here.protocol !== "blob:" && location.protocol !== "file:")
    return count.map(() => new Worker(here));
  const texts = await Promise.all([text("wrapper"), text("worker")]);
  const together = URL.createObjectURL(new Blob([texts.join("\n")], { type: "text/javascript" }));
  return count.map(() => new Worker(together));
}

const text = async (name) => new TextDecoder().decode(await fetched(name));

async function fetched(name, onProgress) {
  let response;
  try {
    response = await fetch(address(name));
    if (!response.ok) throw new Error(`the server says ${response.status}`);
    const parts = [];
    for (const reader = response.body.getReader(); ;) {
      const { done, value } = await reader.read();
      if (done) break;
      parts.push(value);
      if (onProgress) {
        weight.loaded = Math.min(weight.total, weight.loaded + value.length);
        onProgress();
      }
    }
    return await new Blob(parts).arrayBuffer();
  } catch (cause) {
    throw new PlayerError(`The player's own file ${FILES[name]} cannot be had`, {
      file: address(name),
      cause,
      kind: response ? "missing" : "offline",
      remedy: "Copy the player's whole folder, draco/ included, to the server; check the connection; load again.",
    });
  }
}

/**
 * @param {ArrayBuffer} buffer handed over
 * @returns {Promise<{index: Uint32Array, position: Float32Array, uv: Float32Array}>}
 */
export async function decode(buffer) {
  const workers = await startDecoder();
  const id = ++last;
  return new Promise((resolve, reject) => {
    waiting.set(id, { resolve, reject });
    workers[++turn % workers.length].postMessage({ id, buffer }, [buffer]);
  });
}
