/** What the layers stand before: a backdrop, and the soft shadow that the head throws on the floor. */
import { MIDDLE } from "./colours.js";
import { eyeOf } from "./matrices.js";
import { BACKDROP_FRAGMENT, MEANS_VERTEX, SHADOW_FRAGMENT, SHADOW_VERTEX } from "./shaders.js";

const REACH = 1.3; // of the shadow, in half sizes of the box around the layers
const GRAZING = 0.1; // of the eye's direction upwards: the shadow fades where the floor is seen from the side

/**
 * Over all of a part of a framebuffer. @param {import("./gl/graphics.js").Graphics} graphics @param {number[]} rect
 * @param {number[][]} colours RGBA at the middle and at the corners
 */
export function drawBackdrop(graphics, rect, [inner, outer]) {
  const { gl } = graphics;
  const { program, at } = graphics.program(MEANS_VERTEX, BACKDROP_FRAGMENT);
  gl.useProgram(program);
  gl.uniform4f(at.rect, ...rect);
  gl.uniform2f(at.middle, MIDDLE[0], 1 - MIDDLE[1]);
  gl.uniform3f(at.inner, ...inner.slice(0, 3));
  gl.uniform3f(at.outer, ...outer.slice(0, 3));
  for (const part of [gl.DEPTH_TEST, gl.BLEND]) gl.disable(part);
  gl.bindVertexArray(null);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

/** The same on a canvas. @param {OffscreenCanvasRenderingContext2D} context */
export function fillBackdrop(context, width, height, colours) {
  const centre = [MIDDLE[0] * width, MIDDLE[1] * height];
  const radius = Math.hypot(Math.max(centre[0], width - centre[0]), Math.max(centre[1], height - centre[1]));
  const gradient = context.createRadialGradient(...centre, 0, ...centre, radius);
  colours.forEach(([r, g, b], i) => gradient.addColorStop(i, `rgb(${255 * r} ${255 * g} ${255 * b})`));
  context.fillStyle = gradient;
  context.fillRect(0, 0, width, height);
}

/** Under a box. @param {{low: number[], high: number[]}} box @param {number} intensity 0 to 1 */
export function drawShadow(graphics, projection, view, { low, high }, intensity) {
  const centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]];
  const towards = eyeOf(view).map((v, i) => v - centre[i]);
  const seen = Math.max(0, Math.min(1, towards[2] / Math.hypot(...towards) / GRAZING));
  if (!seen) return;
  const { gl } = graphics;
  const { program, at } = graphics.program(SHADOW_VERTEX, SHADOW_FRAGMENT);
  gl.useProgram(program);
  gl.uniformMatrix4fv(at.projection, false, projection);
  gl.uniformMatrix4fv(at.view, false, view);
  gl.uniform3f(at.centre, ...centre);
  gl.uniform2f(at.reach, ...[0, 1].map((i) => (REACH * (high[i] - low[i])) / 2));
  gl.uniform1f(at.intensity, intensity * seen);
  gl.disable(gl.DEPTH_TEST);
  gl.enable(gl.BLEND);
  gl.bindVertexArray(null);
  gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
}
