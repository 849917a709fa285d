/** What attributes mean that <model-viewer> has, too. */

const DEGREES = { deg: 1, rad: 180 / Math.PI };
const FIELDS = [5, 90]; // degrees
export const FIELD_OF_VIEW = 30; // degrees; facefolds_core/packaging/poster.py has it, too

/** @returns {number | undefined} degrees; undefined: none of its business, such as "auto" */
function degrees(text) {
  const [, number, unit] = /^(-?\d*\.?\d+)(deg|rad)$/.exec(text ?? "") ?? [];
  return unit && Number(number) * DEGREES[unit];
}

/**
 * Where the first view is from: "theta phi radius", such as "30deg 80deg 120%". Theta goes to the subject's left, phi is
 * counted from above (90deg: level), the radius is in units of the scene ("1.5m") or a share of what shows all; "auto" leaves
 * a part as it is.
 * @param {string | null} text @returns {{azimuth?: number, elevation?: number, distance?: number, share?: number}}
 */
export function orbitOf(text) {
  const [theta, phi, radius] = (text ?? "").trim().split(/\s+/);
  const [, number, unit] = /^(\d*\.?\d+)(m|%)$/.exec(radius ?? "") ?? [];
  const [azimuth, above] = [degrees(theta), degrees(phi)];
  return {
    ...(azimuth !== undefined && { azimuth }),
    ...(above !== undefined && { elevation: 90 - above }),
    ...(unit === "m" && { distance: Number(number) }),
    ...(unit === "%" && { share: Number(number) / 100 }),
  };
}

/** @param {string | null} text such as "20deg" @returns {number} degrees */
export function fieldOfView(text) {
  return Math.max(FIELDS[0], Math.min(FIELDS[1], degrees(text?.trim()) ?? FIELD_OF_VIEW));
}
