extends Spatial
# Plays what `facefolds export godot` writes. Add it to a scene, give it a folder, play. y is up, the subject
# looks to +z; the meshes are about 1 unit from where the capture's cameras stood.
#
# Every frame is a picture of its own: `seek` is exact, and playing leaves out the frames that the machine is too slow
# for, so that the clock stays right.

signal frame_changed(frame)
signal finished

const FORMAT = "facefolds-godot"
const VERSION = 1

export(String, DIR) var folder = ""
export var autoplay = true
export var loop = true
export var still = false setget set_still  # holds a head that turns; it performs

var contents = {}
var error = ""
var frames = 0
var fps = 1.0
var frame = 0
var playing = false

var _materials = []
var _picture
var _bounds_centre = Vector3()
var _radius = 0.0
var _clock = 0.0


func _ready():
	if folder != "" and load_folder(folder) and autoplay:
		play()


# Loads an exported folder and shows its first frame; false, with the reason in `error`, if that fails.
func load_folder(path):
	pause()
	folder = path
	frames = 0
	_clear()
	error = _read_contents()
	if error == "":
		error = _build_layers()
	if error == "":
		frames = int(contents.frames)
		fps = float(contents.fps)
		if not seek(0):
			frames = 0
	if error != "":
		push_error("facefolds: " + error)
	return error == ""


func play():
	if frames > 1:
		_clock = 0.0 if frame == frames - 1 else frame / fps
		playing = true


func pause():
	playing = false


# Shows frame `number` exactly; false if its picture cannot be read.
func seek(number):
	number = int(clamp(number, 0, max(frames - 1, 0)))
	var file = folder.plus_file(contents.pictures[number])
	var image = Image.new()
	if image.load(file) != OK:
		error = "cannot read " + file
		return false
	if _picture == null:
		_picture = ImageTexture.new()
		_picture.create_from_image(image, Texture.FLAG_FILTER)
	else:
		_picture.set_data(image)
	_set_all("picture", _picture)
	_place(number)
	_clock = number / fps
	if number != frame:
		frame = number
		emit_signal("frame_changed", frame)
	return true


func set_still(on):
	still = on
	if frames > 0:
		_place(frame)


# Puts the head where it stood in that frame. The light of the room does not turn with it.
func _place(number):
	if not contents.has("track"):
		return
	var pose = contents.track[number]
	var q = pose.quaternion  # w, x, y, z, in the asset's axes: (x, y, z) is (y, z, x) here
	var t = pose.translation
	_set_all("to_room", Basis(Quat(q[1], q[2], q[3], q[0])))
	if contents.has("torso"):
		_let_stay(_transform(pose))
	var placed = Transform(Basis(Quat(q[2], q[3], q[1], q[0])), Vector3(t[1], t[2], t[0]))
	for layer in get_children():
		if layer is MeshInstance:
			layer.transform = Transform.IDENTITY if still else placed
			layer.extra_cull_margin = 2.0 * _radius if contents.has("torso") else 0.0


# A pose in the asset's own axes.
func _transform(pose):
	var q = pose.quaternion
	var t = pose.translation
	return Transform(Basis(Quat(q[1], q[2], q[3], q[0])), Vector3(t[0], t[1], t[2]))


# What lies beyond the torso's plane stays in the room while the head stands in a pose.
func _let_stay(pose):
	var torso = contents.torso
	var n = torso.normal
	var stay = pose.inverse() * _transform(torso)
	var centre = Vector3(_bounds_centre.z, _bounds_centre.x, _bounds_centre.y)
	var w = Quat(stay.basis).w
	var strays = (stay.xform(centre) - centre).length() + 2.0 * _radius * sqrt(max(0.0, 1.0 - w * w))
	_set_all("torso", Plane(n[0], n[1], n[2], torso.offset))
	_set_all("band", 0.0 if still else float(torso.band))
	_set_all("stay", stay)
	_set_all("radius", _radius + strays)


func set_layer_visible(index, shown):
	get_child(index).visible = shown


func _process(delta):
	if not playing:
		return
	var time = _clock + delta
	if time * fps >= frames:
		emit_signal("finished")
		time = fmod(time, frames / fps) if loop else (frames - 1) / fps
		playing = loop
	var number = int(time * fps + 0.001)
	if number != frame and not seek(number):
		playing = false
		push_error("facefolds: " + error)
	_clock = time


func _clear():
	for layer in get_children():
		if layer is MeshInstance:
			remove_child(layer)
			layer.queue_free()
	_materials = []
	_picture = null


func _read_contents():
	var path = folder.plus_file("facefolds.json")
	var file = File.new()
	if file.open(path, File.READ) != OK:
		return "cannot open " + path + ": is it a folder that facefolds export godot wrote?"
	var parsed = JSON.parse(file.get_as_text())
	if parsed.error != OK or typeof(parsed.result) != TYPE_DICTIONARY:
		return path + " is not JSON"
	contents = parsed.result
	if contents.get("format") != FORMAT or contents.get("version") != VERSION:
		return path + ": this add-on reads format " + FORMAT + " " + str(VERSION) + "; export the asset again"
	return ""


func _build_layers():
	var bounds = AABB()
	var count = contents.layers.size()
	for index in count:
		var layer = contents.layers[index]
		var mesh = _read_mesh(folder.plus_file(layer.mesh), int(layer.vertices), int(layer.triangles))
		if mesh == null:
			return "cannot read " + folder.plus_file(layer.mesh) + ": missing or cut off"
		bounds = bounds.merge(mesh.get_aabb()) if index > 0 else mesh.get_aabb()
		var depth = _material(layer, index, true)
		depth.render_priority = 2 * (count - 1 - index)  # the outermost is drawn last
		depth.next_pass = _material(layer, index, false)
		depth.next_pass.render_priority = depth.render_priority + 1
		var instance = MeshInstance.new()
		instance.mesh = mesh
		instance.material_override = depth
		instance.cast_shadow = GeometryInstance.SHADOW_CASTING_SETTING_OFF
		add_child(instance)
	var problem = _add_reflection()
	if problem != "":
		return problem
	_set_all("slices", float(count))
	_set_all("to_room", Basis())
	_bounds_centre = bounds.position + bounds.size / 2
	_radius = bounds.size.length() / 2
	_set_all("centre", _bounds_centre)
	_set_all("radius", _radius)
	return ""


# Optional: what gloss adds, by the direction.
func _add_reflection():
	if not contents.has("reflection"):
		return ""
	var reflection = contents.reflection
	var image = Image.new()
	if image.load(folder.plus_file(reflection.file)) != OK:
		return "cannot read " + folder.plus_file(reflection.file)
	var texture = ImageTexture.new()
	texture.create_from_image(image, Texture.FLAG_FILTER)
	_set_all("reflection", texture)
	_set_all("reflection_size", Vector2(reflection.width, reflection.height))
	for name in ["environment_rect", "gloss_rect", "offset_rect", "normals_rect"]:
		var r = reflection[name]
		_set_all(name, Plane(r[0], r[1], r[2], r[3]))
	var scales = reflection.scales
	_set_all("reflection_scales", Vector3(scales[0], scales[1], scales[2]))
	for index in contents.layers.size():
		var m = contents.layers[index].to_maps
		for material in [_materials[2 * index], _materials[2 * index + 1]]:
			material.set_shader_param("to_maps", Plane(m[0], m[1], m[2], m[3]))
	return ""


func _material(layer, index, depth_only):
	var material = ShaderMaterial.new()
	var r = layer.texture_rect
	material.shader = preload("layer.shader")
	material.set_shader_param("picture_size", Vector2(contents.width, contents.height))
	material.set_shader_param("colour_origin", Vector2(contents.colour_rect[0], contents.colour_rect[1]))
	material.set_shader_param("alpha_origin", Vector2(contents.alpha_rect[0], contents.alpha_rect[1]))
	material.set_shader_param("rect", Plane(r[0], r[1], r[2], r[3]))
	material.set_shader_param("slice", float(index))
	material.set_shader_param("depth_only", depth_only)
	_materials.append(material)
	return material


func _set_all(name, value):
	for material in _materials:
		material.set_shader_param(name, value)


func _read_mesh(path, vertices, triangles):
	var file = File.new()
	if file.open(path, File.READ) != OK or file.get_len() != 20 * vertices + 12 * triangles:
		return null
	var points = PoolVector3Array()
	var coordinates = PoolVector2Array()
	var indices = PoolIntArray()
	points.resize(vertices)
	coordinates.resize(vertices)
	indices.resize(3 * triangles)
	for i in vertices:
		var x = file.get_float()
		var y = file.get_float()
		points[i] = Vector3(x, y, file.get_float())
	for i in vertices:
		var s = file.get_float()
		coordinates[i] = Vector2(s, file.get_float())
	for i in 3 * triangles:
		indices[i] = file.get_32()
	var arrays = []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = points
	arrays[Mesh.ARRAY_TEX_UV] = coordinates
	arrays[Mesh.ARRAY_INDEX] = indices
	var mesh = ArrayMesh.new()
	# No compression: half-precision texture coordinates are too coarse.
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], 0)
	return mesh
