/**
 * Mouse and touch on the picture. A page around it goes on scrolling: a vertical stroke of one finger is the page's, and
 * so is the wheel unless the player has the focus or Ctrl is held. Two fingers, and horizontal strokes, are the view's.
 */

const SLOP = 6; // CSS pixels that a finger moves before it is known where to
const WHEEL = 0.0012; // a pixel of the wheel, as a share of the distance

/** @param {HTMLElement} surface @param {import("./view.js").View} view */
export function connectGestures(surface, view) {
  const listening = new AbortController();
  const pointers = new Map(); // id -> {x, y, pans}
  const on = (name, act, options = {}) => surface.addEventListener(name, act, { ...options, signal: listening.signal });
  const spot = ({ clientX: x, clientY: y }) => ({ x, y });
  const middle = (points) => ({
    x: points.reduce((sum, { x }) => sum + x, 0) / points.length,
    y: points.reduce((sum, { y }) => sum + y, 0) / points.length,
  });
  const gap = ([a, b]) => Math.hypot(a.x - b.x, a.y - b.y);
  const fromMiddle = ({ x, y }) => {
    const box = surface.getBoundingClientRect();
    return [x - box.x - box.width / 2, y - box.y - box.height / 2];
  };

  const lift = (event) => {
    if (pointers.delete(event.pointerId) && !pointers.size) view.rest();
  };

  on("pointerdown", (event) => {
    if (view.exact || event.button > 2) return;
    surface.setPointerCapture(event.pointerId);
    const pans = event.button > 0 || event.ctrlKey || event.metaKey || event.shiftKey;
    // A finger's stroke is the page's until it turns out to go across.
    const undecided = event.pointerType === "touch" && getComputedStyle(surface).touchAction !== "none";
    pointers.set(event.pointerId, { ...spot(event), pans, undecided });
    view.touched();
  });
  on("pointermove", (event) => {
    const held = pointers.get(event.pointerId);
    if (!held) return;
    if (held.undecided && pointers.size === 1) {
      const [across, along] = [Math.abs(event.clientX - held.x), Math.abs(event.clientY - held.y)];
      if (Math.max(across, along) < SLOP) return;
      if (along > across) return lift(event);
    }
    for (const pointer of pointers.values()) pointer.undecided = false;
    const before = [...pointers.values()].map((point) => ({ ...point }));
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    Object.assign(held, spot(event));
    if (pointers.size === 1) {
      if (held.pans && view.pans) view.pan(dx, dy);
      else view.turn(dx / surface.clientHeight, dy / surface.clientHeight);
    } else if (pointers.size === 2) {
      const after = [...pointers.values()];
      const [from, to] = [middle(before), middle(after)];
      view.pan(to.x - from.x, to.y - from.y);
      view.zoom(Math.max(1, gap(before)) / Math.max(1, gap(after)), ...fromMiddle(to));
    }
  });
  on("pointerup", lift);
  on("pointercancel", lift);
  on("lostpointercapture", lift);
  on("contextmenu", (event) => event.preventDefault());
  on(
    "wheel",
    (event) => {
      if (view.exact || !view.zooms) return;
      if (!event.ctrlKey && !view.wheels?.()) {
        surface.dispatchEvent(new CustomEvent("unwanted-wheel", { bubbles: true }));
        return;
      }
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? surface.clientHeight : 1;
      const pinch = event.ctrlKey && Math.abs(event.deltaY) < 50 ? 6 : 1; // trackpads send pinches as small Ctrl + wheel
      view.zoom(Math.exp(WHEEL * pinch * lines * event.deltaY), ...fromMiddle(spot(event)));
    },
    { passive: false },
  );
  return { dispose: () => listening.abort() };
}
