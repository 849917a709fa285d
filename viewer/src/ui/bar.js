/** The bar below: play, step, scrub, speed, loop, sound, compare, settings, share, full screen. */
import { isOwn, save, toClipboard } from "../sharing.js";
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
    sound: () => player.sound && (element.muted = !element.muted),
    compare: () => (element.comparison.index === null ? element.compare(0) : element.compare(null)),
    settings: () => {
      panel.hidden = !panel.hidden;
      settings.setAttribute("aria-expanded", String(!panel.hidden));
      (panel.hidden ? settings : panel.querySelector("button")).focus();
    },
    share: () => share(element),
    full: () => toggleFullScreen(element),
    close: () => element.compare(null),
    reset: () => element.reset(),
    picture: () => savePicture(element),
    record: () => saveTurn(element, root.querySelector('[data-do="record"]')),
    embed: () => element.openEmbed(),
    dismiss: () => dismiss(element),
    vr: () => immerse(element, "vr"),
    ar: () => immerse(element, "ar"),
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
    find(".count").textContent = frame < 0 ? "" : `${frame + 1} / ${frames}`;
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
  for (const name of ["share", "embed"]) root.querySelector(`[data-do="${name}"]`).hidden = !element.shareable;
  player.addEventListener("ready", () => {
    if (navigator.xr)
      import("../xr.js").then(({ offers }) => {
        for (const kind of ["vr", "ar"])
          offers(kind).then((offered) => (find(`[data-do="${kind}"]`).hidden = !offered));
      });
    compare.hidden = player.manifest.photos.length === 0;
    showFrame();
  });
  for (const name of ["play", "pause", "change", "ready"]) player.addEventListener(name, showState);
  showState();
}

/** Into the headset or the room, or out again. @param {import("../xr.js").Kind} kind */
async function immerse(element, kind) {
  const { player } = element;
  const button = element.shadowRoot.querySelector(`[data-do="${kind}"]`);
  if (player.immersed) return player.immersion.end();
  if (!element.ready) return;
  const { Immersion } = await import("../xr.js");
  player.immersion = new Immersion(player, kind, () => button.setAttribute("aria-pressed", "false"));
  try {
    await player.immersion.start();
    button.setAttribute("aria-pressed", "true");
  } catch (error) {
    const device = kind === "vr" ? "headset" : "camera";
    element.overlays.say(`The ${device} cannot be used: ${error.message}`, 8000);
  }
}

async function share(element) {
  const { link } = element;
  // Without permission: to be copied by hand.
  if (await toClipboard(link))
    element.overlays.say(isOwn(link) ? "Link copied: it opens on this machine alone" : "Link copied");
  else element.overlays.say(link, 15000);
}

async function toggleFullScreen(element) {
  try {
    if (document.fullscreenElement) await document.exitFullscreen();
    else await element.requestFullscreen();
  } catch {
    element.overlays.say("This browser does not allow full screen here");
  }
}

const fileName = (element) => (element.player.manifest.subject || "facefolds").replace(/[^\w-]+/g, "_");

async function savePicture(element) {
  if (element.ready) save(await element.screenshot(), `${fileName(element)}-${element.frame + 1}.png`);
}

/** Begins to record, or ends what is being recorded; what was recorded is saved. */
async function saveTurn(element, button) {
  if (element.recording) return element.recording.abort();
  if (!element.ready) return;
  element.recording = new AbortController();
  button.setAttribute("aria-pressed", "true");
  const onPart = (part) =>
    element.overlays.say(`Recording, ${Math.round(100 * part)} %. Press again to end it early.`, 8000);
  onPart(0);
  try {
    const film = await element.record({ signal: element.recording.signal, onPart });
    save(film, `${fileName(element)}-turn.${film.type.split("/")[1]}`);
    element.overlays.say("Saved");
  } catch (error) {
    element.overlays.say(error.remedy ? `${error.message}. ${error.remedy}` : `Not recorded: ${error.message}`, 12000);
  } finally {
    element.recording = null;
    button.setAttribute("aria-pressed", "false");
  }
}

/** Escape: closes what lies over the picture, the last first. */
function dismiss(element) {
  const panel = element.shadowRoot.querySelector(".panel");
  if (!panel.hidden) element.actions.settings();
  else element.compare(null);
}
