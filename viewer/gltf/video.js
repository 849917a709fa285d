/** What both readers of EXT_layered_volumetric_video share: the video, its frames, and the layers' shaders. */

export const NAME = "EXT_layered_volumetric_video";
const TEXTURE_VIDEO = "KHR_texture_video";

/**
 * Holds what was loaded against the extension's checksums, where the page may (over HTTPS).
 * @param {object} said the extension's object
 * @param {(bufferView: number) => Promise<BufferSource>} load
 * @throws {Error} if something is damaged
 */
export async function check(said, load) {
  if (!globalThis.crypto?.subtle) return;
  for (const { bufferView, sha256 } of said.checksums ?? []) {
    const found = new Uint8Array(await crypto.subtle.digest("SHA-256", await load(bufferView)));
    const digits = Array.from(found, (byte) => byte.toString(16).padStart(2, "0"));
    if (digits.join("") !== sha256) throw new Error(`${NAME}: bufferViews[${bufferView}] is damaged`);
  }
}

/**
 * The first of the extension's videos that this browser decodes, ready to be drawn.
 * @param {object} json of the glTF file
 * @param {object} said the extension's object
 * @param {(bufferView: number) => Promise<BufferSource>} load
 * @returns {Promise<HTMLVideoElement>} muted, its sound with it; `released` lets its memory go
 * @throws {Error} if none can be decoded
 */
export async function openVideo(json, said, load) {
  let reason = "no textures";
  for (const index of said.textures) {
    const { source, autoplay = true, loop = true } = json.textures[index].extensions[TEXTURE_VIDEO];
    const { bufferView, uri, mimeType } = json.extensions[TEXTURE_VIDEO].videos[source];
    const url = uri ?? URL.createObjectURL(new Blob([await load(bufferView)], { type: mimeType }));
    const video = Object.assign(document.createElement("video"), { muted: true, playsInline: true, loop, src: url });
    video.crossOrigin = "anonymous";
    video.preload = "auto";
    try {
      await loaded(video);
      if (autoplay) video.play().catch(() => {}); // the page may forbid it: it stands at its first frame
      return video;
    } catch (error) {
      reason = error.message;
      released(video);
    }
  }
  throw new Error(`${NAME}: no video can be decoded (${reason})`);
}

function loaded(video) {
  return new Promise((done, failed) => {
    video.addEventListener("loadeddata", done, { once: true });
    video.addEventListener("error", () => failed(new Error(video.error?.message ?? "damaged")), { once: true });
  });
}

/** Give back what a video holds. */
export function released(video) {
  video.pause();
  if (video.src.startsWith("blob:")) URL.revokeObjectURL(video.src);
  video.removeAttribute("src");
  video.load();
}

/**
 * Say which frame a video shows whenever that changes.
 * @param {HTMLVideoElement} video
 * @param {number} rate frames a second
 * @param {number} frames
 * @param {(frame: number) => void} tell
 */
export function follow(video, rate, frames, tell) {
  const at = (time) => tell(Math.min(frames - 1, Math.max(0, Math.floor(time * rate + 0.01))));
  const presented = (_, { mediaTime }) => {
    video.requestVideoFrameCallback(presented);
    at(mediaTime);
  };
  if ("requestVideoFrameCallback" in video) video.requestVideoFrameCallback(presented);
  else video.addEventListener("timeupdate", () => at(video.currentTime));
}

/** Stop at a frame; resolves when it can be drawn. */
export async function seek(video, rate, frame) {
  video.pause();
  const there = new Promise((done) => video.addEventListener("seeked", done, { once: true }));
  video.currentTime = (frame + 0.5) / rate;
  await there;
}

/** Of a vertex shader: what stays in the room while the node turns, in the node's own axes. */
export const STAYING = `
uniform vec4 torso; // normal and offset of the plane from which on vertices begin to stay
uniform float band; // within which they come to stay, 0 where nothing does
uniform mat4 stay; // where those that stay are
vec3 staying(vec3 p) {
  if (band <= 0.0) return p;
  return mix(p, (stay * vec4(p, 1.0)).xyz, clamp((dot(torso.xyz, p) - torso.w) / band, 0.0, 1.0));
}`;

/**
 * (a, b): a z + b w, in clip coordinates, brings layer `i` of `n` into its slice of the depths that the subject takes.
 * @param {number} near depth of the subject's nearest point, in normalised device coordinates
 * @param {number} far of its farthest
 */
export function slice(i, n, near, far) {
  const share = 0.9 / n; // of the slice, a twentieth stays free on both sides
  return [share, near + (far - near) * ((i + 0.05) / n) - share * near];
}

/**
 * Depths in normalised device coordinates of a sphere's nearest and farthest points.
 * @param {ArrayLike<number>} projection 4 x 4 by columns
 * @param {number} distance of the sphere's centre, along the axis
 * @param {number} radius
 * @param {number} along which z the camera looks: -1, or 1 where the axes are left-handed
 */
export function depths(projection, distance, radius, along = -1) {
  const at = (d) => (projection[14] + along * projection[10] * d) / (projection[15] + along * projection[11] * d);
  const [near, far] = [distance - radius, distance + radius];
  const inFront = projection[11] === 0 || near > 0; // an eye inside the sphere: from the near plane on
  return [inFront ? Math.max(at(near), -1) : -1, Math.min(at(Math.max(far, 1e-6)), 1)];
}

/** GLSL: `shown(st, point)` is a layer's stored colour and its alpha at a place of its own and a point of the mesh. */
export const LAYER = `
uniform sampler2D picture;
uniform vec2 size; // of the picture, pixels
uniform vec4 rectangle; // of the layer, within colours and alphas
uniform vec4 origins; // of the colour image and of the alpha image
#ifdef REFLECTION
uniform sampler2D maps;
uniform vec2 mapsSize;
uniform vec4 environment; // rectangles
uniform vec4 gloss;
uniform vec4 offset;
uniform vec4 normals;
uniform vec3 scales;
uniform vec4 toMaps;
uniform vec3 eye; // in the node's axes, as the two next
uniform vec4 turn; // the node's own rotation, a quaternion (x, y, z, w)
vec3 mapped(vec4 part, vec2 at) {
  return texture(maps, (part.xy + clamp(at * part.zw, vec2(0.5), part.zw - 0.5)) / mapsSize).rgb;
}
vec3 reflected(vec2 st, vec3 point) {
  vec2 at = toMaps.xy * st + toMaps.zw;
  vec3 n = normalize(mapped(normals, at) * 2.0 - 1.0);
  vec3 d = normalize(point - eye);
  vec3 r = d - 2.0 * min(dot(d, n), 0.0) * n;
  r += 2.0 * cross(turn.xyz, cross(turn.xyz, r) + turn.w * r);
  vec2 from = 0.5 + 0.5 * vec2(r.y, -r.z) / sqrt(max(2.0 * (1.0 + r.x), 1e-6));
  vec3 light = mapped(environment, from) * scales.x;
  return mapped(gloss, at).r * scales.y * light - (mapped(offset, at) * 2.0 - 1.0) * scales.z;
}
#endif
vec4 shown(vec2 st, vec3 point) {
  vec2 at = rectangle.xy + clamp(st * rectangle.zw, vec2(0.5), rectangle.zw - 0.5);
  vec3 colour = texture(picture, (origins.xy + at) / size).rgb;
  float alpha = texture(picture, (origins.zw + at) / size).r;
#ifdef REFLECTION
  colour = clamp(colour + reflected(st, point), 0.0, 1.0);
#endif
  return vec4(colour, alpha);
}
`;
