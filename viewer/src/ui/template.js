/** The player's markup, in its shadow root. Every control has a name; every picture is decoration or has a text. */
import style from "./style.css";

/** One sheet for all players; a page's Content-Security-Policy has nothing against it. */
export const STYLE = new CSSStyleSheet();
STYLE.replaceSync(style);

const icon = (path) => `<svg viewBox="0 0 24 24" aria-hidden="true"><path d="${path}"/></svg>`;

export const ICONS = {
  play: icon("M8 5.2v13.6a.8.8 0 0 0 1.2.7l10.6-6.8a.8.8 0 0 0 0-1.4L9.2 4.5a.8.8 0 0 0-1.2.7z"),
  pause: icon("M7 5h3.2v14H7zM13.8 5H17v14h-3.2z"),
  back: icon("M6 5h2.4v14H6zM19 5.6v12.8a.7.7 0 0 1-1.1.6L9.6 12.6a.7.7 0 0 1 0-1.2L17.900 5a.7.7 0 0 1 1.100.600z"),
  next: icon("M15.600 5H18v14h-2.400zM5 5.600v12.800a.7.7 0 0 0 1.100.600l8.300-6.400a.7.7 0 0 0 0-1.200L6.100 5A.7.7 0 0 0 5 5.600z"),
  loop: icon("M7 6h9.200l-2-2L15.600 2.600 20 7l-4.400 4.400-1.400-1.400 2-2H7a3 3 0 0 0-3 3v1H2v-1a5 5 0 0 1 5-5zm10 12H7.800l2 2-1.400 1.400L4 17l4.400-4.400 1.400 1.400-2 2H17a3 3 0 0 0 3-3v-1h2v1a5 5 0 0 1-5 5z"),
  compare: icon("M11 2h2v20h-2zM4 5h5v2H5v10h4v2H4a1 1 0 0 1-1-1V6a1 1 0 0 1 1-1zm11 0h5a1 1 0 0 1 1 1v12a1 1 0 0 1-1 1h-5z"),
  sound: icon("M4 9v6h4l5 5V4L8 9zm12.500 3a4.500 4.500 0 0 0-2.500-4v8a4.500 4.500 0 0 0 2.500-4zM14 3.200v2.100a7 7 0 0 1 0 13.400v2.100a9 9 0 0 0 0-17.600z"),
  mute: icon("M4 9v6h4l5 5V4L8 9zm17.400.600L20 8.200l-2.400 2.400-2.400-2.400-1.400 1.400 2.400 2.400-2.400 2.400 1.400 1.400 2.400-2.400 2.400 2.400 1.400-1.400L19 12z"),
  settings: icon("M4 6h9.200a3 3 0 0 1 5.600 0H20v2h-1.200a3 3 0 0 1-5.600 0H4zm12 2.200a1.200 1.200 0 1 0 0-2.400 1.200 1.200 0 0 0 0 2.400zM4 16h1.200a3 3 0 0 1 5.600 0H20v2h-9.200a3 3 0 0 1-5.600 0H4zm4 2.200a1.200 1.200 0 1 0 0-2.400 1.200 1.200 0 0 0 0 2.400z"),
  share: icon("M17 15.500a3 3 0 0 0-2.200 1L9 13.100a3.200 3.200 0 0 0 0-2.200l5.800-3.400a3 3 0 1 0-.8-2 3 3 0 0 0 .1.800L8.300 9.700a3 3 0 1 0 0 4.600l5.800 3.400a3 3 0 1 0 2.900-2.200z"),
  full: icon("M4 4h6v2H6v4H4zm10 0h6v6h-2V6h-4zM4 14h2v4h4v2H4zm14 0h2v6h-6v-2h4z"),
  close: icon("M18.300 4.300 12 10.600 5.700 4.300 4.300 5.700l6.300 6.300-6.300 6.300 1.400 1.400 6.300-6.300 6.300 6.300 1.400-1.400-6.300-6.300 6.300-6.300z"),
  picture: icon("M9 4h6l1.500 2H20a1.500 1.500 0 0 1 1.500 1.500v10A1.500 1.500 0 0 1 20 19H4a1.500 1.500 0 0 1-1.500-1.500v-10A1.500 1.500 0 0 1 4 6h3.500zm3 4.500a4 4 0 1 0 0 8 4 4 0 0 0 0-8zm0 2a2 2 0 1 1 0 4 2 2 0 0 1 0-4z"),
  record: icon("M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm0 2a7 7 0 1 1 0 14 7 7 0 0 1 0-14zm0 3.500a3.500 3.500 0 1 0 0 7 3.500 3.500 0 0 0 0-7z"),
  vr: icon("M4 7h16a2 2 0 0 1 2 2v6a2 2 0 0 1-2 2h-4.200l-2-2.700a2.200 2.200 0 0 0-3.600 0l-2 2.700H4a2 2 0 0 1-2-2V9a2 2 0 0 1 2-2zm3.500 2.500a2 2 0 1 0 0 4 2 2 0 0 0 0-4zm9 0a2 2 0 1 0 0 4 2 2 0 0 0 0-4z"),
  ar: icon("M3 3h6v2H5v4H3zm12 0h6v6h-2V5h-4zM3 15h2v4h4v2H3zm16 0h2v6h-6v-2h4zM12 6.200l5 2.900v5.800l-5 2.900-5-2.900V9.100zm0 2.300-2.300 1.300 2.300 1.400 2.300-1.400zm-3 3v2.300l2 1.200v-2.400zm6 0-2 1.100v2.400l2-1.200z"),
  embed: icon("M8.300 6.700 9.700 8.100 5.800 12l3.900 3.900-1.400 1.400L3 12zm7.400 0L21 12l-5.300 5.300-1.400-1.400L18.200 12l-3.900-3.900z"),
  reset: icon("M12 5V1.500L6.500 6 12 10.500V7a5.500 5.500 0 1 1-5.300 7H4.600A7.500 7.500 0 1 0 12 5z"),
}; // prettier-ignore

const button = (name, label, key = "", extra = "") =>
  `<button type="button" data-do="${name}" aria-label="${label}" title="${label}${key && ` (${key})`}" ${extra}>${ICONS[name] ?? ""}</button>`;

/** A button with its name written out. */
const worded = (name, label, key) => button(name, label, key).replace("</button>", `<span>${label}</span></button>`);

const toggle = (name, label, checked = false) =>
  `<label class="row"><span>${label}</span><input type="checkbox" role="switch" name="${name}" ${checked ? "checked" : ""}></label>`;

const SPEEDS = [0.1, 0.25, 0.5, 1, 1.5, 2];
const SWATCHES = {
  studio: "Studio",
  daylight: "Daylight",
  clay: "Clay",
  "#16181d": "Dark",
  "#000000": "Black",
  "#7f7f7f": "Grey",
  "#ffffff": "White",
  "#2f5d46": "Green",
};

const MODES = { colour: "Picture", alpha: "Opacity", depth: "Depth", uv: "Texture coordinates" };

/** What the canvas is, to who does not see it. */
export const PICTURE =
  "Three-dimensional picture. Drag to turn, wheel (with Ctrl) or pinch to zoom, right button or two fingers to move.";

/** A text to copy. */
const field = ([name, label]) =>
  `<div class="${name}"><label>${label}<textarea name="${name}" rows="3" readonly spellcheck="false"></textarea></label><button type="button" data-copy="${name}">Copy</button></div>`;

export const TEMPLATE = `<div class="stage">
  <canvas tabindex="0" role="img" part="canvas"></canvas>
  <slot name="poster"><img class="poster" part="poster" alt="" hidden></slot>
  <div class="hotspots"></div>
  <div class="compare" hidden>
    <div class="frame"><img alt="Photo of a camera that was held out">
      <span class="tag left">Asset</span><span class="tag right">Photo</span><i></i>
      <input type="range" min="0" max="100" value="50" step="0.5" aria-label="Border between asset and photo"></div>
    <div class="chooser"><select aria-label="Photo"></select>${button("close", "Close the comparison", "Esc")}</div>
  </div>
  <header><b class="title" part="title"></b><span class="pill" role="status" hidden></span></header>
  <dl class="stats" hidden aria-label="Statistics"></dl>
  <slot name="progress-bar"><div class="spinner" part="progress" hidden><div role="progressbar" aria-label="Loading" aria-valuemin="0" aria-valuemax="100"><i></i></div><span>Loading</span></div></slot>
  <aside class="panel" part="panel" aria-label="Settings" hidden>
    <div class="row head"><b>Settings</b>${button("settings", "Close the settings").replace(ICONS.settings, ICONS.close)}</div>
    <label class="row"><span>Detail</span><select name="level"></select></label>
    <label class="row"><span>Show</span><select name="mode">${Object.entries(MODES)
      .map(([mode, name]) => `<option value="${mode}">${name}</option>`)
      .join("")}</select></label>
    <fieldset class="swatches"><legend>Background</legend><div>${Object.entries(SWATCHES)
      .map(([colour, name]) => `<button type="button" data-colour="${colour}" aria-label="${name}" title="${name}"></button>`)
      .join("")}<input type="color" name="background" aria-label="Other background colour" title="Other colour"></div></fieldset>
    <fieldset class="layers"><legend>Layers <small>outermost first</small></legend><div></div></fieldset>
    <label class="row"><span>Pull apart</span><input type="range" name="spread" min="0" max="1" step="0.01" value="0"></label>
    ${toggle("wireframe", "Wireframe")}${toggle("effects", "Reflection", true)}${toggle("stats", "Statistics")}
    <div class="row deeds">${worded("picture", "Save picture", "I")}${worded("record", "Record a turn")}${worded("embed", "Embed")}${worded("reset", "Reset", "0")}</div>
    <details><summary>Keys</summary><dl class="keys">
      <dt>Space</dt><dd>play, pause</dd><dt>← →</dt><dd>step</dd><dt>Home End</dt><dd>first, last frame</dd>
      <dt>&lt; &gt;</dt><dd>slower, faster</dd><dt>L</dt><dd>loop</dd><dt>Shift + arrows</dt><dd>turn</dd><dt>+ −</dt><dd>zoom</dd><dt>0</dt><dd>reset</dd>
      <dt>W</dt><dd>wireframe</dd><dt>E</dt><dd>reflection</dd><dt>P</dt><dd>pull apart</dd><dt>1 … 9</dt><dd>layer on, off</dd><dt>C</dt><dd>compare</dd>
      <dt>M</dt><dd>sound</dd><dt>S</dt><dd>statistics</dd><dt>F</dt><dd>full screen</dd><dt>I</dt><dd>save the picture</dd><dt>Esc</dt><dd>close</dd></dl></details>
  </aside>
  <div class="toast" part="toast" role="status" aria-live="polite" hidden></div>
  <div class="bar" part="bar" role="group" aria-label="Playback">
    <div class="buttons">${button("play", "Play", "Space")}${button("back", "Previous frame", "←")}${button("next", "Next frame", "→")}</div>
    <div class="time"><input type="range" name="frame" min="0" max="0" step="1" value="0" aria-label="Frame"><span class="count" aria-hidden="true"></span>
      <select name="speed" aria-label="Speed" title="Speed">${SPEEDS.map((speed) => `<option value="${speed}" ${speed === 1 ? "selected" : ""}>${speed}×</option>`).join("")}</select></div>
    <div class="buttons">
      ${button("loop", "Loop", "L", 'aria-pressed="true"')}${button("sound", "Sound", "M", 'aria-pressed="false" hidden')}
      ${button("compare", "Compare with a photo", "C", "hidden")}${button("settings", "Settings", "", 'aria-expanded="false"')}
      ${button("ar", "Place it in your room", "", "hidden")}${button("vr", "Enter VR", "", "hidden")}${button("share", "Copy a link to this view")}${button("full", "Full screen", "F")}
    </div>
  </div>
  <div class="message" part="message" role="alert" hidden><div><h2></h2><p></p><p class="file"></p><button type="button" data-do="again">Try again</button></div></div>
  <div class="drop" aria-hidden="true">Drop the asset's folder or a ZIP of it</div>
  <dialog aria-label="Embed"><form method="dialog">
    <div class="row head"><b>Put it on a page of yours</b>${button("", "Close").replace("<button", "<button data-close").replace("></button>", `>${ICONS.close}</button>`)}</div>
    <p class="if-own">Only this machine can reach the address of this page, and its server lets no other page show it. Upload one of these to a server of yours.</p>
    <p class="unless-own">A page of another site can show it where this server lets it: no <code>X-Frame-Options</code> or <code>frame-ancestors</code> against the frame; <code>Access-Control-Allow-Origin</code> for the element, on the player's files and the asset's.</p>
    ${field(["command", "One file that plays by itself: this command makes it"])}
    ${field(["page", "and this code plays it"])}
    <p class="if-own">Or the folders: what <code>viewer/dist</code> holds as <code>player/</code>, and the asset's folder as <code>player/asset/</code>, beside the page.</p>
    ${[["frame", "As a frame, with this view"], ["element", "As an element"]]
      .map(field)
      .join("")}
  </form></dialog>
</div>`; // prettier-ignore
