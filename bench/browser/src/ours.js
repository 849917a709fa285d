// The player of this project, built from viewer/. ?asset=NAME
import "/player/facefolds-player.js";
import { offer } from "./common.js";

const given = new URLSearchParams(location.search);
const element = document.createElement("facefolds-player");
const seen = {};
const note = (name) => (seen[name] ??= { ms: performance.now(), bytes: element.statistics.bytesLoaded });

element.addEventListener("ready", () => note("first"));
element.addEventListener("load", () => (element.level = element.levels.at(-1))); // whatever the window shows of it
element.addEventListener("level", () => {
  if (element.level !== element.levels.at(-1) || window.loaded) return;
  note("all");
  const { player } = element;
  const show = (degrees) => player.view.set({ azimuth: degrees, elevation: 0, distance: 1, target: [0, 0, 0] });
  const draw = (degrees) => {
    show(degrees);
    const { projection, view } = player.view.matrices(...player.size, player.renderer.bounds());
    player.renderer.draw(projection, view, 1, true);
  };
  const play = async (degrees, k) => {
    show(degrees);
    player.renderer.graphics.finer = false; // one ray a pixel, as on the other pages
    player.stale = false; // what is drawn is drawn by `seek`, once
    await player.seek(k % player.playback.frames); // decodes, uploads and draws
  };
  draw(0);
  offer(player.renderer.graphics.gl, { draw, play }, seen);
});
const poster = setInterval(() => {
  const image = element.shadowRoot?.querySelector(".poster");
  if (!image || image.hidden || !image.naturalWidth) return;
  note("poster");
  clearInterval(poster);
}, 4);

element.setAttribute("controls", "none");
element.setAttribute("background", "#000000");
element.setAttribute("src", `/${given.get("asset")}/`);
element.style.cssText = "position: fixed; inset: 0";
document.body.append(element);
