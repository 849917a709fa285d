"""params.yaml: presets, overrides, and every kind of mistake in it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from facefolds_core.config.params_file import load_params, write_configs
from facefolds_core.config.stages import read_stage, read_subject, read_train
from facefolds_core.errors import UserError
from facefolds_core.params import BakeParams, CompressParams, MlpParams, Section, TextureParams

MINIMAL = "subjects:\n  a: {source: actor, path: x}\n"


def params_file(folder: Path, text: str) -> Path:
    path = folder / "params.yaml"
    path.write_text(text)
    return path


def test_the_projects_own_file_is_valid(project_root: Path) -> None:
    params = load_params(project_root / "params.yaml")
    assert params.subject("actor").source == "actor"


def test_a_preset_fills_what_is_not_given(tmp_path: Path) -> None:
    params = load_params(params_file(tmp_path, MINIMAL + "train: {preset: paper, iterations: 7}\n"))
    train = params.stage("train", "a")
    assert isinstance(train, MlpParams)
    assert train.iterations == 7
    assert train.rays == 32768


@pytest.mark.parametrize("number", ["1e-3", "1E-3", "+1e-3", ".1e-2", "10_0e-5", "0.001"])
def test_numbers_are_read_as_dvc_writes_them(tmp_path: Path, number: str) -> None:
    text = MINIMAL + f"bake: {{hold: {number}}}\ncompress: {{levels: []}}\n"
    bake = load_params(params_file(tmp_path, text)).stage("bake", "a")
    assert isinstance(bake, BakeParams) and bake.hold == 0.001


def test_a_subject_overrides_one_nested_key(tmp_path: Path) -> None:
    text = "subjects:\n  a: {source: actor, path: x, compress: {video: {crf: 30}}}\n  b: {source: actor, path: x}\n"
    params = load_params(params_file(tmp_path, text + "compress: {video: {crf: 20, preset: slow}}\n"))
    own, other = params.stage("compress", "a"), params.stage("compress", "b")
    assert isinstance(own, CompressParams) and isinstance(other, CompressParams)
    assert (own.video.crf, own.video.preset) == (30, "slow")
    assert other.video.crf == 20


def test_configs_round_trip(tmp_path: Path) -> None:
    params = load_params(params_file(tmp_path, MINIMAL + "texture: {resolution: 77}\n"))
    write_configs(params, "a", tmp_path)
    assert read_stage(TextureParams, tmp_path) == TextureParams(resolution=77)
    assert read_train(tmp_path) == params.stage("train", "a")
    assert read_subject(tmp_path) == params.subject("a")


def test_a_change_of_one_section_changes_one_file_only(tmp_path: Path) -> None:
    written = []
    for resolution in (64, 128):
        folder = tmp_path / str(resolution)
        params = load_params(params_file(tmp_path, MINIMAL + f"texture: {{resolution: {resolution}}}\n"))
        written.append({path.name: path.read_bytes() for path in write_configs(params, "a", folder)})
    assert [name for name in written[0] if written[0][name] != written[1][name]] == ["texture.json"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("subjects:\n  a: [\n", "line 3"),
        ("train: {}\n", "no subjects"),
        ("", "no subjects"),
        (MINIMAL + "trian: {}\n", "trian"),
        (MINIMAL + "matte: {method: auto}\n", "your own are named by `subjects.NAME.mattes`"),
        ("subjects:\n  a: {source: actor, path: x, matte: {}}\n", "your own are named by `subjects.NAME.mattes`"),
        ("subjects:\n  a: {source: actor, path: x, train: {volume: {reach: 1}}}\n", "starts from the Gaussians"),
        (MINIMAL + "train: {preset: fastest}\n", "there are"),
        (MINIMAL + "train: {preset: [fast]}\n", "there are"),
        (MINIMAL + "train: fast\n", "keys and values"),
        ("subjects:\n  a: {source: actor, path: x, mattes: ~/mine}\n", "subjects.a.mattes"),
        (
            "subjects:\n  a: {source: actor, path: x, train: {preset: paper}}\ntrain: {geometry: {}}\n",
            "to the subjects",
        ),
        (MINIMAL + "texture: {resolution: '64'}\n", "texture.resolution"),
        (MINIMAL + "texture: {resolution: true}\n", "texture.resolution"),
        (MINIMAL + "capture: {fps: 1.0e+300}\n", "capture.fps"),
        *(
            (f"subjects:\n  a: {{source: actor, path: x, fps: {fps}}}\n", "subjects.a.fps")
            for fps in ("1.0e-300", "1.0e+300", "0", "-30", ".nan", ".inf", "'30'", "true")
        ),
        (MINIMAL + "texture: {resolution: 0}\n", "texture.resolution"),
        (MINIMAL + "texture: {resolution: .nan}\n", "texture.resolution"),
        (MINIMAL + "texture: {size: 3}\n", "texture.size"),
        ("subjects:\n  a: {source: video, path: x}\n", "subjects.a.source"),
        ("subjects:\n  a: {source: actor}\n", "subjects.a.path"),
        ("subjects:\n  a: {source: actor, path: x, texture: {resolution: -1}}\n", "for subject a"),
        ("subjects:\n  a: {source: actor, path: x, holdout: {every: 1}}\n", "subjects.a.holdout"),
    ],
)
def test_mistakes_name_the_file_and_the_key(tmp_path: Path, text: str, says: str) -> None:
    path = params_file(tmp_path, text)
    with pytest.raises(UserError) as caught:
        load_params(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)


def test_unknown_subject_lists_those_there_are(tmp_path: Path) -> None:
    params = load_params(params_file(tmp_path, MINIMAL))
    with pytest.raises(UserError, match="expected: a"):
        params.stage("train", "b")


def test_missing_file_is_a_user_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="file not found"):
        load_params(tmp_path / "params.yaml")


def test_a_garbled_stage_config_is_a_user_error(tmp_path: Path) -> None:
    (tmp_path / "texture.json").write_text("{")
    with pytest.raises(UserError, match=r"texture\.json"):
        read_stage(TextureParams, tmp_path)


MADE_ELSEWHERE = {
    "api/capture.py": "what a caller gives `load_capture` becomes an entry of `subjects`",
    "api/work.py": "what a caller gives a step becomes a section, written for the stage as `configure` does",
    "captures/appraisal.py": "`facefolds doctor` tries the entry that it proposes; no stage runs",
    "captures/sources/__init__.py": "the embedded actor's rate follows from how she was filmed",
    "cli/render.py": "a film of an asset, which no section is about",
    "packaging/settings.py": "levels of an asset differ from one another; the manifest says what ran",
    "subject/find.py": "`DEFAULT_SUBJECT`, which says where it is used and why",
}
"""The modules beside params and config that make or change parameters, and why they may."""


def section_names(kind: type[Section] = Section) -> set[str]:
    """Of all classes of sections; `config.params_file` and the trainers' are among them."""
    return {"TrainParams", *(name for one in kind.__subclasses__() for name in {one.__name__, *section_names(one)})}


def makes_parameters(source: str) -> list[str]:
    """Where a module makes a section, copies what may be one, or has a class that is called like one."""
    imports = re.search(r"from facefolds_core\.(params|config)", source)
    others = "".join(rf"(?<!\b{name})" for name in ("level", "manifest", "spec", "view"))  # of models and assets
    made = rf"\b(?:{'|'.join(section_names())}|section_of|train_params)(?:\.model_\w+)?\("
    return re.findall(r"\bclass \w+Params\b" + (rf"|{made}|{others}\.model_copy\(" if imports else ""), source)


@pytest.mark.parametrize(
    "line",
    [
        "p = SubjectParams(seed=1)",
        "p = SubjectParams.model_validate({})",
        "def f(how: SubjectParams): return how.model_copy(\n    update={})",
        "class GlossParams: pass",
    ],
)
def test_a_module_that_makes_parameters_is_noticed(line: str) -> None:
    assert makes_parameters(f"from facefolds_core.params import CompressParams, SubjectParams\n{line}\n")


def test_what_is_configured_is_what_runs(project_root: Path) -> None:
    """Parameters are made and changed in params and config alone, and in the modules that are named with a reason."""
    library = project_root / "facefolds_core"
    modules = {path.relative_to(library).as_posix(): path.read_text("utf-8") for path in library.rglob("*.py")}
    others = {name: text for name, text in modules.items() if not name.startswith(("params/", "config/"))}
    found = {name: calls for name, text in others.items() if (calls := makes_parameters(text))}
    assert found.keys() == MADE_ELSEWHERE.keys(), found
