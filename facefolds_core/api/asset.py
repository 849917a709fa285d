"""An asset in the hands of a person: it renders, exports and shows itself. Needs nothing of what makes an asset."""

from __future__ import annotations

import base64
import html
from dataclasses import dataclass
from pathlib import Path
from typing import SupportsIndex

from facefolds_core.api.cameras import camera_named, cameras_of_asset
from facefolds_core.api.pictures import Colour, Picture, check_frame, picture
from facefolds_core.asset import reader
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.single_page import write_single_page
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.pixels import render
from facefolds_core.reporting.face import face
from facefolds_core.serving.player import find_player

HEIGHT = 480
"""Of the player in a notebook, pixels."""
NOT_BUILT = "A still: the player has not been built here (<code>make view</code> builds it)."
TOO_LARGE = "A still: the asset is too large for a notebook (<code>facefolds view</code> plays it)."


@dataclass(frozen=True)
class Asset(reader.Asset):
    """An asset: N nested meshes (`layers`, outermost first) and a texture video. In a notebook it plays itself.

    Attributes:
        folder: where it lies.
        manifest: its manifest (docs/reference/asset-format.md).
        levels: of detail, coarsest first; `layers` and `frame(k)` are the finest one's.
        made_in: the subject's folder that it was made in; cameras of the scene there are known by their names.
    """

    made_in: Path | None = None

    def __repr__(self) -> str:
        triangles = sum(len(layer.faces) for layer in self.layers)
        return f"Asset({str(self.folder)!r}: {self.num_layers} layers, {triangles} triangles, {self.num_frames} frames)"

    def render(self, camera: Camera | str, frame: SupportsIndex, background: Colour | None = None) -> Picture:
        """One picture as the format asks for it: means over pixels, with the reflection and where the head stands.

        Args:
            camera: in the asset's world, or the name of one: of the scene that the asset was made of, or "poster".
            frame: 0 to `num_frames` - 1.
            background: RGB, 0 to 1; None leaves it transparent.

        Returns:
            (H, W, 4) uint8, RGBA with straight alpha; with a background (H, W, 3) uint8, RGB.

        Raises:
            UserError: if there is no such camera or frame, or the files are damaged.
        """
        number = check_frame(frame, self.num_frames, "the asset")
        if isinstance(camera, str):
            known = cameras_of_asset(self, self.made_in or self.folder.resolve().parent)
            camera = camera_named(camera, known, "camera", "a Camera: no scene lies beside this asset")
        return picture(*render(self, camera, number), background)

    def save_glb(self, path: str | Path, frame: SupportsIndex = 0) -> None:
        """Write one frame as binary glTF, for programs that know nothing of the asset format.

        Raises:
            UserError: if there is no such frame.
        """
        write_glb(Path(path), self.full, self.manifest.subject, check_frame(frame, self.num_frames, "the asset"))

    def save_html(self, path: str | Path) -> None:
        """Write one HTML file that plays the asset by itself.

        Raises:
            UserError: if the player has not been built.
        """
        write_single_page(Path(path), self.folder, self.manifest, self.manifest.full, find_player())

    def _repr_html_(self) -> str:
        """The player in a frame; without one, the poster."""
        try:
            shown = face(self, find_player())
        except UserError:
            return self._still(NOT_BUILT)
        if shown is None:
            return self._still(TOO_LARGE)
        style = f"width: 100%; height: {HEIGHT}px; border: 0"
        return f'<iframe srcdoc="{html.escape(shown["page"])}" style="{style}" allow="fullscreen"></iframe>'

    def _repr_jpeg_(self) -> bytes | None:
        """The poster: for pages that show no frames."""
        poster = self.manifest.poster
        return None if poster is None else (self.folder / poster.file).read_bytes()

    def _still(self, why: str) -> str:
        poster = self._repr_jpeg_()
        if poster is None:
            return f"<p>{html.escape(repr(self))} {why}</p>"
        data = base64.b64encode(poster).decode()
        return f'<figure><img src="data:image/jpeg;base64,{data}"><figcaption>{why}</figcaption></figure>'


def load_asset(folder: str | Path, made_in: Path | None = None) -> Asset:
    """Read an asset: its manifest and meshes, every file's length and checksum checked; videos are decoded on demand.

    Args:
        made_in: see `Asset`; by default the folder that it lies in.

    Raises:
        UserError: if anything is missing, damaged or of another version; names the file.
    """
    found = reader.read_asset(folder)
    return Asset(**vars(found), made_in=made_in)
