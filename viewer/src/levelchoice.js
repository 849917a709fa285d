/** Which level of detail is shown: as fine as the canvas shows; another where one fails or is too much. */
import { Adaptation } from "./adapt.js";
import { PlayerError } from "./errors.js";
import { fineness, loadLevel, texelsAUnit } from "./levels.js";

const CATCH_UP = 6; // times that a level that comes in while it plays asks for the frame that is due by then
const SPARE = 0.7; // of the connection's bytes a second that a stream may take
const HOPELESS = ["offline", "cors", "csp", "file"]; // another level would fail for the same reason

export class LevelChoice {
  /** @param {import("./player.js").Player} player */
  constructor(player) {
    this.player = player;
    this.auto = true;
    this.choices = []; // names, coarsest first
    this.wanted = null; // name of the level that is being loaded or shown
    this.refused = new Set(); // videos that broke down
    this.broken = new Set(); // levels that cannot be loaded
    this.adaptation = new Adaptation();
    this.goal = ""; // the level that was last asked for because a canvas shows its detail
    player.addEventListener("draw", () => this.#look());
  }

  /** Names of the levels up to the coarsest that has a texel for every pixel of the canvas, coarsest first. */
  #useful() {
    const { manifest, view } = this.player;
    const levels = manifest.levels.filter(({ name }) => this.choices.includes(name));
    const enough = levels.findIndex((info) => this.density * fineness(info) >= view.pixelsAUnit);
    return this.choices.slice(0, enough < 0 ? this.choices.length : enough + 1);
  }

  /** The canvas has grown, or the view gone nearer: is a finer level of use? */
  #look() {
    if (!this.auto || !this.goal) return;
    if (this.choices.indexOf(this.#useful().at(-1)) > this.choices.indexOf(this.goal)) this.#improve();
  }

  /** First picture from the coarsest level (or the one named), then the goal. @param {() => void} onFirst */
  async load(want, onFirst) {
    const { manifest, renderer } = this.player;
    const most = renderer.maxTextureSize;
    const fitting = manifest.levels.filter(({ texture }) => Math.max(texture.width, texture.height) <= most);
    if (!fitting.length) {
      throw new PlayerError(`The textures are larger than this machine's ${most} pixels a side`, {
        kind: "unsupported",
        remedy: "Export the asset with a coarser level of detail.",
      });
    }
    this.choices = fitting.map(({ name }) => name);
    this.auto = !this.choices.includes(want);
    const first = this.auto ? this.choices : this.#nearest(want);
    await this.#firstOf(first);
    const { level, view } = this.player;
    if (!level) return; // closed meanwhile
    this.density = texelsAUnit(level) / fineness(level.info);
    view.detail = this.density * Math.max(...fitting.map(fineness));
    onFirst();
    if (!this.auto || this.player.closed) return;
    await this.#improve();
  }

  /** Level names, the nearest to `name` first, the coarser before the finer. */
  #nearest(name) {
    const at = this.choices.indexOf(name);
    return [...this.choices.slice(0, at + 1).reverse(), ...this.choices.slice(at + 1)];
  }

  /** Shows the first level that can be loaded. What failed before is said when another one is there. */
  async #firstOf(names) {
    const failures = [];
    for (const name of names) {
      if (this.player.closed) return;
      try {
        await this.#show(name);
        if (failures.length) this.player.fail(failures[0]);
        return;
      } catch (error) {
        if (HOPELESS.includes(error.kind) || !(error instanceof PlayerError)) throw error;
        this.broken.add(name);
        failures.push(error);
      }
    }
    throw failures[0];
  }

  /** With `auto`: the finest level that can be loaded and whose detail shows. */
  async #improve() {
    const useful = this.#useful();
    this.goal = useful.at(-1);
    const names = useful.slice(this.choices.indexOf(this.player.level.info.name) + 1).reverse();
    await this.#enoughSeen();
    for (const name of names) {
      if (this.broken.has(name) || !this.#affordable(name)) continue;
      await this.#onScreen();
      if (this.player.closed || !this.auto) return;
      try {
        return await this.#show(name);
      } catch (error) {
        if (this.player.closed || error.name === "AbortError") return;
        // That nothing is left to try is no news: what broke down has been said.
        if (error.kind !== "codec" || !this.refused.size) this.player.fail(error);
        if (HOPELESS.includes(error.kind) || !(error instanceof PlayerError)) return;
        this.broken.add(name);
      }
    }
  }

  /** Whether the connection is fast enough for a level of a long take. Short ones come whole before they play. */
  #affordable(name) {
    const { files, manifest } = this.player;
    const { videos, texture } = manifest.levels.find((level) => level.name === name);
    if (!videos[0].segments || files.pace.rate === null) return true;
    return (videos[0].bytes * texture.fps) / texture.frames <= SPARE * files.pace.rate;
  }

  /** Of a long take some seconds are fetched before the connection is judged: what it can do, and so that nothing waits. */
  async #enoughSeen() {
    const { player } = this;
    const packets = player.level.source.packets;
    if (!player.level.video.segments || !packets) return;
    while (packets.busy && !player.closed) await new Promise((resolve) => setTimeout(resolve, 100));
  }

  /** Resolves when somebody sees the player, or it has gone. */
  async #onScreen() {
    const { player } = this;
    while (!player.onScreen && !player.closed)
      await new Promise((resolve) => {
        player.addEventListener("shown", resolve, { once: true });
        player.addEventListener("closed", resolve, { once: true });
      });
  }

  /** @param {string} name of a level, or "auto"; rejected if it cannot be shown: what was shown stays */
  async choose(name) {
    if (name === "auto") {
      this.auto = true;
      this.broken.clear();
      this.player.say("change");
      return this.#improve();
    }
    if (!this.player.manifest.levels.some((level) => level.name === name)) throw new RangeError(`no level ${name}`);
    this.auto = false;
    if (name !== this.player.level?.info.name || this.wanted !== name) await this.#show(name);
    else this.player.say("change");
  }

  /** After the connection came back: what could not be fetched. */
  async resume() {
    if (this.auto && this.player.level) await this.#improve();
  }

  /** Loads level `name` and swaps it in with the frame that is due. Resolves when it is drawn. */
  async #show(name) {
    const { player } = this;
    const info = player.manifest.levels.find((level) => level.name === name);
    this.wanted = name;
    let level = null;
    try {
      const failed = (error) => this.#videoFailed(level, error);
      level = await loadLevel(info, player.files, failed, this.refused, player.playback.frame, player.level);
    } catch (error) {
      if (this.wanted === name) this.wanted = player.level?.info.name ?? null;
      throw error;
    }
    if (player.closed || this.wanted !== name) return level.dispose();
    const { playback } = player;
    let picture;
    let frame;
    for (let tries = 0; tries < CATCH_UP || !playback.playing; ++tries) {
      frame = playback.frame;
      picture = await level.source.get(frame);
      if (frame === playback.frame) break; // else the clock has gone on meanwhile
    }
    if (player.closed || this.wanted !== name) return level.dispose();
    this.adaptation.restart();
    player.swap(level, frame, picture);
  }

  /** A decoder broke down: the level's next video takes over, then another level, or the failure is said. */
  async #videoFailed(level, error) {
    const { player } = this;
    if (player.closed || !level || level !== player.level) return;
    this.refused.add(level.video.name);
    try {
      await this.#firstOf(this.#nearest(level.info.name).filter((name) => !this.broken.has(name)));
    } catch (failure) {
      // That a file is damaged says more than that nothing is left to try.
      player.fail(failure?.kind === "codec" && !(error instanceof PlayerError) ? failure : error);
    }
  }

  /** Playing began or stopped: what was measured before says nothing. */
  restart() {
    this.adaptation.restart();
  }

  /** A picture while playing. @param {number} seconds since the last @param {boolean} there whether its frame was decoded */
  measure(seconds, there) {
    const { player } = this;
    if (!this.auto || this.wanted !== player.level.info.name) return;
    const budget = 1 / Math.min(60, Math.max(1, player.playback.fps * player.playback.speed));
    // Where nothing is late the display's own pace says nothing about how easy it was: what was busy does.
    const late = there ? seconds : seconds + budget;
    const move = this.adaptation.note(seconds, late > 1.3 * budget ? late : player.busy, budget);
    if (move < 0 && player.hurry()) return;
    const at = this.choices.indexOf(player.level.info.name);
    const next = (move < 0 ? this.choices : this.#useful()).filter(
      (name, i) => !this.broken.has(name) && (move < 0 ? i < at : i > at && this.#affordable(name)),
    );
    const name = move < 0 ? next.at(-1) : move > 0 ? next[0] : undefined;
    if (name) this.#show(name).catch((error) => player.fail(error));
  }
}
