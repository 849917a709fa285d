shader_type spatial;
// One layer: two reads of the same picture, colour above alpha. It is drawn twice, over the layers inside of it
// (render_priority): to depth alone, then its colour where depth is equal, so that only the nearest crossing of the
// sheet counts. Depth cannot be cleared between layers in Godot: each has a slice of the depth range of its own instead.
render_mode unshaded, cull_disabled, depth_draw_always, blend_mix, shadows_disabled, ambient_light_disabled;

uniform sampler2D picture;
uniform vec2 picture_size;   // pixels
uniform vec2 colour_origin;  // of colour_rect
uniform vec2 alpha_origin;   // of alpha_rect
uniform vec4 rect;           // texture_rect: x, y, width, height
uniform vec3 centre;         // of a sphere around all layers
uniform float radius;
uniform float slice;         // index of the layer, outermost 0
uniform float slices;
uniform bool depth_only;
uniform vec4 torso;           // in the asset's own axes: normal and offset of the plane from which on points stay in the room
uniform float band;           // within which they come to stay, 0 where nothing does
uniform mat4 stay;            // where points that stay are, in these axes

uniform sampler2D reflection;     // four small pictures; the rectangles are x, y, width, height
uniform vec2 reflection_size;     // pixels; 0: there is none
uniform vec4 environment_rect;
uniform vec4 gloss_rect;
uniform vec4 offset_rect;
uniform vec4 normals_rect;
uniform vec3 reflection_scales;   // of environment, gloss and offset
uniform mat3 to_room;              // from the meshes' own axes to those of the room, which the light is fixed to
uniform vec4 to_maps;             // (s, t) of the layer -> that of the maps: times xy, plus zw

varying vec3 point;               // of the surface and of the eye, in the asset's own axes: z up, the subject looks to +x
varying vec3 eye;

float device_depth(mat4 projection, float z) {
	vec4 clip = projection * vec4(0.0, 0.0, z, 1.0);
	return clip.w > 0.0 ? clamp(clip.z / clip.w, -1.0, 1.0) : -1.0;
}

void vertex() {
	point = VERTEX.zxy;
	if (band > 0.0) {
		float share = clamp((dot(torso.xyz, point) - torso.w) / band, 0.0, 1.0);
		point = mix(point, (stay * vec4(point, 1.0)).xyz, share);
		VERTEX = point.yzx;
	}
	eye = (inverse(MODELVIEW_MATRIX) * vec4(0.0, 0.0, 0.0, 1.0)).zxy;
	vec4 clip = PROJECTION_MATRIX * (MODELVIEW_MATRIX * vec4(VERTEX, 1.0));
	float middle = (MODELVIEW_MATRIX * vec4(centre, 1.0)).z;
	float reach = radius * length(MODELVIEW_MATRIX[0].xyz);
	float near = device_depth(PROJECTION_MATRIX, middle + reach);
	float far = device_depth(PROJECTION_MATRIX, middle - reach);
	// From [near, far] into its slice: near + (slice (far - near) + depth - near) / slices.
	clip.z = (near + (slice * (far - near) - near) / slices) * clip.w + clip.z / slices;
	POSITION = clip;
}

vec3 to_linear(vec3 c) {
	return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThan(c, vec3(0.04045)));
}

vec3 read(sampler2D image, vec4 place, vec2 size, vec2 at) {
	return texture(image, (place.xy + clamp(at * place.zw, vec2(0.5), place.zw - 0.5)) / size).rgb;
}

void fragment() {
	vec2 place = rect.xy + clamp(UV * rect.zw, vec2(0.5), rect.zw - 0.5);
	vec3 colour = texture(picture, (colour_origin + place) / picture_size).rgb;
	if (reflection_size.x > 0.0) {
		vec2 at = UV * to_maps.xy + to_maps.zw;
		vec3 normal = normalize(read(reflection, normals_rect, reflection_size, at) * 2.0 - 1.0);
		vec3 along = normalize(point - eye);
		vec3 r = to_room * (along - 2.0 * min(dot(along, normal), 0.0) * normal);
		vec2 from = 0.5 + 0.5 * vec2(r.y, -r.z) / sqrt(max(2.0 * (1.0 + r.x), 0.000001));
		vec3 light = read(reflection, environment_rect, reflection_size, from) * reflection_scales.x;
		colour += light * read(reflection, gloss_rect, reflection_size, at).r * reflection_scales.y;
		colour -= (read(reflection, offset_rect, reflection_size, at) * 2.0 - 1.0) * reflection_scales.z;
		colour = clamp(colour, 0.0, 1.0);
	}
	ALBEDO = OUTPUT_IS_SRGB ? colour : to_linear(colour);
	ALPHA = depth_only ? 0.0 : texture(picture, (alpha_origin + place) / picture_size).r;
}
