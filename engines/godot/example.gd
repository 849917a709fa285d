extends Spatial
# Space plays and pauses, left and right step, drag turns, wheel zooms. The folder is the scene's, or the environment
# variable FACEFOLDS_FOLDER.

var _azimuth = 0.0
var _elevation = 0.0
var _distance = 1.0

onready var _player = $Player


func _ready():
	var folder = OS.get_environment("FACEFOLDS_FOLDER")
	if folder == "":
		folder = "res://asset"
	if _player.load_folder(folder):
		$Slider.max_value = _player.frames - 1
		_player.play()
	else:
		$Message.text = _player.error
	_player.connect("frame_changed", self, "_on_frame")
	$Slider.connect("value_changed", self, "_on_slider")
	_place()


func _on_frame(frame):
	$Slider.set_block_signals(true)
	$Slider.value = frame
	$Slider.set_block_signals(false)


func _on_slider(value):
	_player.pause()
	_player.seek(int(value))


func _unhandled_input(event):
	if event.is_action_pressed("ui_select"):
		if _player.playing:
			_player.pause()
		else:
			_player.play()
	elif event.is_action_pressed("ui_right") or event.is_action_pressed("ui_left"):
		_player.pause()
		_player.seek(_player.frame + (1 if event.is_action_pressed("ui_right") else -1))
	elif event is InputEventMouseMotion and event.button_mask & BUTTON_MASK_LEFT:
		_azimuth -= 0.4 * event.relative.x
		_elevation = clamp(_elevation + 0.4 * event.relative.y, -80, 80)
		_place()
	elif event is InputEventMouseButton and event.button_index in [BUTTON_WHEEL_UP, BUTTON_WHEEL_DOWN]:
		_distance = clamp(_distance * (0.95 if event.button_index == BUTTON_WHEEL_UP else 1 / 0.95), 0.4, 3)
		_place()


func _place():
	var turned = Basis(Vector3(deg2rad(-_elevation), deg2rad(_azimuth), 0))
	$Camera.transform = Transform(turned, turned.xform(Vector3(0, 0, _distance)))
