"""What is the subject, found once: Gaussians that explain the pictures of one frame, the room included.

- `fit.fit_start(scene, frame)` fits them, `foreign.read_start(path, scene)` takes those of another program;
- `drawing.render(splats, camera)` is their picture;
- `mattes.find_subject(scene, splats)` says which are the subject, `found.subject_of` before the pictures have voted;
- `mattes.find_mattes(scene, splats)` is the subject's opacity in each training picture;
- `found.background(splats, subject, camera)` is what stands behind it.

No stage uses it yet.
"""
