/** Types of facefolds-player. Importing the module defines the element <facefolds-player>. */

export type Mode = "colour" | "alpha" | "depth" | "uv";

/** Degrees; azimuth from before the subject (+x) to its left (+y). */
export interface Orbit {
  azimuth: number;
  elevation: number;
  distance: number;
  target: number[];
}

/** A pinhole camera: K by rows, pixel centres at (i + 0.5, j + 0.5); w2c = (R | t) by rows, OpenCV's axes. */
export interface Camera {
  K: number[][];
  w2c: number[][];
  width: number;
  height: number;
}

/** What a link holds; layers and photos by index. */
export interface ViewState {
  frame?: number;
  /** To set, parts are enough. */
  view?: Partial<Orbit>;
  level?: string;
  background?: string;
  hidden?: number[];
  spread?: number;
  wireframe?: boolean;
  effects?: boolean;
  mode?: Mode;
  speed?: number;
  loop?: boolean;
  photo?: number;
}

export interface Statistics {
  fps: number;
  layers: number;
  triangles: number;
  bytesLoaded: number;
  gpuBytes: number;
  level: string;
  texture: [number, number];
  canvas: [number, number];
  rays: number;
  video: string;
  decoder: string;
}

export type FailureKind =
  "missing" | "damaged" | "unsupported" | "codec" | "webgl" | "lost" | "offline" | "cors" | "csp" | "file";

export interface PlayerError extends Error {
  readonly remedy: string;
  readonly file: string;
  readonly kind: FailureKind;
}

export interface PlayerEvents {
  ready: CustomEvent<null>;
  level: CustomEvent<null>;
  frame: CustomEvent<null>;
  play: CustomEvent<null>;
  pause: CustomEvent<null>;
  /** The end, where it does not loop. */
  ended: CustomEvent<null>;
  /** All that was to be loaded is there. */
  load: CustomEvent<null>;
  /** Of the level that is being loaded: `totalProgress` from 0 to 1. */
  progress: CustomEvent<{ totalProgress: number; level: string }>;
  "camera-change": CustomEvent<null>;
  change: CustomEvent<null>;
  error: CustomEvent<PlayerError | Error>;
}

export class FacefoldsPlayer extends HTMLElement {
  /** There is a picture. */
  readonly ready: boolean;
  /** The frame on the screen, from 0; -1 before the first. */
  readonly frame: number;
  readonly frames: number;
  readonly fps: number;
  readonly playing: boolean;
  /** Names of the levels that this machine can show, coarsest first. */
  readonly levels: string[];
  readonly statistics: Statistics | undefined;
  /** Address of the full page with this asset and view. */
  readonly link: string;
  /** Whether the asset has an address that others could open. */
  readonly shareable: boolean;
  loop: boolean;
  speed: number;
  /** The sound is off until somebody asks for it. */
  muted: boolean;
  /** Seconds, at the sequence's own speed. */
  readonly duration: number;
  currentTime: number;
  /** A head that turns is held still. */
  still: boolean;
  /** Any colour of CSS, or "studio", "daylight", "clay". */
  background: string;
  /** The attributes of the same names, in their words; "" where there is none. */
  cameraOrbit: string;
  cameraTarget: string;
  fieldOfView: string;
  minCameraOrbit: string;
  maxCameraOrbit: string;
  autoRotate: boolean;
  disableZoom: boolean;
  disablePan: boolean;
  disableTap: boolean;
  /** A factor of the light; 1 by default. */
  exposure: number;
  /** Folder, manifest.json or .glb of the asset. */
  src: string;
  /** What screen readers say of it. */
  alt: string;
  /** Address of a picture shown until the asset is. */
  poster: string;
  loading: "auto" | "lazy";
  /** "manual": only the poster is fetched, until `dismissPoster()`. */
  reveal: "auto" | "manual";
  dismissPoster(): void;
  /** How far the layers are pulled apart, 0 to 1. */
  spread: number;
  wireframe: boolean;
  effects: boolean;
  mode: Mode;
  /** Which layers are drawn, outermost first. */
  layers: boolean[];
  /** Name of the level shown; to set also "auto". */
  level: string;
  state: ViewState;
  play(): void;
  pause(): void;
  /** True once that frame has been drawn, false if another was asked for meanwhile. */
  seek(frame: number): Promise<boolean>;
  step(by?: number): Promise<boolean>;
  reset(): void;
  resetView(): void;
  setCamera(camera: Camera | null): void;
  capture(camera?: Camera): ImageData;
  /** A PNG. */
  screenshot(camera?: Camera): Promise<Blob>;
  /** u, v and depth at a place of the window (`clientX`, `clientY`), for `data-surface` of a hotspot. */
  surfaceFromPoint(x: number, y: number): string | null;
  /** What is seen, by default as a PNG. */
  toBlob(options?: { mimeType?: string; qualityArgument?: number }): Promise<Blob>;
  /**
   * A film of one turn from side to side, MP4 or WebM, with the asset's sound: 8 s and 40 degrees unless told otherwise. The
   * signal ends it early; `onPart` hears how much there is, 0 to 1.
   */
  record(options?: {
    seconds?: number;
    degrees?: number;
    signal?: AbortSignal;
    onPart?: (part: number) => void;
  }): Promise<Blob>;
  compare(photo: number | null): void;
  /** The device can show the head in the room around (WebXR); known some time after `ready`. */
  readonly canActivateAR: boolean;
  /** Shows the head in the room, or ends that; after a click only. */
  activateAR(): Promise<void>;
  /** Plays an asset that is at hand: name -> content, manifest.json among them. */
  openFiles(files: Map<string, Blob>): void;
  addEventListener<K extends keyof PlayerEvents>(
    type: K,
    listener: (this: FacefoldsPlayer, event: PlayerEvents[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "facefolds-player": FacefoldsPlayer;
  }
}
