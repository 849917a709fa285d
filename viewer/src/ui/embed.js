/** The dialog with the code for other pages. */
import { embedCode, toClipboard } from "../sharing.js";

/** @param {import("../element.js").FacefoldsPlayer} element */
export function connectEmbed(element) {
  const dialog = element.shadowRoot.querySelector("dialog");
  const fields = Object.fromEntries(Array.from(dialog.querySelectorAll("textarea"), (field) => [field.name, field]));
  element.openEmbed = () => {
    const code = embedCode(element);
    for (const [name, field] of Object.entries(fields)) field.value = code[name];
    dialog.classList.toggle("own", code.own);
    dialog.showModal();
  };
  dialog.addEventListener("click", async ({ target }) => {
    if (target === dialog || target.closest("[data-close]")) return dialog.close();
    const { copy } = target.dataset;
    if (!copy) return;
    fields[copy].select();
    target.textContent = (await toClipboard(fields[copy].value)) ? "Copied" : "Press Ctrl + C";
    setTimeout(() => (target.textContent = "Copy"), 2500);
  });
}
