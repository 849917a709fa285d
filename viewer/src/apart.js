/** The layers pulled apart, and the view that shows all of them. */

const ASIDE = { azimuth: 62, elevation: 8 }; // degrees: from where layers that are pulled apart are seen
const ACROSS = { azimuth: 28, elevation: 26 }; // the same where the canvas is tall: their row goes up the picture

const SMALL = 0.5; // of the largest layer's area: what has less lies beneath others in places only, and would be scraps by itself

/**
 * Places in the row of layers: small ones stay with the one before them.
 * @param {number[]} areas of all layers @returns {number[]} of each layer, from 0
 */
export function placesInRow(areas) {
  const least = SMALL * Math.max(...areas);
  let last = -1;
  return areas.map((area) => (last = area >= least ? last + 1 : Math.max(last, 0)));
}

export class Apart {
  /** @param {import("./player.js").Player} player */
  constructor(player) {
    this.player = player;
    this.together = null; // the view before
  }

  /** Pulls the layers apart, and turns aside so that all are seen and fill the canvas; at 0 goes back. */
  pull(amount) {
    const { view, renderer } = this.player;
    if (amount && !this.together) this.together = { orbit: view.get(), atHome: view.atHome };
    renderer.setSpread(amount);
    if (view.free !== amount > 0) view.setFree(amount > 0);
    if (amount) view.frame(renderer.bounds(), ([width, height]) => (width > height ? ASIDE : ACROSS));
    else if (this.together) {
      view.glide(this.together.orbit);
      view.atHome = this.together.atHome;
      this.together = null;
    }
    this.player.changed();
  }
}
