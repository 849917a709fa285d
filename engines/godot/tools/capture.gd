extends SceneTree
# Renders pictures for tests and documentation, from a job (JSON) named by the environment variable FACEFOLDS_JOB:
# {"folder", "width", "height", "background": [r, g, b],
#  "views": [{"file", "frame", "basis": rows of camera-to-world, "origin", "fov": vertical degrees}]}
# With "play": seconds, it plays first, for so long, and prints the frames that were shown.

const Player = preload("res://addons/facefolds/player.gd")


func _init():
	call_deferred("_run")


func _run():
	var file = File.new()
	if file.open(OS.get_environment("FACEFOLDS_JOB"), File.READ) != OK:
		printerr("FACEFOLDS_JOB names no file")
		quit(2)
		return
	var job = JSON.parse(file.get_as_text()).result
	var viewport = _viewport(job)
	var player = Player.new()
	player.autoplay = false
	var camera = Camera.new()
	camera.near = 0.01
	camera.far = 20
	viewport.add_child(player)
	viewport.add_child(camera)
	camera.current = true
	if not player.load_folder(job.folder):
		printerr("error: " + player.error)
		quit(3)
		return
	if job.has("play"):
		yield(_play(float(job.play), player), "completed")
	for view in job.views:
		player.seek(view.frame)
		yield(_save(viewport, camera, view), "completed")
	print("done ", VisualServer.get_video_adapter_name())
	quit(0)


func _viewport(job):
	var viewport = Viewport.new()
	viewport.size = Vector2(job.width, job.height)
	viewport.own_world = true
	viewport.render_target_update_mode = Viewport.UPDATE_ALWAYS
	viewport.render_target_v_flip = true
	viewport.msaa = Viewport.MSAA_DISABLED
	var environment = Environment.new()
	environment.background_mode = Environment.BG_COLOR
	environment.background_color = Color(job.background[0], job.background[1], job.background[2])
	viewport.world = World.new()
	viewport.world.environment = environment
	root.add_child(viewport)
	return viewport


func _save(viewport, camera, view):
	var b = view.basis
	camera.fov = view.fov
	camera.transform = Transform(
		Vector3(b[0][0], b[1][0], b[2][0]),
		Vector3(b[0][1], b[1][1], b[2][1]),
		Vector3(b[0][2], b[1][2], b[2][2]),
		Vector3(view.origin[0], view.origin[1], view.origin[2])
	)
	for i in 2:
		yield(VisualServer, "frame_post_draw")
	viewport.get_texture().get_data().save_png(view.file)


func _play(seconds, player):
	var changes = []
	player.connect("frame_changed", self, "_note", [changes])
	player.play()
	var end = OS.get_ticks_msec() + 1000 * seconds
	while OS.get_ticks_msec() < end:
		yield(self, "idle_frame")
	player.pause()
	print("frames ", JSON.print(changes))


func _note(frame, changes):
	changes.append(frame)
