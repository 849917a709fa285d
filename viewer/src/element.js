/** <facefolds-player src="folder/">: the player with its controls, in a shadow root. docs/guide/viewer.md is its manual. */
import { PlayerError } from "./errors.js";
import { Player } from "./player.js";
import { connectBar } from "./ui/bar.js";
import { Comparison } from "./ui/compare.js";
import { connectKeys } from "./ui/keys.js";
import { Overlays } from "./ui/overlays.js";
import { connectPanel } from "./ui/panel.js";
import { TEMPLATE } from "./ui/template.js";
import { encode } from "./viewstate.js";

const BACKGROUND = "#16181d";
const FORWARDED = ["ready", "level", "frame", "play", "pause", "change", "error"];

export class FacefoldsPlayer extends HTMLElement {
  static observedAttributes = ["src", "background", "loop", "speed"];

  #player = null;
  #state = {}; // what is to be applied when the first picture is there
  #settings = { background: BACKGROUND, spread: 0, wireframe: false, effects: true };

  constructor() {
    super();
    this.attachShadow({ mode: "open" });
  }

  connectedCallback() {
    this.#start();
  }

  disconnectedCallback() {
    this.#stop();
  }

  attributeChangedCallback(name, before, now) {
    if (!this.isConnected || before === now) return;
    if (name === "src") this.#start();
    if (name === "background" && now) this.background = now;
    if (name === "loop") this.loop = now !== "false";
    if (name === "speed" && Number(now) > 0) this.speed = Number(now);
  }

  /** Loads the asset named by `src` (again). */
  async #start() {
    this.#stop();
    this.shadowRoot.innerHTML = TEMPLATE;
    this.overlays = new Overlays(this);
    this.shadowRoot.querySelector('[data-do="again"]').addEventListener("click", () => this.#start());
    if (!this.hasAttribute("src"))
      return this.overlays.fail(
        new PlayerError("No asset was named", {
          kind: "missing",
          remedy: "Give the player the attribute src: the address of an asset's folder.",
        }),
      );
    try {
      this.#player = new Player(this.shadowRoot.querySelector("canvas"));
    } catch (error) {
      return this.#failed(error);
    }
    const player = this.#player;
    this.#connect(player);
    const folder = new URL(this.getAttribute("src").replace(/\/?(manifest\.json)?$/, "/"), document.baseURI).href;
    try {
      await player.load(folder, this.#state.level ?? this.getAttribute("level") ?? "auto");
      if (player === this.#player) this.overlays.loaded();
    } catch (error) {
      if (player === this.#player) this.#failed(error);
    }
  }

  #connect(player) {
    player.playback.loop = this.getAttribute("loop") !== "false";
    player.playback.speed = Number(this.getAttribute("speed")) || 1;
    this.#settings.background = this.getAttribute("background") ?? BACKGROUND;
    const stage = this.shadowRoot.querySelector(".stage");
    this.resizing = new ResizeObserver(() => {
      player.resize(stage.clientWidth, stage.clientHeight, Math.min(2, devicePixelRatio));
    });
    this.resizing.observe(stage);
    this.comparison = new Comparison(this);
    connectBar(this);
    connectPanel(this);
    connectKeys(this);
    this.overlays.connect(player);
    player.addEventListener("ready", () => this.#begin());
    player.addEventListener("error", ({ detail }) => this.#failed(detail));
    for (const name of FORWARDED) {
      player.addEventListener(name, ({ detail }) => this.dispatchEvent(new CustomEvent(name, { detail })));
    }
  }

  /** The first picture is there: what was asked for beforehand is set. */
  #begin() {
    const state = this.#state;
    this.#state = {};
    this.background = this.#settings.background;
    this.state = { ...state, level: undefined };
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const rests = state.frame !== undefined || state.photo !== undefined;
    if (this.hasAttribute("autoplay") && !still && !rests) this.play();
  }

  #failed(error) {
    this.overlays.fail(error, this.#player?.level ? "notice" : "all");
    if (!this.#player) this.dispatchEvent(new CustomEvent("error", { detail: error }));
  }

  #stop() {
    this.resizing?.disconnect();
    this.#player?.close();
    this.#player = null;
  }

  /** The engine behind the element, for programs that need more than the element offers; null before it is connected. */
  get player() {
    return this.#player;
  }

  get ready() {
    return this.#player?.level != null;
  }

  get frame() {
    return this.#player?.shown ?? -1;
  }

  get frames() {
    return this.#player?.playback.frames ?? 0;
  }

  get fps() {
    return this.#player?.playback.fps ?? 0;
  }

  get playing() {
    return this.#player?.playing ?? false;
  }

  get loop() {
    return this.#player?.playback.loop ?? true;
  }

  set loop(on) {
    this.#playback("loop", Boolean(on));
  }

  get speed() {
    return this.#player?.playback.speed ?? 1;
  }

  set speed(factor) {
    if (factor > 0) this.#playback("speed", factor);
  }

  #playback(name, value) {
    if (!this.#player) return;
    this.#player.playback[name] = value;
    this.#player.dispatchEvent(new Event("change"));
  }

  get background() {
    return this.#settings.background;
  }

  /** @param {string} colour "#rrggbb" or "transparent" */
  set background(colour) {
    const hex = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(colour);
    if (!hex && colour !== "transparent")
      throw new TypeError(`a background is "#rrggbb" or "transparent", not "${colour}"`);
    this.#settings.background = colour;
    this.shadowRoot.querySelector(".stage").style.background = hex ? colour : "none";
    this.#player?.set("background", hex ? [...hex.slice(1).map((part) => parseInt(part, 16) / 255), 1] : [0, 0, 0, 0]);
  }

  get spread() {
    return this.#settings.spread;
  }

  set spread(amount) {
    this.#set("spread", Math.max(0, Math.min(1, Number(amount) || 0)));
  }

  get wireframe() {
    return this.#settings.wireframe;
  }

  set wireframe(on) {
    this.#set("wireframe", Boolean(on));
  }

  get effects() {
    return this.#settings.effects;
  }

  set effects(on) {
    this.#set("effects", Boolean(on));
  }

  #set(name, value) {
    this.#settings[name] = value;
    this.#player?.set(name, value);
  }

  /** Which layers are drawn, outermost first. */
  get layers() {
    return this.#player?.visible.slice() ?? [];
  }

  set layers(visible) {
    this.#player?.hide(visible.flatMap((on, i) => (on ? [] : [i])));
  }

  get level() {
    return this.#player?.level?.info.name ?? "";
  }

  set level(name) {
    this.#player?.setLevel(name).catch((error) => this.#failed(error));
  }

  /** Names of the levels that this machine can show, coarsest first. */
  get levels() {
    return this.#player?.choices ?? [];
  }

  get statistics() {
    return this.#player?.statistics;
  }

  play() {
    this.#player?.play();
  }

  pause() {
    this.#player?.pause();
  }

  /** @returns {Promise<boolean>} true when frame `k` has been drawn; false if another one was asked for meanwhile */
  async seek(k) {
    return (await this.#player?.seek(k)) ?? false;
  }

  /** Pauses, and moves by whole frames. */
  async step(by = 1) {
    return (await this.#player?.step(by)) ?? false;
  }

  resetView() {
    this.comparison?.close();
    this.#player?.view.reset();
  }

  /** @param {{K: number[][], w2c: number[][], width: number, height: number} | null} camera docs/reference/conventions.md; null: back to the orbit */
  setCamera(camera) {
    this.#player?.view.setExact(camera);
  }

  /** @param {object} [camera] as for `setCamera` @returns {ImageData} the frame shown, as drawn */
  capture(camera) {
    if (!this.#player) throw new PlayerError("Nothing has been loaded yet", { kind: "missing" });
    return this.#player.capture(camera);
  }

  /** Shows held-out photo `index` beside the asset, from the photo's camera and frame; null: closes. */
  compare(index) {
    return index === null ? this.comparison?.close() : this.comparison?.open(index);
  }

  /** @returns {import("./viewstate.js").ViewState} */
  get state() {
    const player = this.#player;
    if (!player?.level) return { ...this.#state };
    const { background, spread, wireframe, effects } = this.#settings;
    const hidden = this.layers.flatMap((on, i) => (on ? [] : [i]));
    return {
      ...(this.playing ? {} : { frame: this.frame }),
      ...(this.comparison.index === null ? { view: player.view.get() } : { photo: this.comparison.index }),
      ...(this.level === this.levels.at(-1) ? {} : { level: this.level }),
      ...(background === BACKGROUND || background === "transparent" ? {} : { background }),
      ...{ hidden, spread, wireframe, effects, speed: this.speed, loop: this.loop },
    };
  }

  set state(state) {
    if (!this.#player?.level) {
      this.#state = { ...this.#state, ...state };
      return;
    }
    const { frame, view, level, hidden, photo } = state;
    for (const key of ["background", "spread", "wireframe", "effects", "speed", "loop"]) {
      if (state[key] !== undefined) this[key] = state[key];
    }
    if (hidden) this.#player.hide(hidden);
    if (view) this.#player.view.set(view);
    if (level && level !== this.level && this.levels.includes(level)) this.level = level;
    if (photo !== undefined) this.compare(photo);
    else if (frame !== undefined) {
      this.pause();
      this.seek(frame);
    }
  }

  /** @returns {string} address of the full-page player with this asset and this view */
  get link() {
    const page = new URL("./index.html", import.meta.url);
    page.searchParams.set("src", new URL(this.getAttribute("src"), document.baseURI).href.replace(page.origin, ""));
    page.hash = encode(this.state);
    return page.href;
  }

  async share() {
    const { link } = this;
    try {
      await navigator.clipboard.writeText(link);
      this.overlays.say("Link copied");
    } catch {
      this.overlays.say(link, 15000); // no permission: to be copied by hand
    }
  }

  async toggleFullScreen() {
    try {
      if (document.fullscreenElement) await document.exitFullscreen();
      else await this.requestFullscreen();
    } catch {
      this.overlays.say("This browser does not allow full screen here");
    }
  }
}
