/** What the player shows and what it costs. */
import { weight } from "./draco/decoder.js";
import { gpuBytes } from "./levels.js";

/** @param {import("./player.js").Player} player @returns {import("../types.js").Statistics} */
export function statisticsOf(player) {
  const info = player.level?.info;
  const [width, height] = player.size;
  const { side, graphics } = player.renderer;
  const { width: across, height: tall } = graphics.finer || { width: 0, height: 0 };
  return {
    fps: player.drawn.length > 1 ? ((player.drawn.length - 1) * 1000) / (player.drawn.at(-1) - player.drawn[0]) : 0,
    layers: info?.layers.length ?? 0,
    triangles: info?.layers.reduce((sum, layer, i) => sum + (player.visible[i] ? layer.triangles : 0), 0) ?? 0,
    bytesLoaded: (player.files?.loaded ?? 0) + weight.loaded,
    // Canvases: two of colour, one of depth. The finer picture, which all players share, has colour and depth.
    gpuBytes: player.level ? gpuBytes(player.level) + 12 * width * height + 8 * across * tall : 0,
    level: info?.name ?? "",
    texture: info ? [info.texture.width, info.texture.height] : [0, 0],
    canvas: [width, height],
    rays: side * side,
    video: player.level?.video.codec ?? "",
    decoder: player.level?.source.kind ?? "",
  };
}
