/** Keys, while the player (or anything in it that does not need the key itself) has the focus, or the page is all its. */

const TURN = 5; // degrees
const ZOOM = 1.1;
const SPEEDS = [0.1, 0.25, 0.5, 1, 1.5, 2];

/** @param {import("../element.js").FacefoldsPlayer} element @returns {() => void} ends it */
export function connectKeys(element) {
  const { player, shadowRoot: root } = element;
  const act = (name) => () => element.actions[name]();
  const flip = (name) => () => (element[name] = !element[name]);
  const held = () => player.view.exact || element.getAttribute("camera-controls") === "none";
  const turn = (azimuth, elevation) => () => held() || player.view.move(azimuth, elevation);
  const zoom = (factor) => () => held() || !player.view.zooms || player.view.move(0, 0, factor);
  const faster = (by) => () => {
    const next = SPEEDS.findIndex((speed) => speed >= element.speed) + by;
    element.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, next))];
  };
  const keys = {
    " ": act("play"), k: act("play"), ArrowLeft: act("back"), ArrowRight: act("next"), ",": act("back"), ".": act("next"),
    Home: () => element.seek(0), End: () => element.seek(element.frames - 1), "<": faster(-1), ">": faster(1), l: act("loop"),
    "+": zoom(1 / ZOOM), "=": zoom(1 / ZOOM), "-": zoom(ZOOM), 0: act("reset"), w: flip("wireframe"), e: flip("effects"),
    p: () => (element.spread = element.spread > 0 ? 0 : 1), m: act("sound"), f: act("full"),
    c: () => player.manifest?.photos.length && element.actions.compare(),
    s: () => element.overlays.showStatistics(!element.overlays.statistics),
    Escape: act("dismiss"), i: act("picture"),
  }; // prettier-ignore
  const shifted = {
    ArrowLeft: turn(-TURN, 0),
    ArrowRight: turn(TURN, 0),
    ArrowUp: turn(0, TURN),
    ArrowDown: turn(0, -TURN),
  };
  const listening = new AbortController();
  const press = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !element.ready) return;
    if (event.target.closest("dialog")) return; // it knows Escape by itself
    if (needsKeys(event.target, event.key)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const digit = /^[1-9]$/.test(key) && Number(key) <= element.layers.length;
    const layer = () => (element.layers = element.layers.map((on, i) => (i === Number(key) - 1 ? !on : on)));
    const action = event.shiftKey && key in shifted ? shifted[key] : digit ? layer : keys[key];
    if (!action) return;
    event.preventDefault();
    action();
  };
  element.press = press;
  root.addEventListener("keydown", press, { signal: listening.signal });
  return () => listening.abort();
}

/** Controls that use the key themselves. */
function needsKeys(target, key) {
  if (target.matches("select, textarea, input[type=color]")) return key !== "Escape";
  if (target.matches("input[type=range]"))
    return key.startsWith("Arrow") || ["Home", "End", "PageUp", "PageDown"].includes(key);
  if (target.matches("button, input, summary")) return key === " " || key === "Enter";
  return false;
}
