/**
 * Elements of the page that stand at places of the face and follow it: `<button slot="hotspot-nose" data-surface="0 0.1 0.5">`.
 *
 * The numbers are u and v of the model's UV map, and how deep the layer lies: 0 the outermost, 1 the innermost. An element whose
 * place is turned away has no `data-visible`, as with <model-viewer>.
 */
import { eyeOf, IDENTITY, multiplied } from "../matrices.js";
import { projected, spotAt } from "../surface.js";

const OF_PLACES = { childList: true, subtree: true, attributes: true, attributeFilter: ["slot", "data-surface"] };

export class Hotspots {
  /** @param {import("../element.js").FacefoldsPlayer} element @param {import("../player.js").Player} player */
  constructor(element, player) {
    this.element = element;
    this.player = player;
    this.shown = []; // {child, holder, spot}
    this.watcher = new MutationObserver(() => this.#collect());
    this.watcher.observe(element, OF_PLACES);
    player.addEventListener("level", () => this.#collect());
    player.addEventListener("draw", () => this.#move());
  }

  end() {
    this.watcher.disconnect();
  }

  #collect() {
    const children = [...this.element.children].filter(({ slot }) => slot.startsWith("hotspot"));
    this.shown = children.map((child) => {
      const holder = Object.assign(document.createElement("slot"), { name: child.slot, className: "hotspot" });
      return { child, holder, spot: this.#spot(child.dataset.surface) };
    });
    this.element.shadowRoot.querySelector(".hotspots").replaceChildren(...this.shown.map(({ holder }) => holder));
    this.#move();
  }

  /** @param {string | undefined} surface @returns {import("../surface.js").Spot | null} */
  #spot(surface) {
    const { level } = this.player;
    const [u, v, deep = 0.5] = (surface ?? "").trim().split(/\s+/).map(Number);
    if (!level || ![u, v, deep].every(Number.isFinite)) return null;
    const layer = Math.round(Math.max(0, Math.min(1, deep)) * (level.geometries.length - 1));
    return spotAt(level.geometries[layer], level.info.layers[layer].window, [u, v]);
  }

  #move() {
    if (!this.shown.length || !this.player.size[0]) return;
    const { view: orbit, renderer, size, canvas } = this.player;
    const { projection, view } = orbit.matrices(...size, renderer.bounds());
    const pose = renderer.pose ?? IDENTITY;
    const [matrix, eye] = [multiplied(projection, multiplied(view, pose)), eyeOf(multiplied(view, pose))];
    for (const { child, holder, spot } of this.shown) {
      holder.hidden = !spot;
      if (!spot) continue;
      const point = renderer.placed(spot.point);
      const tip = renderer.placed(spot.point.map((p, i) => p + spot.normal[i]));
      const [x, y] = projected(matrix, point);
      const left = (0.5 + x / 2) * canvas.clientWidth;
      const top = (0.5 - y / 2) * canvas.clientHeight;
      holder.style.transform = `translate(${left}px, ${top}px) translate(-50%, -50%)`;
      const towards = tip.reduce((sum, there, i) => sum + (there - point[i]) * (eye[i] - point[i]), 0);
      child.toggleAttribute("data-visible", towards > 0);
    }
  }
}
