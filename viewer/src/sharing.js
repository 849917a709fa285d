/** What leaves the page: links, code to embed, pictures. */
import { encode } from "./viewstate.js";

/** Address of the full-page player with this asset and view. @param {import("./element.js").FacefoldsPlayer} element */
export function linkTo(element) {
  const page = new URL("./index.html", import.meta.url);
  page.searchParams.set("src", new URL(element.getAttribute("src"), document.baseURI).href.replace(page.origin, ""));
  page.hash = encode(element.state);
  return page.href;
}

/** Whether only this machine can reach an address: what `facefolds view` serves. */
export const isOwn = (address) => /^(localhost|127\..*|\[::1\])$/.test(new URL(address).hostname);

/** A path as a shell's one word. */
const shellQuoted = (path) => (/^[\w./~-]+$/.test(path) ? path : `'${path.replace(/'/g, "'\\''")}'`);

/**
 * HTML for a page of somebody else's. An address of this machine would be of no use there: then for the player and the
 * asset uploaded beside the page, and for one file.
 * @returns {{command: string, page: string, frame: string, element: string, own: boolean}} `own`: nobody else can reach what plays here
 */
export function embedCode(element) {
  const quoted = (text) => text.replace(/&/g, "&amp;").replace(/"/g, "&quot;");
  const asset = new URL(element.getAttribute("src"), document.baseURI).href;
  const own = isOwn(asset) || isOwn(import.meta.url);
  const script = own ? "player/facefolds-player.js" : new URL("./facefolds-player.js", import.meta.url).href;
  const source = own ? "player/asset/" : asset;
  const link = own ? `player/index.html?src=asset/#${encode(element.state)}` : linkTo(element);
  const name = (element.player?.manifest?.subject || "face").replace(/[^\w-]+/g, "_");
  const frame = (address) =>
    `<iframe src="${quoted(address)}" title="${name}" width="640" height="480" style="border: 0" loading="lazy" allow="fullscreen; clipboard-write"></iframe>`;
  return {
    command: `facefolds export-html ${shellQuoted(element.getAttribute("folder") ?? `data/${name}/asset`)} --out ${name}.html`,
    page: frame(`${name}.html`),
    frame: frame(link),
    element: `<script type="module" src="${quoted(script)}"></script>\n<facefolds-player src="${quoted(source)}" loading="lazy" style="height: 480px"></facefolds-player>`,
    own,
  };
}

/**
 * A picture as a file. @param {ImageData} picture premultiplied, as `capture` gives it
 * @param {{type?: string, quality?: number}} [options] of the browser's encoders @returns {Promise<Blob>} by default a PNG
 */
export async function asFile({ data, width, height }, { type = "image/png", quality } = {}) {
  const straight = new ImageData(width, height);
  for (let i = 0; i < data.length; i += 4) {
    const alpha = data[i + 3];
    for (let k = 0; k < 3; ++k) straight.data[i + k] = alpha ? Math.round((255 * data[i + k]) / alpha) : 0;
    straight.data[i + 3] = alpha;
  }
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(straight, 0, 0);
  return canvas.convertToBlob({ type, quality });
}

/** Offers a file for download. */
export function save(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 60000);
}

/** @returns {Promise<boolean>} whether the browser allowed it */
export async function toClipboard(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
