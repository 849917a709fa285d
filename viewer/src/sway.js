/** How far a view that moves by itself has turned. */

/** @param {number} seconds since it began, which is gently @param {number} speed degrees a second @returns {number} degrees */
export const roundAndRound = (seconds, speed) => speed * (seconds < 2 ? seconds ** 2 / 4 : seconds - 1);

/**
 * @param {number} seconds since it began, which is gently
 * @param {{degrees: number, seconds: number}} width to each side; there and back
 * @param {[number, number]} room that there is to the right and to the left, degrees
 * @returns {number} degrees
 */
export function toAndFro(seconds, { degrees, seconds: period }, [right, left]) {
  const part = Math.min(1, seconds / 2) * Math.sin((2 * Math.PI * seconds) / period);
  return part * Math.max(0, Math.min(degrees, part > 0 ? left : right));
}
