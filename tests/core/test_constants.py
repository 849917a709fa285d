"""Numbers that somebody might tune stand in facefolds_core/params: no other file has them at module level."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ALL = ("*",)

ALLOWED: dict[str, dict[str, tuple[str, ...]]] = {
    "of the start representation, which no stage uses yet: those that are to be chosen become keys with it": {
        "subject/blend_kernel.py": ALL,
        "subject/density.py": ALL,
        "subject/fit.py": ALL,
        "subject/foreign.py": ALL,
        "subject/found.py": ALL,
        "subject/project_kernel.py": ALL,
        "subject/seeds.py": ALL,
        "subject/sweep.py": ALL,
    },
    "of a file format or a standard: another value would be another format": {
        "subject/loss.py": ALL,
        "subject/ply.py": ALL,
        "subject/splats.py": ALL,
        "asset/codecs/": ALL,
        "asset/colour.py": ALL,
        "asset/cropping.py": ("ALPHA_BOUND",),
        "asset/glb.py": ALL,
        "asset/manifest.py": ALL,
        "asset/manifest_file.py": ALL,
        "packaging/rungs.py": ("COARSEST",),
        "packaging/vectors.py": ALL,
        "asset/older.py": ALL,
        "asset/packing.py": ALL,
        "asset/regions.py": ALL,
        "asset/track_file.py": ALL,
        "asset/validation.py": ALL,
        "asset/video.py": ALL,
        "frame_packing.py": ("RUN",),
        "lanes.py": ("LANES",),
        "asset/writer.py": ("STATIC_FPS",),
        "captures/krt.py": ALL,
        "cli/submission.py": ALL,
        "captures/sources/multiface.py": ALL,
        "captures/scene.py": ALL,
        "captures/sources/actorshq.py": ALL,
        "captures/sources/renderme.py": ALL,
        "captures/sources/easymocap.py": ALL,
        "captures/sources/colmap.py": ALL,
        "captures/sources/ava256.py": ALL,
        "captures/sources/nersemble.py": ALL,
        "captures/sources/neural3d.py": ALL,
        "captures/colmap_model.py": ALL,
        "captures/videos.py": ("_DISCARDED",),
        "captures/sources/transforms.py": ("FPS", "PIXEL_CENTRES"),
        "pictures.py": ALL,
        "engines/godot.py": ("FORMAT", "VERSION"),
        "hit_codes.py": ("SCALE",),
        "export/between.py": ("GREY",),
        "geometry/chart.py": ("_TO_ANGLE",),
        "geometry/chart_kernel.py": ("_TO_UV",),
        "geometry/sphere_uv.py": ("FULL_WINDOW",),
        "model/storage.py": ("SCALES_1",),
        "scoring/record.py": ALL,
        "scoring/report.py": ALL,
    },
    "how a trained model is read: stored models must look alike for ever": {
        "model/intersection.py": ("MIN_SLOPE", "REFINEMENTS"),
        "model/radial.py": ("MIN_SLOPE", "STEP", "MARGIN"),
        "model/radial_kernel.py": ("_TO_UV", "SKIP", "CEILING_CELLS"),
    },
    "definition of a metric: another value would be another metric": {
        "packaging/views.py": ("MAX_PSNR",),
        "scoring/detail.py": ALL,
        "scoring/fresh.py": ("BAND_EDGES",),
        "scoring/images.py": ("MASK_EDGE", "MASK_MARGIN"),
        "scoring/matte.py": ALL,
        "scoring/metrics.py": ALL,
        "scoring/perceptual.py": ALL,
        "scoring/analysis.py": ALL,
        "sweeps/recommend.py": ("INDIFFERENT",),
    },
    "compiled in: part of a kernel's machine code and its tests; a kernel with arguments instead was not measured": {
        "export/bake_kernel.py": ("_scatter",),
        "export/hold_kernel.py": ("_scatter",),
        "scatter.py": ALL,
        "export/collapse_kernel.py": ("MOST_NEIGHBOURS",),
        "export/quadrics_kernel.py": ("TERMS",),
        "training/explicit/shading_kernel.py": ("_scatter",),
        "training/explicit/kernels_gpu.py": ("_put", "LAYERS"),
        "training/explicit/state.py": ("UNSEEN_LOGIT",),
        "training/volume/look_kernel.py": ("CLEAR", "OPAQUE"),
        "training/volume/kernel.py": ("PARTS", "BLOCK", "LIMIT"),
    },
    "guard against a division by zero, rounding, or too little to work on": {
        "asset/draco.py": ("DEGENERATE",),
        "captures/sound.py": ("LATE",),
        "export/decimation.py": ("FLAT", "CROSSING_TOLERANCE"),
        "geometry/cameras.py": ALL,
        "export/poisson.py": ("MIN_SAMPLES",),
        "rendering/camera_paths.py": ("STEEPEST",),
        "training/adam.py": ("EPSILON",),
        "training/explicit/reflection.py": ("TILT_STEP",),
        "training/volume/subject.py": ("EMPTY",),
        "rendering/opengl.py": ALL,
        "rendering/raster.py": ALL,
    },
    "limits of a reader or validator: what is beyond is damage, whoever made it": {
        "asset/audio.py": ("LONGER",),
        "captures/agreement.py": ALL,
        "captures/assembly.py": ("BALL",),
        "captures/given_mattes.py": ("SKEW",),
        "captures/arrangement.py": ALL,
        "captures/looking.py": ALL,
        "captures/capture.py": ALL,
        "captures/sound.py": ("RATES",),
        "captures/sources/transforms.py": ("LATEST",),
        "geometry/track.py": ("UNIT",),
        "captures/visibility.py": ALL,
        "parsing.py": ALL,
        "reading.py": ALL,
        "asset/checks.py": ALL,
        "asset/containers.py": ALL,
        "asset/draco.py": ("MOST_CLAIMED",),
        "asset/filmed.py": ("MOST_MEASURED",),
        "asset/parts.py": ("ENCODER_BYTES", "PADDING", "PICTURES_AHEAD"),
        "packaging/levels.py": ("MOST_KEPT",),
        "cli/cameras.py": ("MOST_LISTED",),
        "cli/vectors.py": ("LEAST",),
        "asset/nesting.py": ALL,
    },
    "patience and limits of servers, locks and disks: nothing that the pipeline makes": {
        "cli/mending.py": ALL,
        "errors.py": ALL,
        "locks.py": ALL,
        "processes.py": ALL,
        "cluster/job.py": ("ATTEMPTS",),
        "cluster/jobs.py": ("LOOK",),
        "cluster/run_cache.py": ALL,
        "stages/common.py": ALL,
        "training/patience.py": ALL,
        "training/segments/workers.py": ("GRACE",),
        "served_files.py": ALL,
        "serving.py": ALL,
    },
    "how much is done at a time: memory and speed, never the result": {
        "gpu.py": ("THREADS", "_most"),
        "training/explicit/state_gpu.py": ("SUMS",),
        "training/explicit/reflection_maps.py": ("AT_ONCE",),
        "training/volume/steps_gpu.py": ("SUMS", "AT_ONCE"),
        "model/radial_gpu.py": ("LAYERS",),
        "export/sampling.py": ("DIRECTIONS_AT_ONCE",),
        "captures/developing.py": ALL,
        "captures/picture.py": ("_HEAD",),
        "model/manifolds.py": ("CHUNK",),
        "model/segmented.py": ("KEPT",),
        "spill.py": ALL,
        "model/radiance.py": ("RAYS_AT_ONCE", "TEXELS_AT_ONCE"),
        "rendering/intersection.py": ("MISS", "_PAIRS_AT_ONCE"),
        "scoring/model_view.py": ("CROSSINGS_AT_ONCE",),
    },
    "how something is shown to people: pictures, pages, lines": {
        "cluster/job.py": ("LAST_LINES",),
        "asset/audio.py": ("AAC_BITS_A_SECOND", "AAC_FRAME"),
        "cli/render.py": ALL,
        "engines/godot.py": ("QUALITY",),
        "engines/usd.py": ("QUALITY",),
        "rendering/reference.py": ("BLACK",),
        "captures/appraisal.py": ALL,
        "captures/front.py": ("WELL_BESIDE",),
        "captures/place.py": ALL,
        "training/mattes/sheet.py": ALL,
        "packaging/poster.py": ALL,
        "reporting/build.py": ALL,
        "reporting/charts.py": ALL,
        "reporting/face.py": ALL,
        "reporting/films.py": ALL,
        "reporting/history.py": ALL,
        "reporting/pictures.py": ALL,
        "reporting/tables.py": ALL,
        "reporting/verdicts.py": ALL,
        "reporting/words.py": ALL,
        "scoring/sheets.py": ALL,
        "scoring/fresh.py": ALL,
        "scoring/terminal.py": ALL,
        "training/loop.py": ("LOG_POINTS",),
        "stages/normalize.py": ("SHOWN",),
    },
    "the shape of the embedded actor, its words, its rig and its room: data, written as code": {
        f"captures/actor/{name}.py": ALL
        for name in ("clothes", "hair", "mesh", "motion", "render", "rig", "room", "shape", "speech")
    },
}
"""Reason -> file, or folder with all its files (in facefolds_core, or from the root) -> names."""


def numeric(node: ast.AST) -> bool:
    """Whether an expression holds a number; indices and the arguments of types do not count."""
    if isinstance(node, ast.Subscript):
        return numeric(node.value)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float) and not isinstance(node.value, bool)
    return any(numeric(child) for child in ast.iter_child_nodes(node))


def constants(source: str) -> Iterator[str]:
    """Names at module level whose values hold numbers."""
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            if numeric(statement.value):
                yield from (n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name))


@pytest.fixture(scope="module")
def found(project_root: Path) -> set[tuple[str, str]]:
    """(file, name) of all numeric constants outside of the configuration."""
    library, stages = project_root / "facefolds_core", project_root / "stages"
    files = {path.relative_to(library).as_posix(): path for path in library.rglob("*.py")}
    files |= {path.relative_to(project_root).as_posix(): path for path in stages.rglob("*.py")}
    folders = {name for allowed in ALLOWED.values() for name in allowed if name.endswith("/")}
    return {
        (next((folder for folder in folders if name.startswith(folder)), name), constant)
        for name, path in files.items()
        if not name.startswith("params/")
        for constant in constants(path.read_text(encoding="utf-8"))
    }


def test_no_hyper_parameter_stands_outside_the_configuration(found: set[tuple[str, str]]) -> None:
    allowed = {(file, name) for files in ALLOWED.values() for file, names in files.items() for name in names}
    new = sorted(f"{file}: {name}" for file, name in found if not {(file, name), (file, "*")} & allowed)
    assert not new, "make these keys of a section (facefolds_core/params), or say above why they are no parameters"


def test_the_list_names_nothing_that_is_gone(found: set[tuple[str, str]]) -> None:
    named = [(file, name) for files in ALLOWED.values() for file, names in files.items() for name in names]
    present = found | {(file, "*") for file, _ in found}
    assert [entry for entry in named if entry not in present] == []


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("REACH = 0.45", ["REACH"]),
        ("A, B = 0.3, (1, 2)", ["A", "B"]),
        ("X: float = 1 / 255", ["X"]),
        ("LEVELS = np.array([1.0, 2.0])", ["LEVELS"]),
        ("Count = Annotated[int, Field(ge=1)]", []),
        ("ROOT = Path(__file__).parents[1]", []),
        ("FAST = True", []),
        ("def f(x=3):\n    y = 2", []),
    ],
)
def test_a_constant_is_seen_for_what_it_is(source: str, names: list[str]) -> None:
    assert list(constants(source)) == names


KERNEL_NUMBERS = {
    "arithmetic, and bytes": (0.0, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 255.0),
    "of right angles, so that a cosine is not 0": (0.95,),
    "half a step, to round, and the code 0 for nothing": (1.5,),
    "logit from which an alpha rounds to 0 or 255 of 255": (9.0,),
    "from which softplus(x) is x in float32": (15.0,),
}
"""Reason -> numbers in the functions of kernels, beside guards at the ends of float32 (up to 1e-6, from 1e9 on)."""


def test_numbers_within_kernels_have_a_reason(project_root: Path) -> None:
    known, found = {number for numbers in KERNEL_NUMBERS.values() for number in numbers}, set()
    for path in (project_root / "facefolds_core").rglob("*kernel*.py"):
        functions = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]
        inside = [node for function in functions for node in ast.walk(function) if isinstance(node, ast.Constant)]
        found |= {(node.value, path.name) for node in inside if isinstance(node.value, float)}
    new = {(value, name) for value, name in found if value not in known and 1e-6 < value < 1e9}
    assert not new, "make these keys of a section and arguments of the kernel, or say above why they are no parameters"
    assert known <= {value for value, _ in found}
