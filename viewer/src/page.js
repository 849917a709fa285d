/** The full page: index.html?src=FOLDER&folder=PATH#VIEW; the path is where the asset lies on this machine, for commands. The address follows the view; keys that nobody else takes are the player's. */
import "./index.js";
import { acceptDrops } from "./ui/drop.js";
import { decode, encode } from "./viewstate.js";

const PAUSE = 400; // ms without a change before the address is brought up to date

const player = document.querySelector("facefolds-player");
const given = new URLSearchParams(location.search);
if (parent === window) player.setAttribute("gestures", "all"); // in a frame the page around it scrolls
acceptDrops(player);
player.state = decode(location.hash);
player.setAttribute("src", given.get("src") ?? "asset/");
if (given.has("folder")) player.setAttribute("folder", given.get("folder"));
if (given.has("controls")) player.setAttribute("controls", given.get("controls"));

let timer = 0;
function note() {
  clearTimeout(timer);
  timer = setTimeout(() => {
    if (player.ready && player.shareable) history.replaceState(null, "", `#${encode(player.state)}`);
  }, PAUSE);
}
for (const name of ["pause", "change", "level", "play"]) player.addEventListener(name, note);
for (const name of ["pointerup", "keyup", "wheel"]) player.addEventListener(name, note, { passive: true });
addEventListener("keydown", (event) => event.target === document.body && player.press?.(event));
addEventListener("hashchange", () => (player.state = decode(location.hash)));
player.addEventListener("ready", () => (document.title = `${player.player.manifest.subject} · facefolds`));
