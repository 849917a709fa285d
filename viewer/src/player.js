/**
 * Plays an asset on a canvas: loads it (coarse level first), keeps time, draws. Knows nothing of buttons.
 *
 * Events: "progress", "ready" (first picture), "level", "frame", "play", "pause", "change" (any setting), "error".
 */
import { PlayerError } from "./errors.js";
import { Files } from "./files.js";
import { gpuBytes, loadLevel } from "./levels.js";
import { parseManifest } from "./manifest.js";
import { preloadDecoder } from "./meshes.js";
import { Playback } from "./playback.js";
import { LayerRenderer } from "./renderer.js";
import { Sound } from "./sound.js";
import { View } from "./view.js";

const LONGEST_STEP = 0.25; // s: after a pause of the page (hidden tab), time does not jump
const RATE_OVER = 1000; // ms that the frames a second are counted over

export class Player extends EventTarget {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    super();
    this.canvas = canvas;
    this.renderer = new LayerRenderer(canvas);
    this.view = new View(canvas, () => (this.stale = true));
    this.playback = new Playback({ frames: 1, fps: 1 });
    this.manifest = null;
    this.files = null;
    this.level = null;
    this.sound = null;
    this.shown = -1; // the frame in the texture
    this.stale = false; // the canvas needs drawing
    this.lost = false; // the graphics context
    this.hidden = new Set(); // indices of layers that are not drawn; kept from level to level
    this.visible = [];
    this.drawn = []; // times of the last pictures
    this.refused = new Set(); // videos that broke down
    this.size = [0, 0];
    this.#watchContext();
    this.request = requestAnimationFrame((now) => this.#tick(now));
  }

  /**
   * @param {string} folder address of the asset's folder
   * @param {string} [want] name of a level, or "auto": the finest that this machine can take
   */
  async load(folder, want = "auto") {
    this.files = new Files(folder, () => this.#say("progress"));
    preloadDecoder();
    const text = await this.files.text("manifest.json");
    this.manifest = parseManifest(text, this.files.address("manifest.json"));
    this.#say("progress");
    const { levels, audio } = this.manifest;
    const fitting = levels.filter(
      ({ texture }) => Math.max(texture.width, texture.height) <= this.renderer.maxTextureSize,
    );
    if (!fitting.length) {
      throw new PlayerError(
        `The textures are larger than this machine's ${this.renderer.maxTextureSize} pixels a side`,
        {
          kind: "unsupported",
          remedy: "Export the asset with a coarser level of detail.",
        },
      );
    }
    this.choices = fitting.map(({ name }) => name);
    const { frames, fps } = fitting.at(-1).texture;
    Object.assign(this.playback, { frames, fps });
    const goal = this.choices.includes(want) ? want : this.choices.at(-1);
    await this.setLevel(this.choices.length > 1 && want !== goal ? this.choices[0] : goal);
    if (audio) this.#loadSound(audio);
    if (this.level.info.name !== goal) await this.setLevel(goal);
  }

  async #loadSound(entry) {
    try {
      this.sound = new Sound(await this.files.bytes(entry));
      this.#say("change");
    } catch (error) {
      this.#fail(error);
    }
  }

  /** Loads level `name` and swaps it in with the frame that is due. Resolves when it is drawn. */
  async setLevel(name) {
    const info = this.manifest.levels.find((level) => level.name === name);
    if (!info) throw new RangeError(`no level ${name}`);
    this.wantedLevel = name;
    let level = null;
    level = await loadLevel(info, this.files, (error) => this.#videoFailed(level, error), this.refused);
    if (this.closed || this.wantedLevel !== name) return level.dispose();
    let picture;
    let frame;
    do {
      frame = this.playback.frame;
      picture = await level.source.get(frame);
    } while (frame !== this.playback.frame && !this.playback.playing);
    const old = this.level;
    this.level = level;
    this.renderer.setLevel(level);
    this.#showLayers();
    this.#show(frame, picture);
    if (!old) {
      this.view.setHome(this.renderer.bounds());
      this.view.reset();
    }
    this.#draw();
    old?.dispose();
    if (!old) this.#say("ready");
    this.#say("level");
  }

  /** A decoder broke down: the level's next video takes over, or the failure is said. */
  async #videoFailed(level, error) {
    if (this.closed || !level || level !== this.level) return;
    this.refused.add(level.video.name);
    try {
      await this.setLevel(level.info.name);
    } catch (failure) {
      this.#fail(failure.kind === "codec" ? failure : error);
    }
  }

  get playing() {
    return this.playback.playing;
  }

  play() {
    if (this.playback.playing || this.playback.frames < 2) return;
    if (!this.playback.loop && this.playback.frame === this.playback.frames - 1) this.seek(0);
    this.playback.playing = true;
    this.#say("play");
  }

  pause() {
    if (!this.playback.playing) return;
    this.playback.playing = false;
    if (this.shown >= 0 && this.level) this.seek(this.shown);
    this.#say("pause");
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
      this.#draw();
      return true;
    } catch (error) {
      if (error.name !== "AbortError") this.#fail(error);
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
    this.#changed();
  }

  #showLayers() {
    this.visible = this.level.info.layers.map((_, i) => !this.hidden.has(i));
    this.renderer.setVisible(this.visible);
  }

  /** @param {"spread" | "wireframe" | "effects" | "background"} name */
  set(name, value) {
    const setters = {
      spread: "setSpread",
      wireframe: "setWireframe",
      effects: "setEffects",
      background: "setBackground",
    };
    this.renderer[setters[name]](value);
    this.#changed();
  }

  resize(width, height, ratio) {
    const w = Math.max(1, Math.round(width * ratio));
    const h = Math.max(1, Math.round(height * ratio));
    if (w === this.size[0] && h === this.size[1]) return;
    this.size = [w, h];
    this.renderer.three.setSize(w, h, false);
    this.view.resize(w, h);
    if (this.level) this.#draw(); // at once: setting the size has emptied the canvas
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
    this.stale = true;
    return this.renderer.capture(projection, view, width, height);
  }

  get statistics() {
    const info = this.level?.info;
    const [width, height] = this.size;
    return {
      fps: this.drawn.length > 1 ? ((this.drawn.length - 1) * 1000) / (this.drawn.at(-1) - this.drawn[0]) : 0,
      layers: info?.layers.length ?? 0,
      triangles: info?.layers.reduce((sum, layer, i) => sum + (this.visible[i] ? layer.triangles : 0), 0) ?? 0,
      bytesLoaded: this.files?.loaded ?? 0,
      gpuBytes: this.level ? gpuBytes(this.level) + 12 * width * height : 0, // canvas: two of colour, one of depth
      level: info?.name ?? "",
      texture: info ? [info.texture.width, info.texture.height] : [0, 0],
      canvas: [width, height],
      video: this.level?.video.codec ?? "",
      decoder: this.level?.source.kind ?? "",
    };
  }

  close() {
    this.closed = true;
    cancelAnimationFrame(this.request);
    this.files?.close();
    this.sound?.close();
    this.level?.dispose();
    this.view.dispose();
    this.renderer.dispose();
  }

  #tick(now) {
    this.request = requestAnimationFrame((next) => this.#tick(next));
    const seconds = Math.min(LONGEST_STEP, (now - (this.before ?? now)) / 1000);
    this.before = now;
    if (!this.level || this.lost) return;
    if (this.level.source.playsItself) this.#follow();
    else if (this.playing) this.#advance(seconds);
    this.sound?.follow(this.playing, this.playback);
    this.view.update();
    if (this.stale) this.#draw();
    while (this.drawn.length && now - this.drawn[0] > RATE_OVER) this.drawn.shift();
  }

  #advance(seconds) {
    const { playback, shown } = this;
    const { source } = this.level;
    const there = shown === playback.frame || source.peek(playback.frame) !== null;
    const ended = playback.advance(seconds, there);
    source.want(playback.frame, seconds * playback.fps * playback.speed);
    this.#showIfThere(playback.frame);
    if (ended) this.#say("pause");
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
      this.#say("pause");
    }
  }

  #showIfThere(frame) {
    const picture = frame === this.shown ? null : this.level.source.peek(frame);
    if (picture) this.#show(frame, picture);
  }

  /** Colour and alpha are parts of one picture: they cannot come from two frames. */
  #show(frame, picture) {
    this.level.texture.setFrame(picture);
    this.renderer.three.initTexture(this.level.texture);
    this.shown = frame;
    this.stale = true;
    this.#say("frame");
  }

  #draw() {
    if (this.lost || !this.size[0]) return;
    const { projection, view } = this.view.matrices(...this.size, this.renderer.bounds());
    this.renderer.draw(projection, view);
    this.stale = false;
    this.drawn.push(performance.now());
    this.#say("draw");
  }

  #watchContext() {
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.lost = true;
      this.#fail(
        new PlayerError("The graphics context was lost", {
          kind: "lost",
          remedy: "The player goes on by itself when the machine gives it back. If it does not, load the page again.",
        }),
      );
    });
    this.canvas.addEventListener("webglcontextrestored", async () => {
      this.lost = false;
      this.renderer.restore();
      if (this.level && !(await this.seek(this.playback.frame))) return;
      this.#say("restored");
    });
  }

  #changed() {
    this.stale = true;
    this.#say("change");
  }

  #fail(error) {
    if (this.closed) return;
    this.dispatchEvent(new CustomEvent("error", { detail: error }));
  }

  #say(name) {
    this.dispatchEvent(new Event(name));
  }
}
