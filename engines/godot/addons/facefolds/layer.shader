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

float device_depth(mat4 projection, float z) {
	vec4 clip = projection * vec4(0.0, 0.0, z, 1.0);
	return clip.w > 0.0 ? clamp(clip.z / clip.w, -1.0, 1.0) : -1.0;
}

void vertex() {
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

void fragment() {
	vec2 place = rect.xy + clamp(UV * rect.zw, vec2(0.5), rect.zw - 0.5);
	vec3 colour = texture(picture, (colour_origin + place) / picture_size).rgb;
	ALBEDO = OUTPUT_IS_SRGB ? colour : to_linear(colour);
	ALPHA = depth_only ? 0.0 : texture(picture, (alpha_origin + place) / picture_size).r;
}
