/** What a page may ask of <facefolds-player> once it has a player: time, layers, levels, pictures, films, the room. */
import { PlayerError } from "./errors.js";
import { asFile, linkTo } from "./sharing.js";
import { clipOf, surfaceUnder } from "./surface.js";

export class PlayerApi extends HTMLElement {
  /** The engine behind the element, for programs that need more than the element offers; null before it is connected. */
  get player() {
    return null;
  }

  get ready() {
    return this.player?.level != null;
  }

  get frame() {
    return this.player?.shown ?? -1;
  }

  get frames() {
    return this.player?.playback.frames ?? 0;
  }

  get fps() {
    return this.player?.playback.fps ?? 0;
  }

  get playing() {
    return this.player?.playing ?? false;
  }

  get loop() {
    return this.player?.playback.loop ?? true;
  }

  set loop(on) {
    this.#playback("loop", Boolean(on));
  }

  /** Whether a head that moves is held still. */
  get still() {
    return this.player?.still ?? this.hasAttribute("still");
  }

  set still(on) {
    if (this.player) this.player.still = Boolean(on);
  }

  /** Whether the asset's sound is off; it is until somebody asks for it. */
  get muted() {
    return this.player?.muted ?? this.getAttribute("muted") !== "false";
  }

  set muted(on) {
    this.player?.mute(Boolean(on));
  }

  /** Seconds of the sequence, at its own speed. */
  get duration() {
    return this.fps && this.frames / this.fps;
  }

  /** Seconds from the beginning to the frame shown; to set: shows the frame that is due then. */
  get currentTime() {
    return this.fps && Math.max(0, this.frame) / this.fps;
  }

  set currentTime(seconds) {
    this.seek(Math.floor(seconds * this.fps + 1e-6));
  }

  get speed() {
    return this.player?.playback.speed ?? 1;
  }

  set speed(factor) {
    if (factor > 0) this.#playback("speed", factor);
  }

  #playback(name, value) {
    if (!this.player) return;
    this.player.playback[name] = value;
    this.player.dispatchEvent(new Event("change"));
  }

  /** Which layers are drawn, outermost first. */
  get layers() {
    return this.player?.visible.slice() ?? [];
  }

  set layers(visible) {
    this.player?.hide(visible.flatMap((on, i) => (on ? [] : [i])));
  }

  /** Name of the level that is shown; set to "auto", it follows what the machine can do. */
  get level() {
    return this.player?.level?.info.name ?? "";
  }

  set level(name) {
    const { player } = this;
    player?.detail.choose(name).catch((error) => player.fail(error));
  }

  /** Names of the levels that this machine can show, coarsest first. */
  get levels() {
    return this.player?.choices ?? [];
  }

  get statistics() {
    return this.player?.statistics;
  }

  play() {
    this.player?.play();
  }

  pause() {
    this.player?.pause();
  }

  /** @returns {Promise<boolean>} true when frame `k` has been drawn; false if another one was asked for meanwhile */
  async seek(k) {
    return (await this.player?.seek(k)) ?? false;
  }

  /** Pauses, and moves by whole frames. */
  async step(by = 1) {
    return (await this.player?.step(by)) ?? false;
  }

  resetView() {
    this.comparison?.close();
    this.player?.view.reset();
  }

  /** @param {{K: number[][], w2c: number[][], width: number, height: number} | null} camera docs/reference/conventions.md; null: back to the orbit */
  setCamera(camera) {
    this.player?.view.setExact(camera);
  }

  /** @param {object} [camera] as for `setCamera` @returns {ImageData} the frame shown, as drawn */
  capture(camera) {
    if (!this.player) throw new PlayerError("Nothing has been loaded yet", { kind: "missing" });
    return this.player.capture(camera);
  }

  /** @param {object} [camera] as for `setCamera` @returns {Promise<Blob>} the same as a PNG */
  async screenshot(camera) {
    return asFile(this.capture(camera));
  }

  /**
   * What lies at a place of the window, for `data-surface` of a hotspot. @param {number} x @param {number} y CSS pixels, as
   * `clientX` and `clientY` of an event @returns {string | null} u, v and depth; null: nothing is there
   */
  surfaceFromPoint(x, y) {
    if (!this.ready) return null;
    const found = surfaceUnder(this.player, clipOf(this.player.canvas, x, y));
    if (!found) return null;
    const deep = found.layer / Math.max(1, this.layers.length - 1);
    return [...found.place, deep].map((number) => number.toFixed(4)).join(" ");
  }

  /** What is seen, as a file. @param {{mimeType?: string, qualityArgument?: number}} [options] by default a PNG */
  async toBlob({ mimeType: type, qualityArgument: quality } = {}) {
    return asFile(this.capture(), { type, quality });
  }

  /**
   * Makes a film of one turn from side to side. @param {import("./recording.js").Wanted} [options]
   * @returns {Promise<Blob>} MP4 or WebM
   */
  async record(options) {
    if (!this.ready) throw new PlayerError("Nothing has been loaded yet", { kind: "missing" });
    const { recordTurn } = await import("./recording.js");
    return recordTurn(this.player, options);
  }

  /** Shows held-out photo `index` beside the asset, from the photo's camera and frame; null: closes. */
  compare(index) {
    return index === null ? this.comparison?.close() : this.comparison?.open(index);
  }

  /** Whether the device can show the head in the room around (WebXR); known some time after `ready`. */
  get canActivateAR() {
    return this.ready && !this.shadowRoot.querySelector('[data-do="ar"]').hidden;
  }

  /** Shows the head in the room, or ends that; after a click only, as browsers ask. */
  async activateAR() {
    await this.actions?.ar();
  }

  /** @returns {string} address of the full-page player with this asset and this view */
  get link() {
    return linkTo(this);
  }
}
