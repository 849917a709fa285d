extends Spatial
# Plays what `python -m stages.godot_export` writes. Add it to a scene, give it a folder, play. y is up, the subject
# looks to +z; the meshes are about 1 unit from where the capture's cameras stood.
#
# While it plays from the beginning the textures come from the WebM. Godot 3 cannot seek in one: `seek` shows a picture
# of its own for the frame, and `play` after it goes on with pictures (leaving out what the machine is too slow for)
# until the end of the sequence; the next round is the WebM again.

signal frame_changed(frame)
signal finished

const FORMAT = "facefolds-godot"
const VERSION = 1

export(String, DIR) var folder = ""
export var autoplay = true
export var loop = true

var contents = {}
var error = ""
var frames = 0
var fps = 1.0
var frame = 0
var playing = false
var from_video = false

var _materials = []
var _video
var _picture
var _clock = 0.0
var _started = false


func _ready():
	_video = VideoPlayer.new()
	_video.visible = false
	add_child(_video)
	if folder != "" and load_folder(folder) and autoplay:
		play()


# Loads an exported folder and shows its first frame; false, with the reason in `error`, if that fails.
func load_folder(path):
	stop()
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
	if frames == 0:
		return
	if frame >= frames - 1 or frame == 0:
		_start_video()
	elif from_video:
		_video.paused = false
	else:
		_clock = frame / fps
	playing = true


func pause():
	playing = false
	if from_video:
		_video.paused = true


func stop():
	playing = false
	_started = false
	if _video != null:
		_video.stop()


# Shows frame `number` exactly, and pauses the WebM; false if its picture cannot be read.
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
	_video.stop()
	_started = false
	_show(_picture, false)
	_clock = number / fps
	_set_frame(number)
	return true


func set_layer_visible(index, shown):
	get_child(index + 1).visible = shown


func _process(delta):
	if not playing:
		return
	if from_video:
		_follow_video()
	else:
		_clock += delta
		var number = int(_clock * fps)
		if number >= frames:
			_end()
		elif number != frame:
			seek_on(number)


# As `seek`, but the clock goes on by itself.
func seek_on(number):
	var time = _clock
	if not seek(number):
		playing = false
		push_error("facefolds: " + error)
	_clock = time


func _follow_video():
	if _video.is_playing():
		_started = true
		_set_frame(int(clamp(_video.stream_position * fps, 0, frames - 1)))
	elif _started:
		_end()


func _end():
	emit_signal("finished")
	if loop:
		_start_video()
	else:
		playing = false
		seek(frames - 1)


func _start_video():
	if frames == 1:
		return
	if _video.stream == null:
		var stream = VideoStreamWebm.new()
		stream.set_file(folder.plus_file(contents.video))
		_video.stream = stream
	_video.paused = false
	_video.play()
	_started = false
	var texture = _video.get_video_texture()
	if texture == null:
		error = "cannot play " + folder.plus_file(contents.video)
		push_error("facefolds: " + error)
		playing = false
		return
	_show(texture, true)
	_set_frame(0)


func _show(texture, is_video):
	from_video = is_video
	_set_all("picture", texture)
	_set_all("from_video", is_video)


func _set_frame(number):
	if number != frame:
		frame = number
		emit_signal("frame_changed", frame)


func _clear():
	for layer in get_children():
		if layer is MeshInstance:
			remove_child(layer)
			layer.queue_free()
	_materials = []
	_picture = null
	_video.stream = null


func _read_contents():
	var path = folder.plus_file("facefolds.json")
	var file = File.new()
	if file.open(path, File.READ) != OK:
		return "cannot open " + path + ": is it a folder that stages.godot_export wrote?"
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
	_set_all("slices", float(count))
	_set_all("centre", bounds.position + bounds.size / 2)
	_set_all("radius", bounds.size.length() / 2)
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
