/** Whether an element can be seen, and whether it soon may be. */

const MARGIN = "300px"; // around what is on the screen: near enough to begin to load

/**
 * @param {HTMLElement} element
 * @param {(seen: boolean) => void} onChange whenever it comes into sight or goes out of it, the page's own tab included
 * @returns {() => void} ends it
 */
export function watchSight(element, onChange) {
  let inside = true; // until the browser has looked
  const tell = () => onChange(inside && !document.hidden);
  const observer = new IntersectionObserver((entries) => {
    inside = entries.at(-1).isIntersecting;
    tell();
  });
  observer.observe(element);
  document.addEventListener("visibilitychange", tell);
  return () => {
    observer.disconnect();
    document.removeEventListener("visibilitychange", tell);
  };
}

/** Calls `act` once the element is near what is on the screen. @returns {() => void} gives up */
export function whenNear(element, act) {
  const observer = new IntersectionObserver(
    (entries) => {
      if (!entries.at(-1).isIntersecting) return;
      observer.disconnect();
      act();
    },
    { rootMargin: MARGIN },
  );
  observer.observe(element);
  return () => observer.disconnect();
}
