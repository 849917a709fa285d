// Compiled, never run: what a program in TypeScript may write.
import { FacefoldsPlayer, type ViewState } from "../types.js";

const element = document.createElement("facefolds-player");
const player: FacefoldsPlayer = element;
const state: ViewState = { frame: 3, mode: "depth" };
player.state = state;
player.addEventListener("error", ({ detail }) => ("remedy" in detail ? detail.remedy : detail.message));
player.reveal = "manual";
player.dismissPoster();
player.minCameraOrbit = `${-player.exposure}deg auto auto`;
player.seek(3).then((drawn: boolean) => drawn);
player.screenshot().then((blob) => blob.size);
// @ts-expect-error: not a mode
player.mode = "colours";
// @ts-expect-error: no way of revealing
player.reveal = "later";
// @ts-expect-error: read only
player.frame = 3;
