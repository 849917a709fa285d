/** The graphics context may be lost, and come back: the player says so, and goes on. */
import { PlayerError } from "./errors.js";

/** @param {import("./player.js").Player} player @returns {AbortController} ends it */
export function watchContext(player) {
  const listening = new AbortController();
  const { signal } = listening;
  const { graphics } = player.renderer;
  player.lost = graphics.lost;
  const lost = () => {
    player.lost = true;
    player.fail(
      new PlayerError("The graphics context was lost", {
        kind: "lost",
        remedy: "The player goes on by itself when the machine gives it back. If it does not, load the page again.",
      }),
    );
  };
  const restored = async () => {
    player.lost = false;
    player.renderer.restore();
    if (player.level && !(await player.seek(player.playback.frame))) return;
    player.say("restored");
    player.wake();
  };
  graphics.addEventListener("lost", lost, { signal });
  graphics.addEventListener("restored", restored, { signal });
  return listening;
}
