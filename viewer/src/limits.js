/** The part of the orbit that was filmed: movements beyond it meet resistance, and the picture fades there. */

const FREE = 4; // degrees beyond the outermost cameras that are as good as filmed
const SOFT = 22; // degrees that a movement can be pushed beyond at most
const FAINTEST = 0.06;
const ROUND = 300; // degrees: cameras that go round so far have filmed from everywhere

/** @typedef {{azimuth: [number, number], elevation: [number, number]}} Range degrees, of the manifest's `view` */

/** @param {Range | null} range @returns {Range} with the free margin; infinite where nothing bounds it */
export function bounded(range) {
  const all = [-Infinity, Infinity];
  if (!range) return { azimuth: all, elevation: [-89, 89] };
  const [a, b] = range.azimuth;
  const [low, high] = range.elevation;
  return {
    azimuth: b - a >= ROUND ? all : [a - FREE, b + FREE],
    elevation: [Math.max(-89, low - FREE), Math.min(89, high + FREE)],
  };
}

export const clamp = (value, [low, high]) => Math.max(low, Math.min(high, value));

/** Where a movement to `value` ends: the further beyond, the harder it gets. */
export function resisted(value, range) {
  const inside = clamp(value, range);
  const excess = value - inside;
  return inside + Math.sign(excess) * SOFT * (1 - Math.exp(-Math.abs(excess) / SOFT));
}

/** How strong the picture is: 1 within the range, nearly nothing at the furthest that one can push. */
export function strength({ azimuth, elevation }, range) {
  const beyond = Math.max(
    Math.abs(azimuth - clamp(azimuth, range.azimuth)),
    Math.abs(elevation - clamp(elevation, range.elevation)),
  );
  const t = Math.min(1, beyond / SOFT);
  return 1 - (1 - FAINTEST) * t * t * (3 - 2 * t);
}

/** The same direction, as near to the middle of the range as whole turns allow. */
export function unwound(azimuth, [low, high]) {
  const middle = Number.isFinite(low) ? (low + high) / 2 : 0;
  return azimuth - 360 * Math.round((azimuth - middle) / 360);
}
