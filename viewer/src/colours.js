/** Any colour that CSS knows, as numbers. */

/** Pages may change their colours with it. */
export const prefersDark = matchMedia("(prefers-color-scheme: dark)");

/** @param {string} colour @returns {boolean} */
export const isColour = (colour) => typeof colour === "string" && CSS.supports("background-color", colour);

/**
 * What a colour means where `place` stands: variables, `currentcolor` and system colours included.
 * @param {string} colour @param {HTMLElement} place whose background it becomes
 * @returns {number[]} straight RGBA in [0, 1], in sRGB
 */
export function painted(colour, place) {
  place.style.backgroundColor = colour;
  return numbersOf(getComputedStyle(place).backgroundColor);
}

function numbersOf(colour) {
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  context.fillStyle = colour;
  context.fillRect(0, 0, 1, 1);
  return Array.from(context.getImageData(0, 0, 1, 1).data, (value) => value / 255);
}

/**
 * Whether dark words can be read on it. @param {number[]} rgba
 * @param {Element} place that the page shines through to, where the colour does not cover it
 */
export function isLight([r, g, b, a], place) {
  if (a >= 0.5) return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.5;
  const around = place.assignedSlot ?? place.parentElement ?? place.getRootNode().host;
  if (around) return isLight(numbersOf(getComputedStyle(around).backgroundColor), around);
  const schemes = getComputedStyle(document.documentElement).colorScheme;
  return !schemes.includes("dark") || (schemes.includes("light") && !prefersDark.matches);
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
