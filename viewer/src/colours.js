/** Any colour that CSS knows, as numbers. */

/** @param {string} colour @returns {boolean} */
export const isColour = (colour) => typeof colour === "string" && CSS.supports("background-color", colour);

/**
 * What a colour means where `place` stands: variables, `currentcolor` and system colours included.
 * @param {string} colour @param {HTMLElement} place whose background it becomes
 * @returns {number[]} straight RGBA in [0, 1], in sRGB
 */
export function painted(colour, place) {
  place.style.backgroundColor = colour;
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  context.fillStyle = getComputedStyle(place).backgroundColor;
  context.fillRect(0, 0, 1, 1);
  return Array.from(context.getImageData(0, 0, 1, 1).data, (value) => value / 255);
}

/** As "#rrggbb", for controls that know nothing else. @param {number[]} rgba */
export const hexOf = (rgba) =>
  `#${rgba
    .slice(0, 3)
    .map((value) =>
      Math.round(255 * value)
        .toString(16)
        .padStart(2, "0"),
    )
    .join("")}`;
