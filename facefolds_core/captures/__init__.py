"""From any source to the normalised scene.

What a user can mend is a `UserError`, raised where it is found: nearly every function here may raise one, so docstrings
say it of the package's entries only (`read_capture`, `plan_scene`, `write_plan`, `read_scene`).
"""
