/** <facefolds-player src="folder/">: the player with its controls, in a shadow root. docs/guide/viewer.md is its manual. */
import { PlayerApi } from "./api.js";
import { applyToView, exposureOf, OF_THE_VIEW, reflect } from "./attributes.js";
import { backdropImage, BACKDROPS, isBackground, isLight, numbersOf, painted, prefersDark } from "./colours.js";
import { PlayerError } from "./errors.js";
import { Files, MemoryFiles } from "./files.js";
import { Player } from "./player.js";
import { Recovery } from "./recovery.js";
import { KINDS } from "./shaders.js";
import { connectControls } from "./ui/controls.js";
import { Hotspots } from "./ui/hotspots.js";
import { Overlays, showOwnPoster } from "./ui/overlays.js";
import { PICTURE, STYLE, TEMPLATE } from "./ui/template.js";
import { isOrbit } from "./viewstate.js";
import { watchSight, whenNear } from "./watch.js";

const BACKGROUND = "#16181d";
const SHADOW = 0.55; // on a backdrop
const checkMode = (kind) => {
  if (!KINDS.includes(kind)) throw new TypeError(`a mode is one of ${KINDS.join(", ")}, not "${kind}"`);
};
const PLAIN = { spread: 0, wireframe: false, effects: true, mode: "colour" };
const FORWARDED = ["ready", "level", "frame", "play", "pause", "ended", "change", "camera-change", "error"];

export class FacefoldsPlayer extends PlayerApi {
  static observedAttributes = [
    ...["src", "background", "shadow-intensity", "loop", "speed", "level", "still", "alt", "muted"],
    ...["exposure", "reveal"],
    ...OF_THE_VIEW,
  ];

  #player = null;
  #given = null; // files that came without an address
  #state = {}; // what is to be applied when the first picture is there
  #waits = false; // for `dismissPoster`
  #dismissed = false;
  #resume = false; // it played when it was taken out of the document
  #settings = { background: BACKGROUND, ...PLAIN };
  #ends = []; // what is to be called when the player goes
  #recovery = new Recovery(
    () => this.#player?.onScreen ?? true,
    () => (this.ready ? this.#player.detail.resume() : this.#start()),
  );

  constructor() {
    super();
    this.attachShadow({ mode: "open", delegatesFocus: true }).adoptedStyleSheets = [STYLE];
  }

  connectedCallback() {
    if (!this.#player) this.#begin();
  }

  /** Moved by `moveBefore`: nothing changes. */
  connectedMoveCallback() {}

  /** Moving within the document takes it out and puts it in again: only what stays out is let go. */
  disconnectedCallback() {
    queueMicrotask(() => {
      if (this.isConnected || !this.#player) return;
      this.#state = this.state;
      this.#resume = this.playing;
      this.#stop();
    });
  }

  attributeChangedCallback(name, before, now) {
    if (!this.isConnected || before === now) return;
    if (name === "src") {
      [this.#given, this.#dismissed] = [null, false];
      this.#begin();
    }
    if (name === "background") this.#paint(isBackground(now) ? now : BACKGROUND);
    if (name === "shadow-intensity") this.#paint(this.background);
    if (name === "loop") this.loop = now !== "false";
    if (name === "still") this.still = now !== null;
    if (name === "speed" && Number(now) > 0) this.speed = Number(now);
    if (name === "alt") this.#describe();
    if (name === "muted") this.muted = now !== "false";
    if (name === "exposure") this.#player?.set("exposure", exposureOf(this));
    if (name === "reveal" && this.#waits && now !== "manual") this.#begin();
    if (OF_THE_VIEW.includes(name) && this.#player) applyToView(this, this.#player, name);
    if (name === "level" && this.ready) this.level = this.levels.includes(now) ? now : "auto";
  }

  #describe() {
    const canvas = this.shadowRoot.querySelector("canvas");
    const alt = this.getAttribute("alt");
    if (canvas) canvas.ariaLabel = alt ?? PICTURE;
    if (canvas) canvas.ariaDescription = alt === null ? null : PICTURE;
  }

  /** Loads, at once or (`loading="lazy"`) when it comes near to what is on the screen, or (`reveal="manual"`) when told. */
  #begin() {
    this.#stop();
    if (this.getAttribute("loading") !== "lazy") return this.#arrive();
    this.#waitBare();
    this.#ends.push(whenNear(this, () => this.#arrive()));
  }

  #arrive() {
    if (this.getAttribute("reveal") !== "manual" || this.#dismissed) return this.#start();
    this.#waitBare();
    this.#waits = true;
    const own = this.hasAttribute("poster") || this.querySelector('[slot="poster"]');
    if (!own && this.hasAttribute("src")) new Overlays(this).standIn(this.#files());
  }

  /** Nothing is loaded: there is a poster at most. */
  #waitBare() {
    this.shadowRoot.innerHTML = TEMPLATE;
    this.shadowRoot.querySelector(".stage").classList.add("waits");
    showOwnPoster(this);
    this.#describe();
    this.#paint(this.getAttribute("background") ?? BACKGROUND);
  }

  /** With `reveal="manual"`: loads the asset, and shows it in the poster's place. */
  dismissPoster() {
    this.#dismissed = true;
    if (this.#waits) this.#begin();
  }

  /** Loads the asset (again). */
  async #start() {
    this.#stop();
    this.shadowRoot.innerHTML = TEMPLATE;
    this.overlays = new Overlays(this);
    showOwnPoster(this);
    this.shadowRoot.querySelector('[data-do="again"]').addEventListener("click", () => this.#start());
    if (!this.#given && !this.hasAttribute("src"))
      return this.overlays.fail(
        new PlayerError("No asset was named", {
          kind: "missing",
          remedy: "Give the player the attribute src: the address of an asset's folder.",
        }),
      );
    try {
      this.#player = new Player(this.shadowRoot.querySelector("canvas"));
    } catch (error) {
      this.#failed(error);
      return this.overlays.standIn(this.#files());
    }
    const player = this.#player;
    this.#connect(player);
    try {
      await player.load(this.#files(), this.#state.level ?? this.getAttribute("level") ?? "auto");
      if (player !== this.#player) return;
      this.overlays.loaded();
      this.dispatchEvent(new CustomEvent("load"));
    } catch (error) {
      if (player === this.#player) this.#failed(error);
    }
  }

  #files() {
    if (this.#given) return new MemoryFiles(this.#given);
    return new Files(new URL(this.getAttribute("src").replace(/\/?(manifest\.json)?$/, "/"), document.baseURI).href);
  }

  #connect(player) {
    player.playback.loop = this.getAttribute("loop") !== "false";
    player.still = this.hasAttribute("still");
    player.mute(this.getAttribute("muted") !== "false");
    this.#describe();
    applyToView(this, player);
    player.set("exposure", exposureOf(this));
    player.playback.speed = Number(this.getAttribute("speed")) || 1;
    const asked = this.getAttribute("background");
    this.#paint(isBackground(asked) ? asked : BACKGROUND);
    const repaint = () => this.#paint(this.background);
    prefersDark.addEventListener("change", repaint);
    this.#ends.push(() => prefersDark.removeEventListener("change", repaint));
    this.#ends.push(watchSight(this, (seen) => player.setOnScreen(seen)));
    this.overlays.connect(player);
    this.#ends.push(connectControls(this));
    const hotspots = new Hotspots(this, player);
    this.#ends.push(() => hotspots.end());
    player.addEventListener("ready", () => this.#ready());
    player.addEventListener("error", ({ detail }) => this.#failed(detail));
    for (const name of FORWARDED) {
      player.addEventListener(name, ({ detail }) => this.dispatchEvent(new CustomEvent(name, { detail })));
    }
  }

  /** The first picture is there: what was asked for beforehand is set. */
  #ready() {
    const photo = parseInt(this.getAttribute("photo"), 10);
    const state = { ...(photo >= 0 && { photo }), ...this.#state };
    this.#state = {};
    this.#paint(this.background);
    for (const name of Object.keys(PLAIN)) this[name] = this.#settings[name];
    this.state = { ...state, level: undefined };
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const rests = state.frame !== undefined || state.photo !== undefined;
    const starts = this.hasAttribute("autoplay") && !still && !rests;
    if (starts && !state.view && this.getAttribute("sway") !== "none") this.#player.view.startSway();
    if (starts || this.#resume) this.play();
    this.#resume = false;
  }

  #failed(error) {
    this.overlays.fail(error, this.#player?.level ? "notice" : "all");
    if (!this.#player) this.dispatchEvent(new CustomEvent("error", { detail: error }));
    if (error.kind === "offline") this.#recovery.start(error.file);
  }

  #stop() {
    this.#waits = false;
    for (const end of this.#ends.splice(0)) end();
    this.#recovery.stop();
    this.#player?.close();
    this.#player = null;
  }

  /** Plays an asset that is at hand. @param {Map<string, Blob>} files name -> content, manifest.json among them */
  openFiles(files) {
    this.#given = new Map(files);
    this.#state = {};
    if (this.isConnected) this.#start();
  }

  /** Whether the asset has an address that others could open. */
  get shareable() {
    return this.#given === null;
  }

  get player() {
    return this.#player;
  }

  get background() {
    return this.#settings.background;
  }

  /** @param {string} colour any that CSS knows, `transparent` included, or a backdrop's name */
  set background(colour) {
    const names = Object.keys(BACKDROPS).join(", ");
    if (!isBackground(colour)) throw new TypeError(`a background is a colour of CSS or ${names}, not "${colour}"`);
    this.#paint(colour);
  }

  #paint(colour) {
    const stage = this.shadowRoot.querySelector(".stage");
    this.#settings.background = colour;
    if (!stage) return;
    const colours = BACKDROPS[colour];
    this.paint = painted(colours?.[0] ?? colour, stage);
    stage.style.backgroundImage = colours ? backdropImage(colour) : "";
    stage.classList.toggle("light", isLight(this.paint, this));
    this.#player?.set("background", this.paint);
    this.#player?.set("backdrop", colours?.map(numbersOf) ?? null);
    const asked = parseFloat(this.getAttribute("shadow-intensity"));
    this.#player?.set("shadow", Math.max(0, Math.min(1, asked >= 0 ? asked : colours ? SHADOW : 0)));
  }

  get spread() {
    return this.#settings.spread;
  }

  /** Pulls the layers apart; the view turns aside, so that all are seen. */
  set spread(amount) {
    this.#settings.spread = Math.max(0, Math.min(1, Number(amount) || 0));
    this.#player?.pullApart(this.#settings.spread);
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

  /** What is shown: "colour", "alpha", "depth" or "uv". */
  get mode() {
    return this.#settings.mode;
  }

  set mode(kind) {
    checkMode(kind);
    this.#set("mode", kind);
  }

  #set(name, value) {
    this.#settings[name] = value;
    this.#player?.set(name, value);
  }

  /** All settings and the view as they were at first; goes on playing or resting. */
  reset() {
    const asked = this.getAttribute("background");
    this.#paint(isBackground(asked) ? asked : BACKGROUND);
    Object.assign(this, PLAIN);
    this.layers = this.layers.map(() => true);
    this.loop = this.getAttribute("loop") !== "false";
    this.speed = Number(this.getAttribute("speed")) || 1;
    this.level = this.levels.includes(this.getAttribute("level")) ? this.getAttribute("level") : "auto";
    this.resetView();
  }

  /** To set, parts are enough, also of the view. @returns {import("./viewstate.js").ViewState} */
  get state() {
    const player = this.#player;
    if (!player?.level) return { ...this.#state };
    const { background, ...settings } = this.#settings;
    const hidden = this.layers.flatMap((on, i) => (on ? [] : [i]));
    return {
      ...(this.playing ? {} : { frame: this.frame }),
      ...(this.comparison.index === null ? { view: player.view.get() } : { photo: this.comparison.index }),
      ...(player.detail.auto ? {} : { level: this.level }),
      ...(background === BACKGROUND || background === "transparent" ? {} : { background }),
      ...{ hidden, ...settings, speed: this.speed, loop: this.loop },
    };
  }

  set state(state) {
    const { frame, view, level, hidden, photo, background } = state;
    if (view && !isOrbit(view))
      throw new TypeError("a view has azimuth and elevation in degrees, a distance above 0 and a target of 3 numbers");
    if (state.mode !== undefined) checkMode(state.mode); // before anything is changed
    if (!this.ready) {
      this.#state = { ...this.#state, ...state, ...(view && { view: { ...this.#state.view, ...view } }) };
      return;
    }
    if (isBackground(background)) this.#paint(background);
    for (const key of [...Object.keys(PLAIN), "speed", "loop"]) if (state[key] !== undefined) this[key] = state[key];
    if (hidden) this.#player.hide(hidden);
    if (view) this.#player.view.set(view);
    if (level && level !== this.level && this.levels.includes(level)) this.level = level;
    if (photo !== undefined) this.compare(photo);
    else if (frame !== undefined) {
      this.pause();
      this.seek(frame);
    }
  }
}

reflect(FacefoldsPlayer.prototype);
