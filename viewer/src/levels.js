/** Loads one level of detail: its meshes, its view effects and the video with its first picture. */
import * as THREE from "three";
import { PlayerError } from "./errors.js";
import { decodeMesh } from "./meshes.js";
import { openVideo } from "./video/open.js";

/**
 * @typedef {{info: import("./manifest.js").Level, geometries: THREE.BufferGeometry[], texture: THREE.VideoFrameTexture,
 *   effects: THREE.Texture | null, reflection: THREE.Texture | null, source: import("./video/open.js").FrameSource,
 *   video: import("./manifest.js").VideoEntry, dispose: () => void}} LoadedLevel
 * @param {import("./manifest.js").Level} info
 * @param {import("./files.js").Files} files
 * @param {(error: Error) => void} onVideoError
 * @param {Set<string>} refused videos not to try
 * @returns {Promise<LoadedLevel>}
 */
export async function loadLevel(info, files, onVideoError, refused) {
  const [geometries, effects, opened, reflection] = await allOrNothing([
    Promise.all(info.layers.map(async (layer) => {
      const buffer = await files.bytes(layer.mesh);
      return decodeMesh(buffer, layer, files.address(layer.mesh.name));
    })),
    info.effects ? loadPicture(info.effects.file, files) : null,
    openVideo(info, files, onVideoError, refused),
    info.reflection ? loadPicture(info.reflection.file, files) : null,
  ]); // prettier-ignore
  const texture = new THREE.VideoFrameTexture();
  texture.colorSpace = THREE.NoColorSpace;
  texture.flipY = false; // rows run down, as in the format
  texture.generateMipmaps = false;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.setFrame(opened.first);
  const dispose = () => {
    for (const geometry of geometries) geometry.dispose();
    for (const one of [effects, reflection]) {
      one?.dispose();
      one?.image.close?.();
    }
    texture.dispose();
    opened.source.close();
  };
  return { info, geometries, texture, effects, reflection, source: opened.source, video: opened.video, dispose };
}

/** Like Promise.all, but a video opened in vain is closed. */
async function allOrNothing(work) {
  const done = await Promise.allSettled(work);
  const failed = done.find(({ status }) => status === "rejected");
  if (!failed) return done.map(({ value }) => value);
  done[2].value?.source.close();
  throw failed.reason;
}

async function loadPicture(entry, files) {
  const blob = new Blob([await files.bytes(entry)], { type: "image/png" });
  let image;
  try {
    image = await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  } catch (cause) {
    const file = files.address(entry.name);
    throw new PlayerError(`The picture ${entry.name} is damaged`, {
      file,
      cause,
      remedy: "Copy or make the asset again.",
    });
  }
  const texture = new THREE.Texture(image);
  texture.colorSpace = THREE.NoColorSpace;
  texture.flipY = false;
  texture.generateMipmaps = false;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** Bytes that a level keeps on the GPU: vertex data as uploaded (uint32 or uint16 indices) and RGBA textures. */
export function gpuBytes(level) {
  let bytes = 0;
  for (const geometry of level.geometries) {
    for (const attribute of [geometry.index, ...Object.values(geometry.attributes)])
      bytes += attribute.array.byteLength;
  }
  bytes += 4 * level.info.texture.width * level.info.texture.height;
  for (const one of [level.effects, level.reflection]) if (one) bytes += 4 * one.image.width * one.image.height;
  return bytes;
}
