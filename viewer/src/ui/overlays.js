/** What lies over the picture and is not a control: poster, progress, statistics, messages. */
import { weight } from "../draco/decoder.js";
import { PlayerError } from "../errors.js";
import { parseManifest } from "../manifest.js";

const mebibytes = (bytes) => `${(bytes / 2 ** 20).toFixed(bytes < 2 ** 20 * 10 ? 2 : 1)} MiB`;

/** The page's own poster, at once. @param {import("../element.js").FacefoldsPlayer} element */
export function showOwnPoster(element) {
  const poster = element.shadowRoot.querySelector(".poster");
  const address = element.getAttribute("poster");
  if (address) [poster.src, poster.hidden] = [address, false];
}

export class Overlays {
  /** @param {import("../element.js").FacefoldsPlayer} element */
  constructor(element) {
    this.element = element;
    this.find = (selector) => element.shadowRoot.querySelector(selector);
    this.statistics = false;
  }

  /** @param {import("../player.js").Player} player */
  connect(player) {
    this.player = player;
    this.find(".spinner").hidden = false;
    player.addEventListener("progress", () => this.#progress());
    player.addEventListener("ready", () => {
      this.find(".title").textContent = player.manifest.subject;
      this.find(".poster").classList.add("gone");
      this.find('[name="poster"]').classList.add("gone");
      this.#endProgress();
    });
    player.addEventListener("level", () => this.#pill());
    player.addEventListener("resized", () => this.#placePoster());
    player.addEventListener("restored", () => this.#hideMessage());
    player.addEventListener("draw", () => this.#count());
  }

  /** All that was to be loaded is there. */
  loaded() {
    this.find(".pill").hidden = true;
  }

  /** The page's own bar, too. */
  #endProgress() {
    this.find(".spinner").hidden = true;
    this.find('[name="progress-bar"]').hidden = true;
  }

  #progress() {
    const { player } = this;
    const { manifest } = player;
    if (!manifest) return;
    if (manifest.poster && !player.level && !this.posterAsked) this.#showPoster(manifest.poster, player.files);
    const wanted = manifest.levels.find(({ name }) => name === (player.detail.wanted ?? player.choices[0]));
    if (!wanted) return;
    if (this.levelBefore !== wanted) [this.levelBefore, this.loadedBefore] = [wanted, player.files.loaded];
    const [decoder, all] = player.level ? [0, 0] : [weight.loaded, weight.total]; // before the first picture it comes too
    const part = Math.min(1, (player.files.loaded - this.loadedBefore + decoder) / (wanted.first + all));
    const detail = { totalProgress: part, level: wanted.name };
    this.element.dispatchEvent(new CustomEvent("progress", { detail }));
    this.find(".spinner i").style.width = `${100 * part}%`;
    this.find(".spinner div").setAttribute("aria-valuenow", String(Math.round(100 * part)));
    this.find(".spinner span").textContent = `Loading, ${mebibytes(player.files.loaded + decoder)}`;
    if (player.level && player.level.info !== wanted) {
      this.find(".pill").hidden = false;
      this.find(".pill").textContent = `Loading detail, ${Math.round(100 * part)} %`;
    }
  }

  /** A picture to look at until there is one; without it, nothing is lost. */
  async #showPoster(entry, files) {
    this.posterAsked = true;
    if (this.element.hasAttribute("poster")) return;
    const poster = this.find(".poster");
    try {
      poster.src = URL.createObjectURL(new Blob([await files.bytes(entry)]));
      await poster.decode();
      this.poster = entry;
      this.#placePoster();
    } catch {
      poster.hidden = true;
    }
  }

  /** Where nothing is drawn: the poster, and below it why, if that was said. @param {import("../files.js").Files} files */
  async standIn(files) {
    const stage = this.find(".stage");
    const poster = this.find(".poster");
    try {
      const { poster: entry } = parseManifest(await files.text("manifest.json"), files.address("manifest.json"));
      if (entry && stage.isConnected) await this.#showPoster(entry, files);
    } catch {
      return; // what was said stays
    }
    if (poster.src)
      [poster.hidden, poster.alt] = [false, this.element.getAttribute("alt") ?? "The subject, from the front"];
    stage.classList.toggle("still", !poster.hidden);
  }

  /** Where the first picture will show the same; one that would show something else is not shown. */
  #placePoster() {
    if (!this.poster || !this.player || this.player.level) return;
    const { element, player } = this;
    const { camera } = this.poster;
    const { style } = this.find(".poster");
    const place = camera && player.view.placeOf(camera);
    const same = camera?.background.every((v, i) => Math.abs(v - element.paint[i]) < 0.01) && element.paint[3] === 1;
    const plain =
      element.exposure === 1 && Object.keys(element.state).every((key) => key === "frame") && !element.state.frame;
    this.find(".poster").hidden = Boolean(camera) && !(place && same && plain);
    if (!place) return;
    const ratio = player.size[0] / player.canvas.clientWidth;
    const pixels = [place.left, place.top, place.scale * camera.width, place.scale * camera.height];
    ["left", "top", "width", "height"].forEach((name, i) => (style[name] = `${pixels[i] / ratio}px`));
  }

  #pill() {
    this.find(".pill").hidden = true;
  }

  showStatistics(on) {
    this.statistics = on;
    this.find(".stats").hidden = !on;
    if (on) this.#count(true);
    this.player.dispatchEvent(new Event("change"));
  }

  #count(now = false) {
    const time = performance.now();
    if (!this.statistics || (!now && time - (this.counted ?? 0) < 250)) return;
    this.counted = time;
    const s = this.player.statistics;
    const rows = {
      "Pictures a second": this.element.playing ? s.fps.toFixed(0) : "at rest",
      Layers: `${s.layers}`,
      Triangles: s.triangles.toLocaleString("en"),
      Loaded: mebibytes(s.bytesLoaded),
      "GPU memory, computed": mebibytes(s.gpuBytes),
      Detail: s.level,
      Texture: `${s.texture.join(" × ")} ${s.video}`,
      Decoder: s.decoder,
      Canvas: s.canvas.join(" × "),
    };
    this.find(".stats").innerHTML = Object.entries(rows)
      .map(([name, value]) => `<dt>${name}</dt><dd>${escaped(value)}</dd>`)
      .join("");
  }

  /** A short word that goes by itself. */
  say(text, milliseconds = 3500) {
    const toast = this.find(".toast");
    toast.textContent = text;
    toast.hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => (toast.hidden = true), milliseconds);
  }

  /**
   * A failure, in words. @param {Error} error
   * @param {"all" | "notice"} how over all, or (what was shown goes on) as a notice
   */
  fail(error, how = "all") {
    const known = error instanceof PlayerError;
    const title = known ? error.message : `The player failed: ${error.message}`;
    const remedy = known ? error.remedy : "Load the page again; if it fails again, please report it.";
    if (how === "notice" && error.kind !== "lost") {
      this.find(".pill").hidden = true;
      return this.say(`${title}. ${remedy}`, 12000);
    }
    this.#endProgress();
    this.find(".message h2").textContent = title;
    this.find(".message p").textContent = remedy;
    this.find(".message .file").textContent = error.file ?? "";
    this.find(".message").hidden = false;
    // Nobody else's focus is taken away.
    if ([document.body, this.element].includes(document.activeElement))
      this.find(".message button").focus({ preventScroll: true });
  }

  #hideMessage() {
    this.find(".message").hidden = true;
  }
}

function escaped(text) {
  return text.replace(/[&<>]/g, (sign) => `&#${sign.charCodeAt(0)};`);
}
