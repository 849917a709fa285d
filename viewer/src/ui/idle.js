/** The bar goes away while the sequence plays and nobody does anything, and comes back at the first movement. */

const PATIENCE = 3000; // ms

/** @param {import("../element.js").FacefoldsPlayer} element @returns {() => void} ends it */
export function connectIdle(element) {
  const { player, shadowRoot: root } = element;
  const stage = root.querySelector(".stage");
  const listening = new AbortController();
  let timer = 0;
  const busy = () =>
    !element.playing ||
    !root.querySelector(".panel").hidden ||
    root.querySelector(":is(.bar, .panel) :focus-visible, .bar:hover, dialog[open]") !== null;
  const wake = () => {
    stage.classList.remove("idle");
    clearTimeout(timer);
    timer = setTimeout(() => stage.classList.toggle("idle", !busy()), PATIENCE);
  };
  const { signal } = listening;
  for (const name of ["pointermove", "pointerdown", "keydown", "focusin"])
    root.addEventListener(name, wake, { signal, passive: true });
  for (const name of ["play", "pause"]) player.addEventListener(name, wake, { signal });
  return () => {
    listening.abort();
    clearTimeout(timer);
  };
}
