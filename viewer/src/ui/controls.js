/** All controls of the player, put together; what they need of the element's size and gestures. */
import { IDENTITY, transformed } from "../matrices.js";
import { clipOf, surfaceUnder } from "../surface.js";
import { connectBar } from "./bar.js";
import { Comparison } from "./compare.js";
import { connectEmbed } from "./embed.js";
import { connectIdle } from "./idle.js";
import { connectKeys } from "./keys.js";
import { connectPanel } from "./panel.js";

const AGAIN = 1000; // ms without what a word is about, before it is said a second time
const [HELD, AFTER] = [600000, 1500]; // ms of a word while, and after, somebody pushes against the limit
const PROMPT = 3000; // ms until it is said what one can do
const RATIO = 2; // pixels of the canvas for a CSS pixel, at most

/** @param {import("../element.js").FacefoldsPlayer} element @returns {() => void} ends it */
export function connectControls(element) {
  const { player, shadowRoot: root } = element;
  const stage = root.querySelector(".stage");
  const [bar, panel] = [".bar", ".panel"].map((name) => root.querySelector(name));
  element.comparison = new Comparison(element);
  connectBar(element);
  connectPanel(element);
  connectEmbed(element);
  connectGesturesOf(element);
  const [keys, idle] = [connectKeys(element), connectIdle(element)];
  const resizing = new ResizeObserver(() => {
    // The bar, and on a phone the open sheet of the settings: the head stands above them.
    const sheet = panel.offsetHeight && panel.offsetTop > stage.clientHeight / 3;
    const top = sheet ? panel.offsetTop : bar.offsetTop;
    const below = bar.offsetHeight ? stage.clientHeight - top : 0;
    player.resize(stage.clientWidth, stage.clientHeight, Math.min(RATIO, devicePixelRatio), below);
  });
  for (const part of [stage, bar, panel]) resizing.observe(part);
  return () => {
    resizing.disconnect();
    keys();
    idle();
  };
}

/** The wheel zooms where that takes nothing from the page: with the focus, in full screen, or with Ctrl. */
function connectGesturesOf(element) {
  const { player, shadowRoot: root } = element;
  const own = () => element.getAttribute("gestures") === "all" || document.fullscreenElement === element;
  player.view.wheels = () => own() || root.activeElement !== null;
  let told = 0;
  let last = -Infinity; // times count from the opening of the page
  player.canvas.addEventListener("unwanted-wheel", ({ timeStamp }) => {
    if (timeStamp - last > AGAIN && told++ < 2) element.overlays.say("Ctrl + wheel zooms, or click first");
    last = timeStamp;
  });
  if (element.getAttribute("interaction-prompt") === "auto") prompt(element);
  player.canvas.addEventListener("dblclick", ({ clientX, clientY }) => {
    if (!element.hasAttribute("disable-tap") && element.ready)
      recentre(player, clipOf(player.canvas, clientX, clientY));
  });
  tellLimit(element);
}

/** What fades is told as long as somebody pushes against it. */
function tellLimit({ player, overlays }) {
  let pushed = false;
  const say = (milliseconds) => overlays.say("Cameras saw too little from further round", milliseconds);
  player.canvas.addEventListener("limit", () => {
    if (!pushed) say(HELD);
    pushed = true;
  });
  player.canvas.addEventListener("rest", () => {
    if (pushed) say(AFTER);
    pushed = false;
  });
}

/** Brings a place of the head to the middle; beside the head, the first view comes back. */
function recentre(player, at) {
  const { view, renderer } = player;
  if (view.exact || view.free) return;
  const hit = surfaceUnder(player, at);
  view.glide(hit ? { target: transformed(renderer.pose ?? IDENTITY, hit.point) } : view.home);
  view.atHome = !hit;
}

/** Says what one can do, where nobody has done it yet. */
function prompt({ player, overlays }) {
  let done = false;
  player.canvas.addEventListener("pointerdown", () => (done = true), { once: true });
  player.addEventListener("ready", () =>
    setTimeout(() => done || player.closed || overlays.say("Drag to turn"), PROMPT),
  );
}
