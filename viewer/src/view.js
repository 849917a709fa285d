/** The eye: an orbit by mouse, touch and keys, or for a while an exact camera of a capture. */
import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { orbitOf, positionOf, projectionOf, viewOf } from "./camera.js";

const FIELD_OF_VIEW = 30; // degrees, of the shorter side
const HOME_DISTANCE = 1; // the subject is at the origin, the capture's cameras about 1 unit from it

export class View {
  /** @param {HTMLElement} surface that takes the pointer @param {() => void} onChange */
  constructor(surface, onChange) {
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(2, 0, 0);
    this.controls = new OrbitControls(this.camera, surface);
    Object.assign(this.controls, { enableDamping: true, dampingFactor: 0.12, rotateSpeed: 0.7, zoomSpeed: 0.8 });
    Object.assign(this.controls, { minDistance: 0.2, maxDistance: 20, zoomToCursor: true });
    this.controls.addEventListener("change", onChange);
    this.onChange = onChange;
    this.exact = null;
    this.home = null;
  }

  /** Eases a movement out. Call once a picture. */
  update() {
    if (!this.exact) this.controls.update();
  }

  /** The first view: the subject from the front; nearer if all there is is small. @param {import("three").Sphere} bounds */
  setHome(bounds) {
    const fitting = bounds.radius / Math.tan((FIELD_OF_VIEW / 360) * Math.PI);
    const distance = HOME_DISTANCE * Math.sqrt(Math.max(0.5, Math.min(1, this.camera.aspect))); // heads are upright
    const home = { azimuth: 0, elevation: 0, distance, target: [0, 0, 0] };
    this.home = fitting < distance ? { ...home, distance: fitting, target: bounds.center.toArray() } : home;
  }

  reset() {
    if (this.home) this.set(this.home);
  }

  get() {
    return orbitOf(this.camera.position, this.controls.target);
  }

  set(orbit) {
    this.setExact(null);
    this.controls.target.fromArray(orbit.target);
    this.camera.position.copy(positionOf(orbit));
    this.controls.update();
    this.onChange();
  }

  /** Moves by angles in degrees and a factor of the distance (keyboard). */
  move(azimuth, elevation, factor = 1) {
    const now = this.get();
    const up = Math.max(-89, Math.min(89, now.elevation + elevation));
    this.set({ ...now, azimuth: now.azimuth + azimuth, elevation: up, distance: now.distance * factor });
  }

  /** @param {{K: number[][], w2c: number[][], width: number, height: number} | null} camera null: back to the orbit */
  setExact(camera) {
    this.exact = camera;
    this.controls.enabled = camera === null;
    this.onChange();
  }

  /**
   * Matrices of a picture of `width` x `height`, near and far plane tight around `bounds`.
   * @param {typeof this.exact} [camera] instead of the view's own
   */
  matrices(width, height, bounds, camera = this.exact) {
    const view = camera ? viewOf(camera.w2c) : this.#orbitView();
    const depth = -bounds.center.clone().applyMatrix4(view).z;
    const far = Math.max(0.1, depth + 1.05 * bounds.radius);
    const near = Math.max(0.005, far / 500, depth - 1.05 * bounds.radius);
    if (camera) return { view, projection: projectionOf(camera, width, height, near, far) };
    const half = Math.tan((FIELD_OF_VIEW / 360) * Math.PI);
    const focal = Math.min(width, height) / (2 * half);
    const K = [[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]; // prettier-ignore
    return { view, projection: projectionOf({ K, width, height }, width, height, near, far) };
  }

  #orbitView() {
    this.camera.updateMatrixWorld();
    return this.camera.matrixWorldInverse.clone();
  }

  /** The pointer's zoom and pan need the camera's own projection. */
  resize(width, height) {
    const aspect = width / height;
    const half = Math.tan((FIELD_OF_VIEW / 360) * Math.PI);
    this.camera.aspect = aspect;
    this.camera.fov = (360 / Math.PI) * Math.atan(aspect < 1 ? half / aspect : half);
    this.camera.updateProjectionMatrix();
  }

  get eye() {
    return new Vector3().copy(this.camera.position);
  }

  dispose() {
    this.controls.dispose();
  }
}
