/** The bar below: play, step, scrub, speed, loop, sound, compare, settings, share, full screen. */
import { ICONS } from "./template.js";

/** @param {import("../element.js").FacefoldsPlayer} element */
export function connectBar(element) {
  const root = element.shadowRoot;
  const { player } = element;
  const find = (selector) => root.querySelector(`.bar ${selector}`);
  const [play, loop, sound, compare, settings] = ["play", "loop", "sound", "compare", "settings"].map((name) =>
    find(`[data-do="${name}"]`),
  );
  const scrubber = find('[name="frame"]');
  const speed = find('[name="speed"]');
  const panel = root.querySelector(".panel");

  const actions = {
    play: () => (element.playing ? element.pause() : element.play()),
    back: () => element.step(-1),
    next: () => element.step(1),
    loop: () => (element.loop = !element.loop),
    sound: () => toggleSound(player),
    compare: () => (element.comparison.index === null ? element.compare(0) : element.compare(null)),
    settings: () => {
      panel.hidden = !panel.hidden;
      settings.setAttribute("aria-expanded", String(!panel.hidden));
      (panel.hidden ? settings : panel.querySelector("button")).focus();
    },
    share: () => element.share(),
    full: () => element.toggleFullScreen(),
    close: () => element.compare(null),
    reset: () => element.resetView(),
  };
  element.actions = actions;
  root.querySelector(".stage").addEventListener("click", (event) => {
    actions[event.target.closest("[data-do]")?.dataset.do]?.();
  });

  let resume = false; // scrubbing pauses, and goes on where it played
  scrubber.addEventListener("pointerdown", () => {
    resume = element.playing;
    element.pause();
  });
  scrubber.addEventListener("input", () => {
    element.pause();
    element.seek(Number(scrubber.value));
  });
  scrubber.addEventListener("change", () => {
    if (resume) element.play();
    resume = false;
  });
  speed.addEventListener("change", () => (element.speed = Number(speed.value)));

  const showFrame = () => {
    const { frames, frame } = element;
    scrubber.max = frames - 1;
    scrubber.value = Math.max(0, frame);
    scrubber.style.setProperty("--p", `${frames > 1 ? (100 * Math.max(0, frame)) / (frames - 1) : 0}%`);
    scrubber.setAttribute("aria-valuetext", `frame ${frame + 1} of ${frames}`);
    find("output").textContent = frame < 0 ? "" : `${frame + 1} / ${frames}`;
  };
  const showState = () => {
    const name = element.playing ? "Pause" : "Play";
    play.innerHTML = element.playing ? ICONS.pause : ICONS.play;
    play.setAttribute("aria-label", name);
    play.title = `${name} (Space)`;
    loop.setAttribute("aria-pressed", String(element.loop));
    speed.value = String(element.speed);
    sound.hidden = !player.sound;
    sound.innerHTML = player.sound?.muted ? ICONS.mute : ICONS.sound;
    sound.setAttribute("aria-pressed", String(player.sound ? !player.sound.muted : false));
    const still = element.frames < 2;
    for (const control of [play, find('[data-do="back"]'), find('[data-do="next"]'), scrubber])
      control.disabled = still;
  };
  player.addEventListener("frame", showFrame);
  player.addEventListener("ready", () => {
    compare.hidden = player.manifest.photos.length === 0;
    showFrame();
  });
  for (const name of ["play", "pause", "change", "ready"]) player.addEventListener(name, showState);
  showState();
}

function toggleSound(player) {
  if (!player.sound) return;
  player.sound.muted = !player.sound.muted;
  player.dispatchEvent(new Event("change"));
}
