/** A held-out photo over the asset, seen from the photo's camera at the photo's frame, with a border to drag. */
import { fitted } from "../camera.js";
import { PlayerError } from "../errors.js";

export class Comparison {
  /** @param {import("../element.js").FacefoldsPlayer} element */
  constructor(element) {
    this.element = element;
    this.player = element.player;
    this.index = null; // of the photo shown
    this.addresses = new Map();
    const root = element.shadowRoot;
    this.box = root.querySelector(".compare");
    this.picture = this.box.querySelector("img");
    this.slider = this.box.querySelector("input");
    this.select = this.box.querySelector("select");
    this.slider.addEventListener("input", () => this.#split());
    this.select.addEventListener("change", () => this.open(Number(this.select.value)));
    this.player.addEventListener("draw", () => this.#place());
  }

  async open(index) {
    const photo = this.player.manifest?.photos[index];
    if (!photo) return;
    this.index = index;
    try {
      this.picture.src = await this.#address(index, photo);
      await this.picture.decode();
    } catch (cause) {
      this.close();
      const remedy = "Copy or make the asset again.";
      const broken = new PlayerError(`The photo ${photo.file.name} is damaged`, { remedy, cause });
      this.element.overlays.fail(cause instanceof PlayerError ? cause : broken, "notice");
      return;
    }
    if (this.index !== index) return;
    const { photos } = this.player.manifest;
    this.select.replaceChildren(
      ...photos.map(
        ({ camera, frame }, i) => new Option(`Camera ${camera}, frame ${frame + 1}`, i, false, i === index),
      ),
    );
    this.element.pause();
    this.player.view.setExact(photo);
    await this.player.seek(photo.frame);
    this.box.hidden = false;
    this.#place();
    this.#split();
    this.player.dispatchEvent(new Event("change"));
  }

  close() {
    if (this.index === null) return;
    this.index = null;
    this.box.hidden = true;
    this.player.view.setExact(null);
    this.player.dispatchEvent(new Event("change"));
  }

  async #address(index, photo) {
    if (!this.addresses.has(index)) {
      const bytes = await this.player.files.bytes(photo.file);
      this.addresses.set(index, URL.createObjectURL(new Blob([bytes])));
    }
    return this.addresses.get(index);
  }

  /** Where the renderer draws the photo's picture: whole and centred. */
  #place() {
    if (this.index === null) return;
    const { width, height } = this.player.manifest.photos[this.index];
    const { clientWidth, clientHeight } = this.player.canvas;
    const { x, y, scale } = fitted(width, height, clientWidth, clientHeight);
    const frame = this.box.querySelector(".frame").style;
    Object.assign(frame, { left: `${x}px`, top: `${y}px`, width: `${scale * width}px`, height: `${scale * height}px` });
  }

  #split() {
    this.box.querySelector(".frame").style.setProperty("--at", `${this.slider.value}%`);
  }
}
