tool
extends EditorPlugin


func _enter_tree():
	add_custom_type("FacefoldsPlayer", "Spatial", preload("player.gd"), null)


func _exit_tree():
	remove_custom_type("FacefoldsPlayer")
