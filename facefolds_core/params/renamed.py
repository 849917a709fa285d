"""Old keys that something took the place of: the remedy of the message that refuses them."""

from __future__ import annotations

RENAMED: dict[str, str] = {
    "train.level_halfwidth": "train.geometry.halfwidth",
    "train.lr_texture": "train.textures.learning_rate",
}
"""Old key -> new key of the model `explicit`."""

FOUND = (
    "the stage `subject` finds the subject once, as Gaussians with mattes; its section `subject` has keys of its own"
)
GAUSSIANS = "the training starts from the Gaussians of the stage `subject`, whose section has keys of its own"
MATTES = "the stage `subject` finds mattes, and has no keys for it; your own are named by `subjects.NAME.mattes`"

REPLACED: dict[str, str] = {
    "capture.fps": "she plays as fast as she was filmed; `subjects.NAME.fps` sets another rate",
    "compress.glb": "asset.glb shows frame 0; `load_asset(folder).save_glb(path, frame)` writes another",
    "compress.search": "`compress.video.target_psnr` is what is searched for",
    "compress.video.lossless": "set `target_psnr`, or a low `crf`",
    "compress.view_effects": "a reflection takes their place (`train.reflection`)",
    "decimate.auto": "`resolution: auto` asks for it",
    "evaluate.fresh_views": "set cameras aside instead: `subjects.NAME.holdout`",
    "matte": MATTES,
    "normalize.motion": "`stabilize` takes true and false, too",
    "sample.auto_window": "`window: auto` asks for it",
    "texture.auto": "`resolution: auto` asks for it",
    "train.lr_volume": GAUSSIANS,
    "train.outlines": MATTES,
    "train.room": FOUND,
    "train.subject": FOUND,
    "train.volume": GAUSSIANS,
}
"""Old key or section -> what took its place under another name, and of another kind."""


def remedy_for(path: str) -> str | None:
    """What to do about a key that something took the place of: "train.lr_texture"; None of other keys."""
    if path in RENAMED:
        inner = RENAMED[path].partition(".")[2]
        return f"it is called `{inner}` now: write `{_yaml(inner)}`"
    return f"remove it: {REPLACED[path]}" if path in REPLACED else None


def _yaml(path: str) -> str:
    """ "losses.opacity" -> "losses: {opacity: ...}"."""
    *folders, key = path.split(".")
    return "".join(f"{folder}: {{" for folder in folders) + f"{key}: ..." + "}" * len(folders)
