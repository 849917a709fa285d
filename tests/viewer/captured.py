"""What the web player shows, as numbers."""

from __future__ import annotations

import base64
import json

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Page

from facefolds_core.geometry.cameras import Camera
from tests.scenes import view_of

CODE = """(camera) => {
    const { data, height, width } = document.querySelector('facefolds-player').capture(camera ?? undefined);
    let text = '';
    for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
    return JSON.stringify([height, width, btoa(text)]); }"""


def captured(page: Page, camera: Camera | None = None) -> NDArray[np.float64]:
    """(H, W, 4) in [0, 1]: from a camera, or as it stands on the page."""
    height, width, data = json.loads(page.evaluate(CODE, camera and view_of(camera)))
    return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4) / 255
