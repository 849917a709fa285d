/** The settings: detail, what is shown, background, layers, pull apart, wireframe, reflection, statistics. */
import { backdropImage, BACKDROPS, hexOf } from "../colours.js";

/** @param {import("../element.js").FacefoldsPlayer} element */
export function connectPanel(element) {
  const panel = element.shadowRoot.querySelector(".panel");
  const { player } = element;
  const input = (name) => panel.querySelector(`[name="${name}"]`);

  for (const { style, dataset } of panel.querySelectorAll("[data-colour]"))
    style.setProperty("--c", BACKDROPS[dataset.colour] ? backdropImage(dataset.colour) : dataset.colour);
  for (const name of ["level", "mode"])
    input(name).addEventListener("change", (event) => (element[name] = event.target.value));
  input("spread").addEventListener("input", (event) => (element.spread = event.target.value));
  for (const name of ["wireframe", "effects"]) {
    input(name).addEventListener("change", (event) => (element[name] = event.target.checked));
  }
  input("stats").addEventListener("change", (event) => element.overlays.showStatistics(event.target.checked));
  input("background").addEventListener("input", (event) => (element.background = event.target.value));
  panel.querySelector(".swatches").addEventListener("click", ({ target }) => {
    if (target.dataset.colour) element.background = target.dataset.colour;
  });
  panel.querySelector(".layers").addEventListener("click", ({ target }) => {
    const { layers } = element;
    if (target.dataset.layer === "all") element.layers = layers.map(() => !layers.every(Boolean));
    else if (target.dataset.layer)
      element.layers = layers.map((on, i) => (i === Number(target.dataset.layer) ? !on : on));
  });

  const showLevel = () => {
    const { levels } = element;
    const names = [...levels].reverse().map((name) => new Option(name, name));
    input("level").replaceChildren(new Option(`auto (${element.level})`, "auto"), ...names);
    input("level").disabled = levels.length < 2;
    input("effects").closest(".row").hidden = !player.level.info.reflection;
    const one = (name, layer) => `<button type="button" data-layer="${layer}" class="${layer}">${name}</button>`;
    const chips = element.layers.map((_, i) => one(String(i + 1), i));
    panel.querySelector(".layers div").innerHTML = [...chips, one("All", "all")].join("");
    showState();
  };
  const showState = () => {
    if (!player.level) return;
    const { layers, background } = element;
    input("level").value = player.detail.auto ? "auto" : element.level;
    input("mode").value = element.mode;
    panel.querySelectorAll("[data-layer]").forEach((chip) => {
      const all = chip.dataset.layer === "all";
      chip.setAttribute("aria-pressed", String(all ? layers.every(Boolean) : layers[Number(chip.dataset.layer)]));
      if (!all) chip.setAttribute("aria-label", `Layer ${Number(chip.dataset.layer) + 1}`);
    });
    panel.querySelectorAll("[data-colour]").forEach((swatch) => {
      swatch.setAttribute("aria-pressed", String(swatch.dataset.colour === background));
    });
    input("background").value = hexOf(element.paint);
    input("spread").value = element.spread;
    input("spread").style.setProperty("--p", `${100 * element.spread}%`);
    input("wireframe").checked = element.wireframe;
    input("effects").checked = element.effects;
    input("stats").checked = element.overlays.statistics;
  };
  player.addEventListener("level", showLevel);
  for (const name of ["ready", "change"]) player.addEventListener(name, showState);
}
