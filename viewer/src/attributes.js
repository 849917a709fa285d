/** What attributes mean that <model-viewer> has, too. */

const DEGREES = { deg: 1, rad: 180 / Math.PI };
const UNITS = { m: 1, cm: 0.01, mm: 0.001 };
const FIELDS = [5, 90]; // degrees
export const FIELD_OF_VIEW = 30; // degrees; facefolds_core/packaging/poster.py has it, too
const FIRST = ["camera-orbit", "camera-target", "field-of-view"];
const ENDS = ["min-camera-orbit", "max-camera-orbit"];
export const OF_THE_VIEW = [...FIRST, ...ENDS, "auto-rotate", "disable-zoom", "disable-pan"];

/** Properties that are attributes by another name, and what they are without. */
const PROPERTIES = {
  ...{ cameraOrbit: "", cameraTarget: "", fieldOfView: "", minCameraOrbit: "", maxCameraOrbit: "" },
  ...{ autoRotate: false, disableZoom: false, disablePan: false, disableTap: false },
  ...{ exposure: 1, reveal: "auto", src: "", alt: "", poster: "", loading: "auto" },
};

/**
 * @typedef {{azimuth?: number, elevation?: number, distance?: number, share?: number, target?: (number | undefined)[]}} Asked
 *   degrees, units of the scene, and of the distance that shows all; what is left out stays
 */

/** @returns {number | undefined} degrees; undefined: none of its business, such as "auto" */
function degrees(text) {
  const [, number, unit] = /^(-?\d*\.?\d+)(deg|rad)$/.exec(text ?? "") ?? [];
  return unit && Number(number) * DEGREES[unit];
}

/**
 * Where the first view is from: "theta phi radius", such as "30deg 80deg 120%". Theta goes to the subject's left, phi is
 * counted from above (90deg: level), the radius is in units of the scene ("1.5m") or a share of what shows all; "auto" leaves
 * a part as it is.
 * @param {string | null} text @returns {Asked}
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

/**
 * What the first view looks at: "0m 0.1m auto", glTF's axes (to the subject's left, up, before it).
 * @param {string | null} text @returns {Asked} in the scene's own axes; "auto": the middle
 */
export function targetOf(text) {
  const parts = (text ?? "").trim().split(/\s+/);
  const [left, up, before] = [0, 1, 2].map((i) => {
    const [, number, unit] = /^(-?\d*\.?\d+)(m|cm|mm)$/.exec(parts[i] ?? "") ?? [];
    return unit && Number(number) * UNITS[unit];
  });
  return { target: [before, left, up] };
}

/** @param {string | null} text such as "20deg" @returns {number} degrees */
export function fieldOfView(text) {
  return Math.max(FIELDS[0], Math.min(FIELDS[1], degrees(text?.trim()) ?? FIELD_OF_VIEW));
}

/**
 * Does what attributes say of the view.
 * @param {HTMLElement} element @param {import("./player.js").Player} player @param {string} [changed] one of them; all otherwise
 */
export function applyToView(element, player, changed) {
  const { view } = player;
  const has = (name) => element.hasAttribute(name);
  [view.zooms, view.pans] = [!has("disable-zoom"), !has("disable-pan")];
  const concerns = (names) => !changed || names.includes(changed);
  if (concerns("auto-rotate")) view.setRotation(has("auto-rotate"));
  if (concerns(ENDS)) view.setAllowed(ENDS.map((name) => orbitOf(element.getAttribute(name))));
  const [orbit, target, field] = FIRST.map((name) => element.getAttribute(name));
  if (concerns(FIRST)) player.setFirst({ ...orbitOf(orbit), ...targetOf(target) }, fieldOfView(field));
}

/** @param {HTMLElement} element @returns {number} factor of the light; 1 where nothing sensible is asked for */
export function exposureOf(element) {
  const factor = parseFloat(element.getAttribute("exposure"));
  return factor >= 0 && factor < Infinity ? factor : 1;
}

/** Gives an element a property for each of these attributes, as <model-viewer> has. @param {HTMLElement} prototype */
export function reflect(prototype) {
  for (const [name, without] of Object.entries(PROPERTIES)) {
    const attribute = name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
    Object.defineProperty(prototype, name, {
      configurable: true,
      enumerable: true,
      get() {
        if (without === false) return this.hasAttribute(attribute);
        return typeof without === "number" ? exposureOf(this) : (this.getAttribute(attribute) ?? without);
      },
      set(value) {
        if (without === false) this.toggleAttribute(attribute, Boolean(value));
        else this.setAttribute(attribute, value);
      },
    });
  }
}
