"""A fresh machine's first run equals every later one, bit for bit, however many threads compute.

Each group of kernels runs on small inputs in two processes: the first compiles them, the second loads them from the
cache and has another number of threads.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from tests.processes import printed

SCRIPTS = {
    "capture": """
        from facefolds_core.captures.actor import make_rig, render, tracked_mesh
        from facefolds_core.params import CaptureParams

        camera = make_rig(CaptureParams(cameras=8, frames=1, height=24, width=16)).cameras[0]
        picture = render(camera, 0.3)
        show(picture.rgb, picture.opacity, picture.depth, tracked_mesh(0.3).vertices)
    """,
    "subject": """
        from facefolds_core.params import SubjectParams
        from facefolds_core.subject.find import find_subject
        from facefolds_core.subject.volume import volume_of
        from tests.scenes import OPAQUE, make_scene

        scene = make_scene(folder / "scene", size=32)
        found, mattes = find_subject(scene, SubjectParams(iterations=40))
        show(found.splats.values, volume_of(found.splats).grid, *[mattes.of((c, 0)).opacity for c in (0, 1)])
    """,
    "train": """
        from facefolds_core.params import ExplicitParams
        from facefolds_core.training.explicit.loop import fit_explicit
        from tests.scenes import OPAQUE, make_scene

        scene = make_scene(folder / "scene", size=32, surface_radius=OPAQUE[0].radius, mattes=True)
        params = ExplicitParams.model_validate({"layers": 4, "iterations": 183})
        fit_explicit(scene, params, folder / "log").save(folder / "model")
        show(np.frombuffer((folder / "model" / "model.safetensors").read_bytes(), np.uint8))
    """,
    "decimate": """
        from facefolds_core.export.collapse import decimated_ladder
        from facefolds_core.export.sampling import sample_grids
        from facefolds_core.export.sheets import grid_sheets
        from tests.ellipsoids import Ellipsoids

        grids = sample_grids(Ellipsoids(), 32, (-0.5, 0.6, -0.3, 0.4))
        for mesh in decimated_ladder(grid_sheets(grids, None), [64])[64]:
            show(mesh.vertices, mesh.faces, mesh.st)
    """,
    "bake": """
        from facefolds_core.export.hold_kernel import add_weights, hold

        rng = np.random.default_rng(0)
        codes = rng.integers(1, 65536, (70_000, 3, 2)).astype(np.uint16)
        codes[rng.random((70_000, 3)) < 0.2] = 0
        texture = rng.random((3, 32, 32, 4), np.float32)
        weights = np.zeros((3, 32, 32, 2), np.float32)
        add_weights(codes, texture * 255, weights, 0.001)
        images = rng.integers(90, 110, (6, 32, 32, 4)).astype(np.uint8)
        hold(images, weights[0], 0.5)
        show(weights, images)
    """,
}
"""By stage; `show` adds arrays to the digest, `folder` is empty."""

FRAME = """
import hashlib, sys
from pathlib import Path
import numpy as np

folder, digest = Path(sys.argv[1]), hashlib.sha256()


def show(*arrays):
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())

{body}
print(digest.hexdigest())
"""


@pytest.mark.parametrize(
    "stage",
    ["bake", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("capture", "subject", "train", "decimate"))],
)
def test_the_first_run_equals_later_ones(stage: str, tmp_path: Path) -> None:
    code = FRAME.format(body=textwrap.dedent(SCRIPTS[stage]))
    found = []
    for run, threads in (("cold", 2), ("warm", 1)):
        (tmp_path / run).mkdir()
        settings = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        settings |= dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"), str(threads))
        found.append(printed(code, str(tmp_path / run), folder=tmp_path, **settings).splitlines()[-1])
    assert found[0] == found[1]
    assert list((tmp_path / "cache").rglob("*.nbc"))
