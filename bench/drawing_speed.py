"""How many pictures a second the OpenGL renderer draws of an asset: on this machine's card, or its software driver."""

from __future__ import annotations

import time

import numpy as np

from facefolds_core.asset import read_asset
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering.camera_paths import Eye, camera_of, turntable
from facefolds_core.rendering.opengl import OpenGLRenderer

WIDTH, HEIGHT = 1280, 720
FIELD_OF_VIEW = 35.0
TO_WARM_UP, COUNTED = 2, 9
SWEEP = 30.0
"""Degrees to each side over which the camera moves from picture to picture."""


def pictures_a_second(folders: SubjectFolders) -> tuple[float, str]:
    """Of frame 0 at 1280 x 720 from in front, the median picture; until its pixels are read back.

    Returns:
        pictures a second, and what drew them in the driver's words.

    Raises:
        UserError: if the asset is damaged, or there is no OpenGL here.
    """
    taken = []
    with OpenGLRenderer(read_asset(folders.asset)) as renderer:
        for eye in turntable(Eye(), TO_WARM_UP + COUNTED, SWEEP):
            camera = camera_of(eye, WIDTH, HEIGHT, FIELD_OF_VIEW)
            start = time.perf_counter()
            renderer.render(camera, 0)
            taken.append(time.perf_counter() - start)
        return float(1 / np.median(taken[TO_WARM_UP:])), renderer.device
