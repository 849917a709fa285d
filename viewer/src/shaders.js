/** What a layer's pixel is: docs/reference/asset-format.md, "A player in eight steps". Stored values in, stored values out. */

/** Shared by all passes of a layer, so that their depths are equal bit for bit. */
export const VERTEX = `#version 300 es
precision highp float;
invariant gl_Position;
uniform mat4 projection;
uniform mat4 view;
uniform vec3 shift; // of the layer, when the layers are pulled apart
uniform vec4 torso; // normal and offset of the plane from which on points stay in the room while the head turns
uniform float band; // within which they come to stay; 0: nothing does
uniform mat4 stay; // where points of the layers that stay are, in the meshes' own frame
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 uv;
out vec2 st;
out vec3 point;
out vec3 made; // the same, as the layers were made
void main() {
  st = uv;
  made = position;
  point = position;
  if (band > 0.0) {
    float share = clamp((dot(torso.xyz, position) - torso.w) / band, 0.0, 1.0);
    point = mix(position, (stay * vec4(position, 1.0)).xyz, share);
  }
  gl_Position = projection * (view * vec4(point + shift, 1.0));
}`;

export const DEPTH_FRAGMENT = `#version 300 es
precision highp float;
out vec4 nothing;
void main() { nothing = vec4(0.0); }`;

/** What may be shown in place of the picture, by the value of `kind`. */
export const KINDS = ["colour", "alpha", "depth", "uv"];

export const COLOUR_FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D picture;
uniform vec4 colourRect; // x, y, w, h of this layer's colour in the picture, pixels
uniform vec2 alphaOffset; // from its colour to its alpha
uniform vec3 eye; // where the picture is seen from, shift of the layer taken off
uniform int kind; // of KINDS
uniform float exposure; // factor of the light
uniform vec3 centre; // from which hems are told by their direction
uniform vec2 hems; // from how far round layers fade, to the subject's right and left, radians
uniform vec2 range; // distances from the eye that are shown bright and dark, for depth
#ifdef REFLECTION
uniform sampler2D reflection;
uniform vec4 environmentRect; // of the reflection's picture, pixels; so are the next three
uniform vec4 glossRect;
uniform vec4 offsetRect;
uniform vec4 normalsRect;
uniform vec3 reflectionScales; // of environment, gloss, offset; all 0: off
uniform vec4 toMaps; // (s, t) of this layer -> that of the maps: times xy, plus zw
uniform mat3 toRoom; // from the meshes' own axes to those of the room, which the light is fixed to
#endif
in vec2 st;
in vec3 point;
in vec3 made;
out vec4 result;

vec4 lookAt(sampler2D image, vec4 rect, vec2 at) {
  vec2 margin = 0.5 / rect.zw;
  return texture(image, (rect.xy + clamp(at, margin, 1.0 - margin) * rect.zw) / vec2(textureSize(image, 0)));
}

vec4 look(sampler2D image, vec4 rect, vec2 offset) {
  return lookAt(image, vec4(rect.xy + offset, rect.zw), st);
}

#ifdef REFLECTION
vec3 reflected() {
  vec2 at = st * toMaps.xy + toMaps.zw;
  vec3 normal = normalize(lookAt(reflection, normalsRect, at).rgb * 2.0 - 1.0);
  vec3 along = normalize(point - eye);
  vec3 r = toRoom * (along - 2.0 * min(dot(along, normal), 0.0) * normal);
  vec2 place = 0.5 + 0.5 * vec2(r.y, -r.z) / sqrt(max(2.0 * (1.0 + r.x), 1e-6));
  vec3 light = lookAt(reflection, environmentRect, place).rgb * reflectionScales.x;
  float gloss = lookAt(reflection, glossRect, at).r * reflectionScales.y;
  return gloss * light - (lookAt(reflection, offsetRect, at).rgb * 2.0 - 1.0) * reflectionScales.z;
}
#endif

// Stored values are sRGB's: to light and back.
vec3 exposed(vec3 stored) {
  vec3 light = exposure * mix(stored / 12.92, pow((stored + 0.055) / 1.055, vec3(2.4)), step(0.04045, stored));
  return min(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light)), 1.0);
}

void main() {
  vec3 colour = look(picture, colourRect, vec2(0.0)).rgb;
  float alpha = look(picture, colourRect, alphaOffset).r;
#ifdef REFLECTION
  colour = clamp(colour + reflected(), 0.0, 1.0);
#endif
  if (exposure != 1.0) colour = exposed(colour);
  if (hems.x < 3.14) {
    vec3 off = made - centre;
    float from = off.y < 0.0 ? hems.x : hems.y;
    float behind = atan(length(vec2(off.y, max(off.z, 0.0))), off.x); // the crown is not behind
    alpha *= 1.0 - smoothstep(from, from + 0.5, behind);
  }
  if (kind == 1) colour = vec3(1.0);
  if (kind == 2) colour = vec3(1.0 - clamp((distance(eye, point) - range.x) / (range.y - range.x), 0.0, 1.0));
  if (kind == 3) colour = vec3(st, 0.35);
  result = vec4(colour, alpha);
}`;

/** A backdrop: from its middle to the farthest corner, with noise of less than a step against bands. */
export const BACKDROP_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 rect; // of the picture: x, y, width, height, pixels
uniform vec2 middle; // share of the picture, from below
uniform vec3 inner, outer;
out vec4 result;
void main() {
  vec2 at = gl_FragCoord.xy - rect.xy;
  vec2 centre = middle * rect.zw;
  float part = distance(at, centre) / length(max(centre, rect.zw - centre));
  float noise = fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))) - 0.5;
  result = vec4(mix(inner, outer, part) + noise / 255.0, 1.0);
}`;

/** A square on the floor, its corners from the vertices' numbers. */
export const SHADOW_VERTEX = `#version 300 es
precision highp float;
uniform mat4 projection;
uniform mat4 view;
uniform vec3 centre;
uniform vec2 reach;
out vec2 place;
void main() {
  place = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  gl_Position = projection * (view * vec4(centre + vec3(place * reach, 0.0), 1.0));
}`;

export const SHADOW_FRAGMENT = `#version 300 es
precision highp float;
uniform float intensity;
in vec2 place;
out vec4 result;
void main() {
  float away = dot(place, place);
  result = vec4(0.0, 0.0, 0.0, intensity * exp(-3.5 * away) * smoothstep(1.0, 0.6, away));
}`;

/** One triangle over the whole picture. */
export const MEANS_VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

/** Means of stored, premultiplied values over 2 x 2 pixels. */
export const MEANS_FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D fine;
out vec4 result;
vec4 at(ivec2 corner, int x, int y) { return texelFetch(fine, corner + ivec2(x, y), 0); }
void main() {
  ivec2 corner = 2 * ivec2(gl_FragCoord.xy);
  result = 0.25 * (at(corner, 0, 0) + at(corner, 1, 0) + at(corner, 0, 1) + at(corner, 1, 1));
}`;

export const WIRE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 wire;
out vec4 result;
void main() { result = wire; }`;
