/** Any colour that CSS knows, as numbers. */

/** Pages may change their colours with it. */
export const prefersDark = matchMedia("(prefers-color-scheme: dark)");

/** Grounds of the player's own: colours at the middle and at the corners; the head throws a shadow on them. */
export const BACKDROPS = {
  studio: ["#4a505e", "#0e1014"],
  daylight: ["#ffffff", "#bcc6d2"],
  clay: ["#f0dfcd", "#b08a6c"],
};

/** Where the middle of a backdrop is, as a share of the picture, from above. */
export const MIDDLE = [0.5, 0.45];

/** @param {string} name @returns {string} image of CSS */
export const backdropImage = (name) => {
  const [x, y] = MIDDLE.map((share) => `${100 * share}%`);
  return `radial-gradient(circle farthest-corner at ${x} ${y}, ${BACKDROPS[name].join(", ")})`;
};

/** @param {string} name @returns {boolean} whether a background can be called so */
export const isBackground = (name) => isColour(name) || Object.hasOwn(BACKDROPS, name);

/** @param {string} colour @returns {boolean} */
const isColour = (colour) => typeof colour === "string" && CSS.supports("background-color", colour);

/**
 * What a colour means where `place` stands: variables, `currentcolor` and system colours included.
 * @param {string} colour @param {HTMLElement} place whose background it becomes
 * @returns {number[]} straight RGBA in [0, 1], in sRGB
 */
export function painted(colour, place) {
  place.style.backgroundColor = colour;
  return numbersOf(getComputedStyle(place).backgroundColor);
}

export function numbersOf(colour) {
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
