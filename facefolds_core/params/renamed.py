"""Keys that are no more, and what took their place: the remedy of the message that refuses them."""

from __future__ import annotations

RENAMED: dict[str, str] = {
    "train.level_halfwidth": "train.geometry.halfwidth",
    "train.lr_texture": "train.textures.learning_rate",
}
"""Old key -> new key of the model `explicit`."""

FIXED = "its value is fixed now"
CUT_OUT = "the subject is cut out of all training pictures, over changing colours: no background is learnt"

GONE: dict[str, str] = {
    "capture.fps": "she plays as fast as she was filmed; `subjects.NAME.fps` sets another rate",
    "capture.seed": FIXED,
    **{
        f"train.{key}": FIXED
        for key in (
            *("manifold_layers", "latent_dim", "level_frequencies", "view_frequencies"),
            *("decay_manifold", "decay_texture", "lambda_view"),
        )
    },
    "train.lambda_veil": CUT_OUT,
    "train.lambda_solid": CUT_OUT,
    "train.lr_volume": "the stage `subject` fits Gaussians; its section `subject` has keys of its own",
    "reconstruct.point_weight": FIXED,
    "reconstruct.trim": FIXED,
    "bake.iterations": "textures fitted to the meshes were no better than the model's own",
    "compress.frame_rate_factor": "an asset has the capture's frames",
    "compress.video.lossless": "set `target_psnr`, or a low `crf`",
    "compress.glb.draco": "the meshes of asset.glb are plain, which all programs read",
    "compress.view_effects": "a reflection takes their place (`train.reflection`)",
}
"""Old key -> why nothing of its name took its place."""


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
