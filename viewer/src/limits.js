/**
 * The part of the orbit from where the picture is good: movements beyond it meet resistance, and the picture fades there.
 *
 * The asset says how far that is, as measured when it was made. Where it does not, it is the middle of what was filmed: what
 * lies at the outline of a picture from an outermost camera, that camera saw alone, so that nothing told its depth, and hems
 * fray. A tenth of the range is left at each end.
 */

const KEPT = 0.8; // of the range that was filmed
const NEAR = 4; // degrees: so far from a camera, or from where all of them stood, a picture is as good
const SOFT = 22; // degrees that a movement can be pushed beyond at most
const FAINTEST = 0.3; // still seen: who pushes on knows that nothing has broken
const HEMS = { over: 4, from: 26, back: 100 }; // degrees: of the view until they have gone; beyond the outermost camera; at least
const ROUND = 300; // degrees: cameras that go round so far have filmed from everywhere

/**
 * @typedef {{azimuth: [number, number], elevation: [number, number]}} Range degrees
 * @typedef {Range & {good?: Range | null}} Filmed the manifest's `view`
 */

/** @param {Filmed | null} range that was filmed @returns {Range} its good part; infinite where nothing bounds it */
export function bounded(range) {
  const all = [-Infinity, Infinity];
  if (!range) return { azimuth: all, elevation: [-89, 89] };
  const { azimuth, elevation } = range.good ?? range;
  const [low, high] = range.good ? elevation : kept(elevation);
  const round = azimuth[1] - azimuth[0] >= ROUND;
  return {
    azimuth: round ? all : range.good ? azimuth : kept(azimuth),
    elevation: [Math.max(-89, low), Math.min(89, high)],
  };
}

/**
 * What of a range a page allows. @param {Range} range
 * @param {import("./view.js").Allowed} allowed least and most; from above is the least
 * @returns {Range} as it was in a direction that the page leaves nothing of
 */
export function narrowed(range, [least, most]) {
  const both = ([low, high], from = -Infinity, to = Infinity) =>
    Math.max(low, from) <= Math.min(high, to) ? [Math.max(low, from), Math.min(high, to)] : [low, high];
  return {
    azimuth: both(range.azimuth, least.azimuth, most.azimuth),
    elevation: both(range.elevation, most.elevation, least.elevation),
  };
}

/** Of a range of directions; the front, where the first view is from, stays if it was filmed. */
function kept([low, high]) {
  const [middle, half] = [(low + high) / 2, Math.max(NEAR, (KEPT * (high - low)) / 2)];
  const front = low - NEAR <= 0 && high + NEAR >= 0 ? 0 : middle;
  return [Math.min(front, middle - half), Math.max(front, middle + half)];
}

export const clamp = (value, [low, high]) => Math.max(low, Math.min(high, value));

/** From 0 to 1, gently at both ends. */
function smooth(part) {
  const t = clamp(part, [0, 1]);
  return t * t * (3 - 2 * t);
}

/** Where a movement to `value` ends: the further beyond, the harder it gets. */
export function resisted(value, range) {
  const inside = clamp(value, range);
  const excess = value - inside;
  return inside + Math.sign(excess) * SOFT * (1 - Math.exp(-Math.abs(excess) / SOFT));
}

/** How strong the picture is: 1 within the range, FAINTEST at the furthest that one can push. */
export function strength({ azimuth, elevation }, range) {
  const beyond = Math.max(
    Math.abs(azimuth - clamp(azimuth, range.azimuth)),
    Math.abs(elevation - clamp(elevation, range.elevation)),
  );
  return 1 - (1 - FAINTEST) * smooth(beyond / SOFT);
}

/**
 * What fades where the view is further round, higher or lower than it is good, or than any camera stood: the back of the
 * head, which the cameras saw aslant at best, and which ends in a torn edge.
 * @typedef {[number, number]} Hems from how far round, to the subject's right and left: radians about the upright axis
 * @param {{azimuth: number, elevation: number}} view @param {Filmed | null} filmed @param {Range} range its good part
 * @returns {Hems | null} null: nothing does
 */
export function hemsFrom(view, filmed, range) {
  if (!filmed || !Number.isFinite(range.azimuth[0])) return null;
  const seen = { ...view, azimuth: unwound(view.azimuth, range.azimuth) };
  const past = (angle, side, i) => side * seen[angle] - Math.min(side * filmed[angle][i], side * range[angle][i]);
  const beyond = Math.max(...["azimuth", "elevation"].flatMap((angle) => [past(angle, -1, 0), past(angle, 1, 1)]));
  if (beyond <= 0) return null;
  const part = smooth(beyond / HEMS.over);
  return [-1, 1].map((side, i) => {
    const from = clamp(side * filmed.azimuth[i] + HEMS.from, [HEMS.back, 180]);
    return ((180 + part * (from - 180)) * Math.PI) / 180;
  });
}

/** The same direction, as near to the middle of the range as whole turns allow. */
export function unwound(azimuth, [low, high]) {
  const middle = Number.isFinite(low) ? (low + high) / 2 : 0;
  return azimuth - 360 * Math.round((azimuth - middle) / 360);
}
