/** The eye: an orbit by mouse, touch and keys, or for a while an exact camera of a capture. */
import { FIELD_OF_VIEW } from "./attributes.js";
import { axesOf, framing, orbitView, projectionOf, viewOf } from "./camera.js";
import { connectGestures } from "./gestures.js";
import { bounded, clamp, hemsFrom, narrowed, resisted, strength, unwound } from "./limits.js";
import { transformed } from "./matrices.js";
import { roundAndRound, toAndFro } from "./sway.js";

const FILLED = 0.92; // of the free part of the canvas, by what there is; facefolds_core/packaging/poster.py has it, too
const halfOf = (degrees) => Math.tan((degrees / 360) * Math.PI);
const EASE = 0.07; // s in which most of a movement is done
const DISTANCES = [0.2, 20];
const FARTHEST = 3; // times the distance from where all is seen
const FAINT = 0.9; // strength of the picture below which it is told why
const LARGEST = 6; // pixels of the canvas that a texel takes when one has come as near as one can
const SWAY = { degrees: 5, seconds: 9 }; // to each side; there and back
const ROTATION = { degrees: 25, seconds: 20, speed: 12, patience: 3000 }; // degrees a second all round; ms after a touch

/** @typedef {[import("./attributes.js").Asked, import("./attributes.js").Asked]} Allowed */

export class View {
  /** @param {HTMLElement} surface that takes the pointer @param {() => void} onChange a picture is due */
  constructor(surface, onChange) {
    this.surface = surface;
    this.onChange = onChange;
    this.now = { azimuth: 0, elevation: 0, distance: 2, target: [0, 0, 0] };
    this.goal = { ...this.now };
    this.pushed = null; // azimuth and elevation that the pointer asks for, limits or not
    this.exact = null;
    this.home = null;
    this.atHome = true; // nobody has moved it: it is fitted again when the canvas changes
    this.framed = null; // arguments of `frame`
    this.range = bounded(null); // from where the picture is good
    this.reach = this.range; // of that, what the page allows
    this.allowed = [{}, {}]; // least and most, as the page says
    this.whole = 2; // distance from where all is seen
    this.filmed = null; // of the manifest
    this.front = 0; // units from the middle of what there is to its front
    this.detail = Infinity; // texels that a unit of the scene has at most
    this.free = false; // limits are off: the layers are pulled apart
    this.inset = 0; // part of the height that the controls take, from below
    this.size = [1, 1];
    this.shape = [1, 1]; // width and height of what the first view fits
    this.swaying = 0; // s since it began; 0: still
    this.rotates = false; // it sways wider, also at rest, and again after a touch
    this.zooms = true; // by wheel, pinch and keys
    this.pans = true; // what is looked at can be moved
    this.half = halfOf(FIELD_OF_VIEW); // tangent of half the field of view
    this.first = {}; // what the page asks of the first view
    this.eases = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.gestures = connectGestures(surface, this);
  }

  /** @param {import("./limits.js").Filmed | null} range degrees that were filmed */
  setFilmed(range) {
    this.filmed = range;
    this.setFree(this.free);
  }

  /** Limits off, or on again. */
  setFree(free) {
    this.free = free;
    this.range = bounded(free ? null : this.filmed);
    this.reach = free ? this.range : narrowed(this.range, this.allowed);
    if (!free) this.#aim(this.goal);
    this.onChange();
  }

  /** Moves on by `seconds`. @returns {boolean} whether it goes on moving */
  update(seconds) {
    if (this.exact) return false;
    const part = this.eases ? 1 - Math.exp(-seconds / EASE) : 1;
    const { now, goal } = this;
    const keys = ["azimuth", "elevation", "distance"];
    const moving =
      keys.some((key) => Math.abs(goal[key] - now[key]) > 1e-4 * Math.max(1, Math.abs(goal[key]))) ||
      goal.target.some((v, i) => Math.abs(v - now.target[i]) > 1e-5);
    if (moving) {
      for (const key of keys) now[key] += part * (goal[key] - now[key]);
      now.target = now.target.map((v, i) => v + part * (goal.target[i] - v));
    } else this.now = { ...goal, target: [...goal.target] };
    if (this.swaying) this.swaying += seconds;
    return moving;
  }

  /** A slow turn to and fro, until somebody touches the view. */
  startSway() {
    if (this.eases) this.swaying ||= 1e-6;
  }

  /** Turns by itself: to and fro as far as the picture is good, or round where that is everywhere. */
  setRotation(on) {
    this.rotates = on;
    clearTimeout(this.timer);
    if (!on) return this.#stopSway();
    this.startSway();
    this.onChange();
  }

  #stopSway() {
    if (this.rotates) {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.setRotation(true), ROTATION.patience);
    }
    if (!this.swaying) return;
    const offset = this.#sway();
    this.swaying = 0;
    this.now.azimuth += offset;
    this.goal.azimuth += offset;
  }

  /** Degrees; it begins gently, and goes no further than the picture is good. */
  #sway() {
    if (!this.swaying) return 0;
    const { azimuth } = this.reach;
    if (this.rotates && azimuth[1] === Infinity) return roundAndRound(this.swaying, ROTATION.speed);
    const room = [this.now.azimuth - azimuth[0], azimuth[1] - this.now.azimuth];
    return toAndFro(this.swaying, this.rotates ? ROTATION : SWAY, room);
  }

  #swayed() {
    return { ...this.now, azimuth: this.now.azimuth + this.#sway() };
  }

  /** @param {import("./attributes.js").Asked} first @param {number} field of view, degrees */
  setFirst(first, field) {
    [this.first, this.half] = [first, halfOf(field)];
    this.atHome = true;
  }

  /** How far the page lets it be moved. @param {Allowed} allowed least and most */
  setAllowed(allowed) {
    this.allowed = allowed;
    this.setFree(this.free);
  }

  /**
   * The first view: all that there is, from the front, and from the same place whatever the canvas is like, so that the
   * asset's poster shows the same. @param {{low: number[], high: number[], centre: number[]}} box */
  setHome({ low, high, centre }) {
    this.shape = [high[1] - low[1], high[2] - low[2]];
    this.front = high[0] - centre[0];
    const away = this.#distanceFor(...this.shape);
    this.whole = clamp(away + 0.5 * (high[0] - centre[0]), DISTANCES);
    const { share = 1, target = [], ...first } = this.first;
    const looked = centre.map((v, i) => target[i] ?? v);
    this.home = { azimuth: 0, elevation: 0, distance: share * this.whole, ...first, target: looked };
    if (!this.atHome || this.exact) return;
    const { swaying } = this;
    this.reset();
    this.swaying = swaying; // nobody has touched it
  }

  /** From how far something of that width and height fills the free part of the canvas. */
  #distanceFor(across, tall) {
    const [width, height] = this.#room();
    return (this.#side() * Math.max(across / width, tall / height)) / (2 * this.half * FILLED);
  }

  /**
   * Turns to a direction, from where the canvas holds all of a box and no more. Until somebody moves the view, it does so
   * again when the canvas changes.
   * @param {{low: number[], high: number[]}} box
   * @param {(size: [number, number]) => {azimuth: number, elevation: number}} directionFor a canvas of that size
   */
  frame({ low, high }, directionFor) {
    const direction = directionFor(this.size);
    const [width, height] = this.#room();
    const slope = (this.half * FILLED) / this.#side();
    const { distance, target } = framing({ low, high }, direction, [slope * width, slope * height]);
    this.glide({ ...direction, distance, target });
    this.framed = [{ low, high }, directionFor];
  }

  reset() {
    if (!this.home) return;
    this.set(this.home);
    this.atHome = true;
  }

  get() {
    return { ...this.now, azimuth: unwound(this.now.azimuth, [-Infinity, Infinity]), target: [...this.now.target] };
  }

  /** Goes there at once. @param {Partial<import("./camera.js").Orbit>} orbit */
  set(orbit) {
    this.setExact(null);
    this.touched();
    this.#aim({ ...this.goal, ...orbit });
    this.now = { ...this.goal, target: [...this.goal.target] };
    this.onChange();
  }

  /** Moves there gently. @param {Partial<import("./camera.js").Orbit>} orbit */
  glide(orbit) {
    this.touched();
    this.#aim({ ...this.goal, ...orbit });
    this.onChange();
  }

  #aim(orbit) {
    const azimuth = clamp(unwound(orbit.azimuth, this.reach.azimuth), this.reach.azimuth);
    const elevation = clamp(orbit.elevation, this.reach.elevation);
    const distance = clamp(orbit.distance, this.#distances());
    this.goal = { azimuth, elevation, distance, target: [...orbit.target] };
    if (Math.abs(azimuth - this.now.azimuth) > 180)
      this.now.azimuth = unwound(this.now.azimuth, [azimuth - 180, azimuth + 180]);
  }

  /** As near as there is detail to be seen, but twice as near as the first view at least. */
  #distances() {
    const detailed = this.front + this.#side() / (2 * this.half * LARGEST * this.detail);
    const nearest = Math.max(DISTANCES[0], Math.min(detailed, (this.home?.distance ?? Infinity) / 2));
    if (this.free) return [nearest, DISTANCES[1]];
    const [least, most] = this.allowed.map(({ distance, share }) => distance ?? share * this.whole); // NaN: as it is
    const farthest = Math.max(FARTHEST * this.whole, this.home?.distance ?? 0);
    return [Math.max(nearest, least || 0), Math.max(nearest, Math.min(most || farthest, DISTANCES[1]))];
  }

  /** Somebody has moved the view: it stays as it is from now on. */
  touched() {
    this.#stopSway();
    this.atHome = false;
    this.framed = null;
  }

  /** Moves by angles in degrees and a factor of the distance (keyboard). */
  move(azimuth, elevation, factor = 1) {
    this.touched();
    const { goal } = this;
    this.set({
      ...goal,
      azimuth: goal.azimuth + azimuth,
      elevation: goal.elevation + elevation,
      distance: goal.distance * factor,
    });
  }

  /** The pointer turns: by parts of the canvas' height. */
  turn(dx, dy) {
    this.touched();
    this.pushed ??= { azimuth: this.goal.azimuth, elevation: this.goal.elevation };
    this.pushed.azimuth -= 250 * dx;
    this.pushed.elevation += 250 * dy;
    const { reach, range, pushed } = this;
    for (const angle of ["azimuth", "elevation"]) {
      // Where the page's limit is the nearer one, the movement ends there; beyond what is good it meets resistance.
      const ends = reach[angle].map((end, i) => (end === range[angle][i] ? (i ? Infinity : -Infinity) : end));
      pushed[angle] = clamp(pushed[angle], ends);
      this.goal[angle] = resisted(pushed[angle], range[angle]);
    }
    this.goal.elevation = clamp(this.goal.elevation, [-89, 89]);
    if (strength(this.goal, this.range) < FAINT) this.surface.dispatchEvent(new Event("limit"));
    this.onChange();
  }

  /** The pointer is lifted: back to what was filmed. */
  rest() {
    this.pushed = null;
    this.surface.dispatchEvent(new Event("rest"));
    this.#aim(this.goal);
    this.onChange();
  }

  /** Moves what is looked at along the picture, by CSS pixels. */
  pan(dx, dy) {
    if (!this.pans) return;
    this.touched();
    const unit = this.#unit();
    const { right, up } = axesOf(this.goal);
    this.goal.target = this.goal.target.map((v, i) => v - unit * dx * right[i] + unit * dy * up[i]);
    this.onChange();
  }

  /** Nearer or further, towards a place of the picture. @param {number} x, y CSS pixels from its middle, y down */
  zoom(factor, x = 0, y = 0) {
    if (!this.zooms) return;
    this.touched();
    const before = this.#unit();
    this.goal.distance = clamp(this.goal.distance * factor, this.#distances());
    const change = before - this.#unit();
    const { right, up } = axesOf(this.goal);
    if (this.pans) this.goal.target = this.goal.target.map((v, i) => v + change * (x * right[i] - y * up[i]));
    this.onChange();
  }

  /** Units of the scene in a CSS pixel at the target. */
  #unit() {
    const scale = this.surface.clientHeight / this.size[1] || 1;
    return (2 * this.half * this.goal.distance) / (this.#side() * scale);
  }

  /** Pixels of the canvas that a unit of the scene takes, at the target; an exact camera may come as near as it likes. */
  get pixelsAUnit() {
    return this.exact ? Infinity : this.#side() / (2 * this.half * this.goal.distance);
  }

  /** Of the square, in pixels, that the field of view is of: one that holds what there is fits the canvas just so. */
  #side() {
    const [[width, height], [across, tall]] = [this.#room(), this.shape];
    return Math.min(width / across, height / tall) * Math.max(across, tall);
  }

  /** Pixels that the controls leave. */
  #room() {
    return [this.size[0], Math.max(0.3 * this.size[1], this.size[1] - this.inset)];
  }

  /** @param {{K: number[][], w2c: number[][], width: number, height: number} | null} camera null: back to the orbit */
  setExact(camera) {
    this.exact = camera;
    this.onChange();
  }

  /** How strong the picture is: less where nothing was filmed. */
  get strength() {
    return this.exact ? 1 : strength(this.#swayed(), this.range);
  }

  /** What fades of what lies far round; nothing from an exact camera. */
  get hems() {
    return this.exact || this.free ? null : hemsFrom(this.#swayed(), this.filmed, this.range);
  }

  /**
   * Matrices of a picture of `width` x `height`, near and far plane tight around `bounds`.
   * @param {typeof this.exact} [camera] instead of the view's own
   */
  matrices(width, height, bounds, camera = this.exact) {
    const view = camera ? viewOf(camera.w2c) : orbitView(this.#swayed());
    const depth = -transformed(view, bounds.centre)[2];
    const far = Math.max(0.1, depth + 1.05 * bounds.radius);
    const near = Math.max(0.005, far / 500, depth - 1.05 * bounds.radius);
    if (camera) return { view, projection: projectionOf(camera, width, height, near, far) };
    const K = this.#intrinsics(width, height);
    return { view, projection: projectionOf({ K, width, height }, width, height, near, far) };
  }

  #intrinsics(width, height) {
    const hidden = this.size[1] - this.#room()[1];
    const scale = Math.min(width / this.size[0], height / this.size[1]);
    const focal = (this.#side() * scale) / (2 * this.half);
    return [[focal, 0, width / 2], [0, focal, (height - hidden * scale) / 2], [0, 0, 1]]; // prettier-ignore
  }

  /**
   * Where a picture would lie on the canvas to show what the view does.
   * @param {{K: number[][], w2c: number[][]}} camera that took it
   * @returns {{scale: number, left: number, top: number} | null} pixels of the canvas; null: it shows something else
   */
  placeOf({ K, w2c }) {
    const [mine, its] = [orbitView(this.now), viewOf(w2c)];
    if (this.exact || mine.some((v, i) => Math.abs(v - its[i]) > 2e-3)) return null;
    const own = this.#intrinsics(...this.size);
    const scale = own[0][0] / K[0][0];
    return { scale, left: own[0][2] - scale * K[0][2], top: own[1][2] - scale * K[1][2] };
  }

  /** @param {number} inset pixels of the height that the controls take, from below */
  resize(width, height, inset) {
    this.size = [width, height];
    this.inset = inset;
    if (this.framed) this.frame(...this.framed);
  }

  dispose() {
    clearTimeout(this.timer);
    this.gestures.dispose();
  }
}
