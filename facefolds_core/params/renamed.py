"""Keys of params.yaml that are no more, and what took their place: the remedy of the message that refuses them."""

from __future__ import annotations

RENAMED: dict[str, str] = {
    "train.level_halfwidth": "train.geometry.halfwidth",
    "train.lr_texture": "train.textures.learning_rate",
    "train.follow.min_share": "train.follow.min_light",
}
"""Old key -> new key of the same section; until 0.1 the names of the model `explicit`."""

OF_THE_TRAINER: dict[str, str] = {
    "params/surfaces.py": "start.centre_tie start.centre_nodes start.window_limit start.column_limit "
    "start.azimuth_limit start.subject_opacity",
    "training/explicit/attempt.py": "divergence",
    "training/explicit/clearing.py": "start.beside_opacity pruning.speck_opacity pruning.speck_reach",
    "training/explicit/fit.py": "start.window_margin geometry.max_halfwidth_pixels geometry.min_radius "
    "textures.radius_quantile",
    "training/explicit/plan.py": "geometry.round_stride geometry.round_rays textures.half_share",
    "training/explicit/rates.py": "textures.final_rate textures.betas textures.layer_rate textures.alpha_rate "
    "textures.frame_rate",
    "training/explicit/reflection.py": "reflection.normal_blur reflection.normals reflection.normal_smoothness "
    "reflection.max_tilt reflection.gloss_smoothness reflection.environment_smoothness reflection.frames "
    "reflection.moving_frames reflection.rays reflection.rounds reflection.first_rounds reflection.min_opacity "
    "reflection.max_residual reflection.folds reflection.asked_smoothness reflection.smoother reflection.sure_gain "
    "reflection.min_gain",
    "training/explicit/state.py": "start.min_opacity start.max_opacity textures.min_light textures.min_alpha",
    "training/explicit/tracked.py": "mesh",
    "training/explicit/trainer.py": "pruning.layer_alpha",
    "training/explicit/views.py": "moving.shares moving.sample moving.sample_frames",
}
"""File of facefolds_core -> keys of `train` whose values stand there now."""

FIXED: dict[str, str] = {
    "capture.seed": "captures/actor/render.py",
    "normalize.motion": "captures/motion.py",
    "normalize.registration": "training/registration.py",
    "train.manifold_layers": "training/loop.py",
    "train.input_scale": "training/loop.py",
    "train.initial_alpha_logit": "training/loop.py",
    "train.latent_dim": "training/loop.py",
    "train.level_frequencies": "training/loop.py",
    "train.view_frequencies": "training/loop.py",
    "train.decay_manifold": "training/loop.py",
    "train.decay_texture": "training/loop.py",
    "train.lambda_view": "training/loop.py",
    "train.segments.texel_bytes": "training/segments/forecast.py",
    "train.segments.floor_megabytes": "training/segments/forecast.py",
    "train.segments.texels_per_pixel": "training/segments/forecast.py",
    "train.segments.process_seconds": "training/segments/forecast.py",
    "train.segments.ray_nanoseconds": "training/segments/forecast.py",
    "train.segments.free_share": "training/segments/forecast.py",
    "train.segments.cameras": "training/segments/keys.py",
    "train.segments.thumbnail": "training/segments/keys.py",
    "train.segments.vertices": "training/segments/keys.py",
    "train.segments.neighbours": "training/segments/keys.py",
    "train.segments.blend": "training/segments/keys.py",
    "sample.least": "export/sampling.py",
    "sample.auto_window": "export/window.py",
    "reconstruct.point_weight": "export/poisson.py",
    "reconstruct.trim": "export/poisson.py",
    "reconstruct.trim_edges": "export/poisson.py",
    "decimate.auto": "export/choosing.py",
    "decimate.collapse": "export/collapse.py",
    "decimate.refit": "export/refit.py",
    "decimate.aggressiveness": "export/decimation.py",
    "texture.auto": "export/choosing.py",
    "bake.hold_window": "export/hold.py",
    "bake.hold_megabytes": "export/hold.py",
    "bake.hold_frames": "export/hold.py",
    "bake.moving_views": "export/steps.py",
    "bake.damping": "export/bake.py",
    "bake.min_light": "export/bake.py",
    "compress.mesh.max_bits": "packaging/meshbits.py",
    "compress.poster_side": "packaging/package.py",
    "compress.jpeg_quality": "packaging/package.py",
    "compress.search": "packaging/rate.py",
    "compress.meter": "packaging/views.py",
    "compress.attention.least": "packaging/attention.py",
    "compress.attention.cameras": "packaging/attention.py",
    "compress.attention.frames": "packaging/attention.py",
    "compress.attention.rays_per_camera": "packaging/attention.py",
    "evaluate.band": "params/evaluate.py",
    "evaluate.film_crf": "params/evaluate.py",
    "evaluate.warnings": "params/evaluate.py",
    **{f"train.{key}": file for file, keys in OF_THE_TRAINER.items() for key in keys.split()},
}
"""Old key, or section of keys -> the file of facefolds_core where its value stands now, next to what uses it."""

CUT_OUT = "the subject is cut out of all training pictures, over changing colours: no background is learnt"
PRICE = f"{CUT_OUT}; the price of opacity is fixed now, in facefolds_core/training/explicit/shading_kernel.py"
FOUND = "the stage `subject` fits Gaussians; its section `subject` has the keys `iterations`, `fewest`, `most`, `seed`"
MATTES = (
    "the stage `subject` finds mattes of all pictures, and its section is called `subject`; `subjects.NAME.mattes` "
    "names corrected ones"
)

NO_CHECKPOINTS = "a base that was cut off is trained again, as a take that is trained at once is"

GONE: dict[str, str] = {
    "matte": MATTES,
    "capture.fps": "she plays as fast as she was filmed; `subjects.NAME.fps` sets another rate",
    "train.mattes": MATTES,
    "train.outlines": MATTES,
    "train.volume": FOUND,
    "train.lr_volume": FOUND,
    "train.moving.volume_frames": FOUND,
    "train.room": f"{FOUND}; Gaussians show the room, too",
    "train.environment": f"{FOUND}; Gaussians show what is far, too",
    "train.subject": f"{FOUND}. `subjects.NAME.centre` and `subjects.NAME.radius` say where the subject is",
    "train.warnings": f"{FOUND}, and tells which pictures contradict the others",
    "train.cameras": f"{FOUND}, and tells what single cameras do differently",
    **{f"train.start.{key}": f"{FOUND}; no fog is left" for key in ("fog_depth", "fog_gain", "fog_holes")},
    "train.background": CUT_OUT,
    "train.gpu": "with `device: cuda` torch keeps what a step needs",
    "train.moving.background_rate": CUT_OUT,
    "train.losses": PRICE,
    "train.lambda_veil": PRICE,
    "train.lambda_solid": PRICE,
    **{
        f"train.pruning.{key}": f"{CUT_OUT}, and no room is painted"
        for key in (
            *("room_gain", "room_frames", "room_texels", "gain_limit"),
            *("beside_layers_gain", "beside_layers_opacity", "beside_gain", "beside_share", "beside_cameras"),
        )
    },
    "train.few_cameras": "few cameras are trained as many are; `textures.pixels_per_texel`, `geometry.max_halfwidth` "
    "and `geometry.blur` can be set",
    "train.segments.checkpoint_seconds": NO_CHECKPOINTS,
    "train.segments.checkpoint_share": NO_CHECKPOINTS,
    "train.segments.rate": "frames are fitted at the base's rate",
    "compress.frame_rate_factor": "an asset has the capture's frames",
    "compress.between": "an asset has the capture's frames",
    "compress.stream.encoders": "segments are encoded one after another, as each encoder uses all cores",
    "compress.stream.megabytes": "segments are encoded one after another",
    "evaluate.fresh_views": "the held-out cameras are scored",
    "compress.glb.draco": "the meshes of asset.glb are plain, which all programs read",
}
"""Old key or section -> why nothing of its name took its place."""


def remedy_for(path: str) -> str | None:
    """What to do about a key, or a section, that is no more: "train.lr_texture"; None if there never was one."""
    if path in RENAMED:
        inner = RENAMED[path].partition(".")[2]
        return f"it is called `{inner}` now: write `{_yaml(inner)}`"
    if path in FIXED:
        return f"remove it: its value is fixed now, in facefolds_core/{FIXED[path]}"
    return f"remove it: {GONE[path]}" if path in GONE else None


def _yaml(path: str) -> str:
    """ "losses.opacity" -> "losses: {opacity: ...}"."""
    *folders, key = path.split(".")
    return "".join(f"{folder}: {{" for folder in folders) + f"{key}: ..." + "}" * len(folders)
