/** The head before the viewer, through WebXR: in a headset, or in the room that the device's camera shows. At life size: a
 * unit of an asset is taken as a metre. */
import { fromRows, multiplied } from "./matrices.js";

const AWAY = 0.9; // metres from the viewer to the head's middle
const SESSIONS = { vr: "immersive-vr", ar: "immersive-ar" };

/** @typedef {"vr" | "ar"} Kind @param {Kind} kind @returns {Promise<boolean>} whether this device has it */
export async function offers(kind) {
  return (await navigator.xr?.isSessionSupported(SESSIONS[kind]).catch(() => false)) ?? false;
}

export class Immersion {
  /** @param {import("./player.js").Player} player @param {Kind} kind @param {() => void} onEnd */
  constructor(player, kind, onEnd) {
    Object.assign(this, { player, kind, onEnd });
    this.before = 0;
    this.place = null; // from the asset's axes to the room's; null: to be chosen
  }

  /** @throws if the viewer or the browser refuses */
  async start() {
    const { player } = this;
    const { gl } = player.renderer.graphics;
    const session = await navigator.xr.requestSession(SESSIONS[this.kind]);
    this.session = session;
    session.addEventListener("end", () => {
      player.setImmersed(false);
      this.onEnd();
    });
    session.addEventListener("select", () => (this.place = null)); // to where one looks now
    await gl.makeXRCompatible();
    this.layer = new XRWebGLLayer(session, gl, { antialias: false, alpha: this.kind === "ar" });
    await session.updateRenderState({ baseLayer: this.layer, depthNear: 0.05, depthFar: 20 });
    this.space = await session.requestReferenceSpace("local");
    player.setImmersed(true);
    session.requestAnimationFrame((time, frame) => this.#draw(time, frame));
  }

  end() {
    return this.session?.end();
  }

  /**
   * The head upright in the middle of what is looked at, turned to the viewer: the asset's axes (x forward, y to its left, z up)
   * to the room's (y up). @param {Float32Array} eye the viewer's own axes, which look along -z, to the room's
   */
  #before(eye) {
    const [x, y, z] = this.player.home.centre;
    const middle = [12, 13, 14].map((i) => eye[i] - AWAY * eye[i - 4]);
    let [across, along] = [eye[8], eye[10]];
    if (Math.hypot(across, along) < 0.1) [across, along] = [-eye[4], -eye[6]]; // straight down: what is up there is ahead
    const length = Math.hypot(across, along) || 1;
    const [a, b] = [across / length, along / length];
    return fromRows([
      [a, b, 0, middle[0] - a * x - b * y],
      [0, 0, 1, middle[1] - z],
      [b, -a, 0, middle[2] - b * x + a * y],
      [0, 0, 0, 1],
    ]);
  }

  #draw(time, frame) {
    const { player, session, layer, kind } = this;
    if (player.closed) return void session.end();
    session.requestAnimationFrame((next, later) => this.#draw(next, later));
    player.moveOn(this.before ? (time - this.before) / 1000 : 0);
    this.before = time;
    const pose = frame.getViewerPose(this.space);
    if (!pose || player.lost) return;
    this.place ??= this.#before(pose.transform.matrix);
    for (const eye of pose.views) {
      const { x, y, width, height } = layer.getViewport(eye);
      const view = multiplied(eye.transform.inverse.matrix, this.place);
      const ground = kind === "ar" ? [0, 0, 0, 0] : null; // the room is behind
      player.renderer.render(eye.projectionMatrix, view, [x, y, width, height], layer.framebuffer, ground);
    }
    player.say("immersed");
  }
}
