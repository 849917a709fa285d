/** The head before the viewer, through WebXR: one picture an eye, at life size (a unit of an asset is taken as a metre). */
import { fromRows, multiplied } from "./matrices.js";

const AWAY = 0.9; // metres from the viewer to the head's middle

/** @returns {Promise<boolean>} whether there is a headset to ask for */
export async function offersVr() {
  return (await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false)) ?? false;
}

export class Immersion {
  /** @param {import("./player.js").Player} player @param {() => void} onEnd */
  constructor(player, onEnd) {
    this.player = player;
    this.onEnd = onEnd;
    this.before = 0;
  }

  /** @throws if the viewer or the browser refuses */
  async start() {
    const { player } = this;
    const { gl } = player.renderer.graphics;
    const session = await navigator.xr.requestSession("immersive-vr");
    this.session = session;
    session.addEventListener("end", () => {
      player.setImmersed(false);
      this.onEnd();
    });
    await gl.makeXRCompatible();
    this.layer = new XRWebGLLayer(session, gl, { antialias: false, alpha: false });
    await session.updateRenderState({ baseLayer: this.layer, depthNear: 0.05, depthFar: 20 });
    this.space = await session.requestReferenceSpace("local");
    player.setImmersed(true);
    session.requestAnimationFrame((time, frame) => this.#draw(time, frame));
  }

  end() {
    return this.session?.end();
  }

  /** The asset's axes (x forward, z up) to the room's (y up, the viewer looks along -z), the head before the viewer. */
  #place() {
    const [x, y, z] = this.player.home.centre;
    return fromRows([
      [0, 1, 0, -y],
      [0, 0, 1, -z],
      [1, 0, 0, -x - AWAY],
      [0, 0, 0, 1],
    ]);
  }

  #draw(time, frame) {
    const { player, session, layer } = this;
    if (player.closed) return void session.end();
    session.requestAnimationFrame((next, later) => this.#draw(next, later));
    player.moveOn(this.before ? (time - this.before) / 1000 : 0);
    this.before = time;
    const pose = frame.getViewerPose(this.space);
    if (!pose || player.lost) return;
    const place = this.#place();
    for (const eye of pose.views) {
      const { x, y, width, height } = layer.getViewport(eye);
      const view = multiplied(eye.transform.inverse.matrix, place);
      player.renderer.render(eye.projectionMatrix, view, [x, y, width, height], layer.framebuffer);
    }
    player.say("immersed");
  }
}
