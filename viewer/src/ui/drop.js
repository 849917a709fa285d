/** An asset's folder, its files or a ZIP of them, dropped on the page. */
import { PlayerError } from "../errors.js";

const MANIFEST = "manifest.json";

/**
 * @param {DataTransfer} transfer
 * @returns {Promise<Map<string, Blob>>} name -> content of the files beside the first manifest.json
 * @throws {PlayerError} if there is none
 */
export async function droppedAsset(transfer) {
  const entries = Array.from(transfer.items, (item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = entries.length ? (await Promise.all(entries.map((entry) => read(entry)))).flat() : [];
  if (!files.length) files.push(...Array.from(transfer.files, (file) => [file.name, file]));
  return assetOf(files);
}

/** @param {[string, Blob][]} files path and content of each */
export async function assetOf(files) {
  if (files.length === 1 && files[0][0].toLowerCase().endsWith(".zip")) files = await unzipped(files[0][1]);
  const depth = (path) => path.split("/").length;
  const manifests = files.map(([path]) => path).filter((path) => path.split("/").at(-1) === MANIFEST);
  if (!manifests.length) {
    throw new PlayerError("There is no manifest.json in what was dropped", {
      kind: "missing",
      remedy: "Drop an asset's folder, all of its files, or a ZIP of them.",
    });
  }
  const folder = manifests.sort((a, b) => depth(a) - depth(b))[0].slice(0, -MANIFEST.length);
  const inside = files.filter(([path]) => path.startsWith(folder) && !path.slice(folder.length).includes("/"));
  return new Map(inside.map(([path, file]) => [path.slice(folder.length), file]));
}

async function read(entry) {
  const path = entry.fullPath.replace(/^\//, "");
  if (entry.isFile) return [[path, await new Promise((resolve, reject) => entry.file(resolve, reject))]];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject)); // at most 100 at a time
    if (!some.length) break;
    found.push(...some);
  }
  return (await Promise.all(found.map(read))).flat();
}

async function unzipped(file) {
  const { unzip } = await import("fflate");
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    const found = await new Promise((resolve, reject) =>
      unzip(bytes, (error, entries) => (error ? reject(error) : resolve(entries))),
    );
    return Object.entries(found)
      .filter(([path]) => !path.endsWith("/"))
      .map(([path, data]) => [path, new Blob([data])]);
  } catch (cause) {
    throw new PlayerError("The ZIP cannot be read", { cause, remedy: "Pack the asset's folder again." });
  }
}

/** @param {import("../element.js").FacefoldsPlayer} element that takes what is dropped anywhere on the page */
export function acceptDrops(element) {
  addEventListener("dragover", (event) => {
    event.preventDefault();
    element.toggleAttribute("dropping", true);
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) element.toggleAttribute("dropping", false);
  });
  addEventListener("drop", async (event) => {
    event.preventDefault();
    element.toggleAttribute("dropping", false);
    try {
      element.openFiles(await droppedAsset(event.dataTransfer));
    } catch (error) {
      element.overlays.fail(error, element.ready ? "notice" : "all");
    }
  });
}
