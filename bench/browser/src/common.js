// What the pages share: one camera path, one way to take the time.
const SWEEP = 30; // degrees to each side
const PERIOD = 24; // pictures there and back

/** Degrees from the front of the k-th picture. Steps of at most 8 degrees: a splat player has something to sort. */
const azimuth = (k) => SWEEP * Math.sin((2 * Math.PI * k) / PERIOD);

/** Where an upright camera stands, in the asset's axes, at distance 1 of the subject. */
export function position(degrees) {
  const a = (degrees * Math.PI) / 180;
  return [Math.cos(a), Math.sin(a), 0];
}

/**
 * Says that there is a picture, and offers `measure(kind, count)` to the driver.
 * @param {WebGL2RenderingContext} gl
 * @param {Record<string, (degrees: number, k: number) => void | Promise<void>>} kinds ways to draw a picture
 */
export function offer(gl, kinds, loaded = {}) {
  const pixel = new Uint8Array(4);
  const finish = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for all that was drawn
  window.measure = async (kind, count) => {
    const times = [];
    for (let k = 0; k < count; ++k) {
      const before = performance.now();
      const drawn = kinds[kind](azimuth(k), k);
      if (drawn) await drawn;
      finish();
      times.push(performance.now() - before);
      await new Promise((next) => setTimeout(next)); // workers' answers come in
    }
    return times;
  };
  const debug = gl.getExtension("WEBGL_debug_renderer_info");
  window.device = gl.getParameter(debug ? debug.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  finish();
  window.loaded = { picture: performance.now(), ...loaded };
}
