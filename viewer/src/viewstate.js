/** What can be shared of a view, as the part of an address behind "#": short, readable, checked when it is read. */

/**
 * @typedef {{frame?: number, view?: Partial<import("./camera.js").Orbit>,
 *   level?: string, background?: string, hidden?: number[], spread?: number, wireframe?: boolean, effects?: boolean,
 *   mode?: string, speed?: number, loop?: boolean, photo?: number}} ViewState layers and photos by index; defaults may be left out
 */

const MODES = ["colour", "alpha", "depth", "uv"];

/** @param {ViewState} state @returns {string} such as "view=12.5,4,2.1,0,0,0&frame=7" */
export function encode(state) {
  const parts = [];
  const add = (key, value) => parts.push(`${key}=${value}`);
  if (state.view) {
    const { azimuth, elevation, distance, target } = state.view;
    add("view", [azimuth, elevation, distance, ...target].map((number) => +number.toFixed(4)).join(","));
  }
  if (state.frame !== undefined) add("frame", state.frame);
  if (state.level) add("level", state.level);
  if (state.background) add("background", encodeURIComponent(state.background.replace(/^#/, "")));
  if (state.hidden?.length) add("hidden", state.hidden.join(","));
  if (state.spread) add("spread", +state.spread.toFixed(3));
  if (state.wireframe) add("wireframe", 1);
  if (state.mode && state.mode !== "colour") add("mode", state.mode);
  if (state.effects === false) add("effects", 0);
  if (state.speed !== undefined && state.speed !== 1) add("speed", state.speed);
  if (state.loop === false) add("loop", 0);
  if (state.photo !== undefined) add("photo", state.photo);
  return parts.join("&");
}

/** @param {string} text with or without "#" @returns {ViewState} what could be read; nonsense is left out */
export function decode(text) {
  const given = new URLSearchParams(text.replace(/^#/, ""));
  const numbers = (key) => (given.get(key) ?? "").split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
  const state = {};
  const [azimuth, elevation, distance, ...target] = numbers("view");
  const view = { azimuth, elevation, distance, target };
  if (isOrbit(view)) state.view = view;
  const one = (key, good) => {
    const [value] = numbers(key);
    if (Number.isFinite(value) && good(value)) state[key] = value;
  };
  one("frame", (k) => Number.isInteger(k) && k >= 0);
  one("spread", (s) => s >= 0 && s <= 1);
  one("speed", (s) => s > 0 && s <= 8);
  one("photo", (i) => Number.isInteger(i) && i >= 0);
  if (/^[a-z0-9_-]+$/.test(given.get("level") ?? "")) state.level = given.get("level");
  const background = given.get("background") ?? "";
  if (/^([0-9a-f]{3,4}|[0-9a-f]{6}|[0-9a-f]{8})$/i.test(background)) state.background = `#${background}`;
  else if (/^([a-z]{3,24}|(rgb|hsl|hwb|lab|lch|oklab|oklch|color)a?\([a-z0-9 ,./%-]{3,50}\))$/i.test(background))
    state.background = background; // a name, or rgb(...)
  if (MODES.includes(given.get("mode"))) state.mode = given.get("mode");
  if (given.has("hidden")) state.hidden = numbers("hidden").filter((i) => Number.isInteger(i) && i >= 0);
  for (const key of ["wireframe", "effects", "loop"]) if (given.has(key)) state[key] = given.get(key) !== "0";
  return state;
}

/** @param {Partial<import("./camera.js").Orbit>} orbit @returns {boolean} whether its parts are numbers that mean a view */
export function isOrbit({ azimuth = 0, elevation = 0, distance = 1, target = [0, 0, 0] }) {
  return [azimuth, elevation, distance, ...target].every(Number.isFinite) && target.length === 3 && distance > 0;
}
