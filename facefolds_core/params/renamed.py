"""Keys that are no more, and what took their place: the remedy of the message that refuses them."""

from __future__ import annotations

RENAMED: dict[str, str] = {
    "train.level_halfwidth": "train.geometry.halfwidth",
    "train.lr_texture": "train.textures.learning_rate",
}
"""Old key -> new key of the model `explicit`."""

CUT_OUT = "the subject is cut out of all training pictures, over changing colours: no background is learnt"
FOUND = (
    "the stage `subject` finds the subject once, as Gaussians with mattes; its section `subject` has keys of its own"
)
GAUSSIANS = "the training starts from the Gaussians of the stage `subject`, whose section has keys of its own"
MATTES = "the stage `subject` finds mattes, and has no keys for it; your own are named by `subjects.NAME.mattes`"
TURNING = "heads that turn are trained as others are, and memory is looked after by itself"


def fixed(where: str) -> str:
    """Of a key without an heir: what it set is a constant, or is found from the capture, in this part of the code."""
    return f"its value is fixed now, or found by itself (facefolds_core/{where})"


GONE_SECTIONS: dict[str, str] = {
    "compress.between": "an asset has the capture's frames",
    "compress.meter": fixed("packaging/views.py"),
    "compress.search": fixed("packaging/rate.py") + "; `compress.video.target_psnr` is what is searched for",
    "decimate.auto": fixed("export/choosing.py") + "; `resolution: auto` asks for it",
    "decimate.collapse": fixed("export/collapse.py"),
    "decimate.refit": fixed("export/refit.py"),
    "evaluate.warnings": fixed("scoring"),
    "matte": MATTES,
    "normalize.motion": fixed("captures/motion.py") + "; `stabilize` takes true and false, too",
    "normalize.registration": fixed("training/registration.py and alignment.py"),
    "sample.auto_window": fixed("export/window.py") + "; `window: auto` asks for it",
    "texture.auto": fixed("export/choosing.py") + "; `resolution: auto` asks for it",
    "train.background": CUT_OUT,
    "train.cameras": fixed("subject/cameras.py"),
    "train.divergence": fixed("training/explicit/trainer.py"),
    "train.environment": CUT_OUT,
    "train.few_cameras": "few cameras are trained as many are",
    "train.gpu": "the model `explicit` is trained on the CPU",
    "train.losses": CUT_OUT,
    "train.mesh": fixed("training/explicit/tracked.py"),
    "train.moving": TURNING,
    "train.outlines": MATTES,
    "train.pruning": "finished layers are cleared by their opacity alone (facefolds_core/training/explicit/trainer.py)",
    "train.room": FOUND,
    "train.subject": FOUND,
    "train.volume": GAUSSIANS,
    "train.warnings": fixed("training/explicit/loop.py"),
}
"""Old section -> what took its place, for all of its keys."""

GONE_KEYS: dict[str, tuple[str, str]] = {
    "bake": (fixed("export/hold.py"), "damping hold_frames hold_megabytes hold_window min_light moving_views"),
    "compress": (fixed("packaging"), "jpeg_quality poster_side"),
    "compress.attention": (fixed("packaging/attention.py"), "cameras frames least of rays_per_camera"),
    "compress.mesh": (fixed("packaging/settings.py"), "max_bits"),
    "compress.stream": (fixed("packaging"), "encoders megabytes"),
    "decimate": (fixed("export/collapse.py"), "aggressiveness"),
    "evaluate": (fixed("scoring"), "band cvvdp_frames film_crf"),
    "reconstruct": (fixed("export/poisson.py"), "point_weight trim trim_edges"),
    "sample": (fixed("export/sampling.py"), "least opacity"),
    "train": (
        fixed("training/loop.py"),
        "decay_manifold decay_texture input_scale lambda_view latent_dim level_frequencies manifold_layers "
        "view_frequencies initial_alpha_logit",
    ),
    "train.geometry": (
        fixed("training/explicit/plan.py and fit.py"),
        "max_halfwidth_pixels min_radius round_rays round_stride",
    ),
    "train.reflection": (
        fixed("training/explicit/reflection.py"),
        "asked_smoothness environment_smoothness first_rounds folds frames gloss_smoothness max_residual max_tilt "
        "min_gain min_opacity moving_frames normal_blur normal_smoothness normals rays rounds smoother sure_gain",
    ),
    "train.segments": (
        fixed("training/segments"),
        "blend cameras checkpoint_seconds checkpoint_share floor_megabytes free_share named neighbours "
        "process_seconds rate ray_nanoseconds texel_bytes texels_per_pixel thumbnail vertices",
    ),
    "train.start": (
        fixed("training/explicit/fit.py, params/explicit.py; of perceptrons training/start.py"),
        "azimuth_limit beside_opacity centre_nodes centre_tie column_limit fill final_learning_rate fog_depth "
        "fog_gain fog_holes iterations learning_rate margin max_opacity min_opacity points subject_opacity "
        "window_limit window_margin",
    ),
    "train.textures": (
        fixed("training/explicit/rates.py and plan.py"),
        "alpha_rate betas final_rate frame_rate half_share layer_rate min_alpha min_light radius_quantile",
    ),
}
"""Section that there is still -> what became of those of its keys that are gone, and their names."""

GONE: dict[str, str] = {
    **GONE_SECTIONS,
    **{f"{section}.{key}": why for section, (why, keys) in GONE_KEYS.items() for key in keys.split()},
    "capture.fps": "she plays as fast as she was filmed; `subjects.NAME.fps` sets another rate",
    "capture.seed": fixed("captures/actor"),
    "train.lambda_veil": CUT_OUT,
    "train.lambda_solid": CUT_OUT,
    "train.lr_volume": GAUSSIANS,
    "train.textures.full_rate_iterations": "steps beyond it are as large as others; a lower `iterations` takes fewer",
    "train.textures.frame_decay": "what a frame has of its own does not decay",
    "bake.iterations": "textures fitted to the meshes were no better than the model's own",
    "compress.frame_rate_factor": "an asset has the capture's frames",
    "compress.video.lossless": "set `target_psnr`, or a low `crf`",
    "compress.glb.draco": "the meshes of asset.glb are plain, which all programs read",
    "compress.view_effects": "a reflection takes their place (`train.reflection`)",
    "evaluate.fresh_views": "set cameras aside instead: `subjects.NAME.holdout`",
}
"""Old key or section -> why nothing of its name took its place."""


def remedy_for(path: str) -> str | None:
    """What to do about a key that is no more: "train.lr_texture"; None if there was none of this name."""
    if path in RENAMED:
        inner = RENAMED[path].partition(".")[2]
        return f"it is called `{inner}` now: write `{_yaml(inner)}`"
    return f"remove it: {GONE[path]}" if path in GONE else None


def _yaml(path: str) -> str:
    """ "losses.opacity" -> "losses: {opacity: ...}"."""
    *folders, key = path.split(".")
    return "".join(f"{folder}: {{" for folder in folders) + f"{key}: ..." + "}" * len(folders)
