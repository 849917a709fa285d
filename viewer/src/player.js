/**
 * Plays an asset on a canvas: loads it (coarse level first), keeps time, draws. Knows nothing of buttons.
 *
 * Events: "progress", "ready" (first picture), "level", "frame", "play", "pause", "ended", "change" (any setting),
 * "camera-change", "error".
 */
import { Adaptation } from "./adapt.js";
import { Apart } from "./apart.js";
import { watchContext } from "./context.js";
import { startDecoder } from "./draco/decoder.js";
import { PlayerError } from "./errors.js";
import { LevelChoice } from "./levelchoice.js";
import { parseManifest } from "./manifest.js";
import { Playback } from "./playback.js";
import { LayerRenderer } from "./renderer.js";
import { Sound } from "./sound.js";
import { statisticsOf } from "./statistics.js";
import { matrixOf, readPoses } from "./track.js";
import { View } from "./view.js";

const LONGEST_STEP = 0.25; // s: after a pause of the page (hidden tab), time does not jump
const SMOOTH = 1 / 30; // s that a picture may take while anything moves
const RATE_OVER = 1000; // ms that the frames a second are counted over
const SETTERS = {
  wireframe: "setWireframe",
  effects: "setEffects",
  background: "setBackground",
  backdrop: "setBackdrop",
  shadow: "setShadow",
  exposure: "setExposure",
  mode: "setKind",
};

export class Player extends EventTarget {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    super();
    this.canvas = canvas;
    this.renderer = new LayerRenderer(canvas);
    this.view = new View(canvas, () => this.invalidate());
    this.playback = new Playback({ frames: 1, fps: 1 });
    this.detail = new LevelChoice(this);
    this.manifest = null;
    this.held = false; // a head that moves is held still
    this.files = null;
    this.level = null;
    this.sound = null;
    this.muted = true; // until somebody asks for sound: browsers refuse it before a click
    this.shown = -1; // the frame in the texture
    this.stale = false; // the canvas needs drawing
    this.lost = false; // the graphics context
    this.onScreen = true;
    this.immersed = false; // a headset draws
    this.hidden = new Set(); // indices of layers that are not drawn; kept from level to level
    this.visible = [];
    this.drawn = []; // times of the last pictures
    this.apart = new Apart(this);
    this.size = [0, 0];
    this.haste = new Adaptation();
    this.late = false; // pictures came late: what moves is drawn with one ray a pixel
    this.drew = false; // in the last animation frame
    this.busy = 0; // s that the last picture took of the page's thread
    this.request = 0; // of an animation frame; 0: none, nothing moves
    this.listening = watchContext(this);
  }

  /**
   * @param {import("./files.js").Files | import("./files.js").MemoryFiles} files of the asset
   * @param {string} [want] name of a level, or "auto": as fine as the canvas shows and this machine can take
   */
  async load(files, want = "auto") {
    this.files = files;
    files.onProgress = () => this.say("progress");
    files.onTrouble = (error) => this.fail(error);
    import("./video/open.js").catch(() => {}); // wanted soon; said where a level waits for it
    startDecoder(files.onProgress).catch(() => {}); // said where a mesh waits for it
    const text = await files.text("manifest.json");
    this.manifest = parseManifest(text, files.address("manifest.json"));
    this.say("progress");
    const { trackFile } = this.manifest;
    if (trackFile) this.manifest.track = readPoses(await files.bytes(trackFile), files.address(trackFile.name));
    this.view.setFilmed(this.manifest.view);
    if (this.manifest.bounds) this.#settle(this.manifest.bounds);
    const { frames, fps } = this.manifest.levels.at(-1).texture;
    Object.assign(this.playback, { frames, fps });
    await this.detail.load(want, () => this.manifest.audio && this.#loadSound(this.manifest.audio));
  }

  /** Of a long take the browser fetches the sound by itself, as it plays. */
  async #loadSound(entry) {
    try {
      const address = this.manifest.levels[0].videos[0].segments && this.files.addressFor?.(entry);
      this.sound = address ? new Sound(address) : Sound.of(await this.files.bytes(entry), entry.mime);
      this.mute(this.muted);
    } catch (error) {
      this.fail(error);
    }
  }

  mute(on) {
    this.muted = on;
    if (this.sound) this.sound.muted = on;
    this.say("change");
  }

  /** Where the first view is from. @param {object} first @param {number} field see `View.setFirst` */
  setFirst(first, field) {
    this.view.setFirst(first, field);
    if (this.home) this.view.setHome(this.home);
  }

  /** The first view fits what there is. */
  #settle(box) {
    this.home = box;
    this.view.setHome(box);
  }

  /** Names of the levels that this machine can show, coarsest first. */
  get choices() {
    return this.detail.choices;
  }

  /** Shows a level that has been loaded, with the frame that is due. @param {import("./levels.js").LoadedLevel} level */
  swap(level, frame, picture) {
    const old = this.level;
    this.level = level;
    this.renderer.setLevel(level);
    this.#showLayers();
    this.#show(frame, picture);
    if (!old && !this.home) this.#settle(this.renderer.bounds());
    if (this.view.framed) this.pullApart(this.renderer.spread);
    this.draw();
    old?.dispose();
    if (!old) this.say("ready");
    this.say("level");
    this.wake();
  }

  get playing() {
    return this.playback.playing;
  }

  play() {
    if (this.playback.playing || this.playback.frames < 2) return;
    if (!this.playback.loop && this.playback.frame === this.playback.frames - 1) this.seek(0);
    this.playback.playing = true;
    this.detail.restart();
    this.say("play");
    this.wake();
  }

  pause() {
    if (!this.playback.playing) return;
    this.playback.playing = false;
    this.#still();
    if (this.shown >= 0 && this.level) this.seek(this.shown);
    this.say("pause");
  }

  /** Shows frame `k`, exactly. @returns {Promise<boolean>} true when drawn, false if another wish came before */
  async seek(k) {
    this.playback.seek(k);
    this.sound?.seek(this.playback.frame / this.playback.fps);
    if (!this.level) return false;
    const { source } = this.level;
    const frame = this.playback.frame;
    try {
      const picture = await source.get(frame);
      if (source !== this.level?.source || (frame !== this.playback.frame && !this.playing)) return false;
      this.#show(frame, picture);
      this.draw();
      return true;
    } catch (error) {
      if (error.name !== "AbortError") this.fail(error);
      return false;
    }
  }

  step(by) {
    this.pause();
    this.playback.step(by);
    return this.seek(this.playback.frame);
  }

  /** @param {number[]} indices of the layers not to draw, outermost first */
  hide(indices) {
    this.hidden = new Set(indices);
    this.#showLayers();
    this.changed();
  }

  #showLayers() {
    this.visible = this.level.info.layers.map((_, i) => !this.hidden.has(i));
    this.renderer.setVisible(this.visible);
  }

  /** @param {keyof typeof SETTERS} name */
  set(name, value) {
    this.renderer[SETTERS[name]](value);
    this.changed();
  }

  /** Pulls the layers apart, 0 to 1. */
  pullApart(amount) {
    if (this.level) this.apart.pull(amount);
  }

  /** @param {number} inset CSS pixels at the lower edge that controls cover */
  resize(width, height, ratio, inset = 0) {
    const [w, h] = [width, height].map((side) => Math.max(1, Math.round(side * ratio)));
    const below = Math.round(inset * ratio);
    if (w === this.size[0] && h === this.size[1] && below === this.view.inset) return;
    if (w !== this.size[0] || h !== this.size[1]) this.renderer.resize(w, h);
    this.size = [w, h];
    this.view.resize(w, h, below);
    if (this.home) this.view.setHome(this.home);
    if (this.level) this.draw(); // at once: setting the size has emptied the canvas
    this.say("resized");
  }

  /** Off the screen nothing is drawn, decoded or fetched. */
  setOnScreen(on) {
    if (on === this.onScreen) return;
    this.onScreen = on;
    if (!on) this.#still();
    this.detail.restart();
    this.say(on ? "shown" : "hidden");
    this.wake();
  }

  /** What would go on by itself rests. */
  #still() {
    this.sound?.follow(false, this.playback);
    if (this.level?.source.playsItself) this.level.source.run(false, this.playback.speed, this.playback.loop);
    if (this.onScreen) return;
    cancelAnimationFrame(this.request);
    this.request = 0;
  }

  /**
   * A picture of the frame shown, drawn by the same passes as the canvas.
   * @param {{K: number[][], w2c: number[][], width: number, height: number}} [camera] by default the view's own
   * @returns {ImageData}
   */
  capture(camera) {
    if (!this.level) throw new PlayerError("Nothing has been loaded yet", { kind: "missing" });
    const [width, height] = camera ? [camera.width, camera.height] : this.size;
    const { projection, view } = this.view.matrices(width, height, this.renderer.bounds(), camera);
    this.renderer.setHems(camera ? null : this.view.hems);
    return this.renderer.capture(projection, view, width, height);
  }

  get statistics() {
    return statisticsOf(this);
  }

  close() {
    this.closed = true;
    cancelAnimationFrame(this.request);
    this.listening.abort();
    this.files?.close();
    this.sound?.close();
    this.level?.dispose();
    this.view.dispose();
    this.renderer.dispose();
    this.say("closed");
  }

  /** The canvas needs drawing. */
  invalidate() {
    this.stale = true;
    this.wake();
  }

  /** Asks for an animation frame, if anything moves and anybody sees it. */
  wake() {
    if (this.request || this.closed || this.lost || !this.level || !this.onScreen || this.immersed) return;
    if (!this.playing && !this.stale && !(this.view.rotates && this.view.swaying)) return;
    this.request = requestAnimationFrame((now) => this.#tick(now));
  }

  #tick(now) {
    this.request = 0;
    if (this.lost) return;
    const began = performance.now();
    const seconds = this.before ? Math.min(LONGEST_STEP, (now - this.before) / 1000) : 1 / 60;
    this.moveOn(seconds);
    if (this.before && this.drew) this.#judge(seconds);
    const moving = this.view.update(seconds);
    this.drew = this.stale || moving || this.view.swaying > 0;
    if (this.drew) this.draw(this.playing || moving || this.view.swaying > 0);
    while (this.drawn.length && now - this.drawn[0] > RATE_OVER) this.drawn.shift();
    this.stale ||= moving;
    this.busy = (performance.now() - began) / 1000;
    this.wake();
    this.before = this.request ? now : 0;
  }

  /** @param {number} seconds that a picture took to come, until the next one could be drawn */
  #judge(seconds) {
    const move = this.haste.note(seconds, seconds > 1.3 * SMOOTH ? seconds : this.busy, SMOOTH);
    if (move) this.late = move < 0;
  }

  /** Fewer rays a pixel while anything moves. @returns {boolean} false: there are none to spare */
  hurry() {
    if (this.late) return false;
    this.late = true;
    this.haste.leave();
    return true;
  }

  /** Lets time pass: shows the frame that is due. */
  moveOn(seconds) {
    if (this.level.source.playsItself) this.#follow();
    else if (this.playing) this.#advance(Math.min(LONGEST_STEP, seconds));
    this.sound?.follow(this.playing, this.playback);
  }

  /** While a headset asks for the pictures, the page's own rest. */
  setImmersed(on) {
    this.immersed = on;
    this.renderer.setHems(null);
    cancelAnimationFrame(this.request);
    this.request = 0;
    if (!on) this.invalidate();
    this.say("change");
  }

  #advance(seconds) {
    const { playback, shown } = this;
    const { source } = this.level;
    const there = shown === playback.frame || source.peek(playback.frame) !== null;
    const ended = playback.advance(seconds, there);
    source.want(playback.frame, seconds * playback.fps * playback.speed);
    this.#showIfThere(playback.frame);
    this.detail.measure(seconds, there);
    if (!ended) return;
    if (this.shown !== playback.frame) this.seek(playback.frame); // decoded only after playing has stopped
    this.#end();
  }

  /** A video element keeps its own time; the clock goes by it. */
  #follow() {
    const { playback } = this;
    const { source } = this.level;
    const ended = source.run(this.playing, playback.speed, playback.loop);
    if (!this.playing) return;
    if (source.shown >= 0) playback.seek(source.shown);
    this.#showIfThere(source.shown);
    if (ended && !playback.loop) {
      playback.playing = false;
      this.seek(source.frames - 1); // a busy machine may not have shown the last one
      this.#end();
    }
  }

  #end() {
    this.say("pause");
    this.say("ended");
  }

  #showIfThere(frame) {
    const picture = frame === this.shown ? null : this.level.source.peek(frame);
    if (picture) this.#show(frame, picture);
  }

  /** Colour and alpha are parts of one picture: they cannot come from two frames. */
  #show(frame, picture) {
    this.renderer.setFrame(picture);
    this.shown = frame;
    this.#place();
    this.stale = true;
    this.say("frame");
  }

  /** @param {boolean} [moves] another picture follows soon */
  draw(moves = this.playing) {
    if (this.lost || !this.size[0]) return;
    const { projection, view } = this.view.matrices(...this.size, this.renderer.bounds());
    this.renderer.setHems(this.view.hems);
    this.renderer.draw(projection, view, this.view.strength, this.late && moves);
    this.stale = false;
    this.drawn.push(performance.now());
    this.say("draw");
    if (view.every((v, i) => v === this.seen?.[i])) return;
    this.seen = view;
    this.say("camera-change");
  }

  /** The head where it stood in the frame shown, or at rest. */
  #place() {
    const { track, torso } = this.manifest;
    this.renderer.setTorso(torso);
    this.renderer.setPose(track && this.shown >= 0 ? matrixOf(track[this.shown]) : null, this.held);
    this.stale = true;
  }

  /** Whether a head that moves is held still. */
  get still() {
    return this.held;
  }

  set still(on) {
    this.held = on;
    if (!this.manifest) return;
    this.#place();
    this.wake();
  }

  /** A setting is another. */
  changed() {
    this.invalidate();
    this.say("change");
  }

  fail(error) {
    if (this.closed) return;
    this.dispatchEvent(new CustomEvent("error", { detail: error }));
  }

  say(name) {
    this.dispatchEvent(new Event(name));
  }
}
