/** One file that plays by itself: the player and, in the page around it, the asset (`facefolds export-html`). */
import { wasm, worker, wrapper } from "draco-files";
import { places } from "./draco/decoder.js";
import "./index.js";
import { decode } from "./viewstate.js";

const JAVASCRIPT = "text/javascript";

/** @param {string} text base64 @returns {Uint8Array} */
const bytesOf = (text) => Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));

places.wrapper = URL.createObjectURL(new Blob([wrapper], { type: JAVASCRIPT }));
places.worker = URL.createObjectURL(new Blob([worker], { type: JAVASCRIPT }));
places.wasm = URL.createObjectURL(new Blob([bytesOf(wasm)], { type: "application/wasm" }));

const player = document.querySelector("facefolds-player");
const files = Array.from(document.querySelectorAll("script[data-file]"), (script) => {
  const content = new Blob([bytesOf(script.textContent.trim())]);
  script.remove(); // its text is not kept twice
  return [script.dataset.file, content];
});
if (parent === window) player.setAttribute("gestures", "all");
player.openFiles(new Map(files));
player.state = decode(location.hash);
addEventListener("keydown", (event) => event.target === document.body && player.press?.(event));
player.addEventListener("ready", () => (document.title = `${player.player.manifest.subject} · facefolds`));
