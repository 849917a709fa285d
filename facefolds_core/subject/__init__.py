"""Who stands where, found once, before anything is trained: the subject's Gaussians, and mattes of all pictures.

- `find.find_subject(scene, params)` finds both; `folder.make_folder` writes what the stage `subject` leaves;
- `fit.fit_pictures` fits Gaussians, `foreign.read_start` takes those of another program, `drawing.render` draws them;
- `mattes.Mattes` is the subject's opacity in each picture: given, beside a plate, or from Gaussians and colours;
- `volume.volume_of` is the subject as a grid, and `outline.profile` where it lies along the rays of a chart.
"""
