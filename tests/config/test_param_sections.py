"""The sections: strict numbers, bounds, one model's keys only, renamed keys, what DVC sets, the page of all keys."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dvc.utils.hydra import apply_overrides

from docs.tools.params_page import PAGE, page
from facefolds_core.config.params_file import load_params
from facefolds_core.errors import UserError
from facefolds_core.params import (
    PRESETS,
    SECTIONS,
    ExplicitParams,
    MlpParams,
    Section,
    section_of,
    train_params,
)
from facefolds_core.params.renamed import RENAMED, REPLACED, remedy_for

OLD = {old.partition(".")[2] for old in RENAMED}


def leaves(section: Section, path: str = "") -> Iterator[tuple[str, Any]]:
    """ "geometry.nodes" and its value, of all keys."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, Section):
            yield from leaves(value, f"{path}{name}.")
        else:
            yield path + name, value


def sections() -> Iterator[tuple[str, Section]]:
    for stage, kinds in SECTIONS.items():
        for kind in kinds:
            yield stage, kind()


def nested(path: str, value: Any) -> dict[str, Any]:
    """ "textures.learning_rate" and 0.1 -> {"textures": {"learning_rate": 0.1}}."""
    first, _, rest = path.partition(".")
    return {first: nested(rest, value) if rest else value}


def checked(stage: str, section: Section, values: dict[str, Any]) -> Section:
    """`values` as the section of a stage, of the same model as `section`."""
    return section_of(stage, {**({"preset": section.preset} if stage == "train" else {}), **values})  # type: ignore[attr-defined]


NUMBERS = [
    (stage, section, path, value)
    for stage, section in sections()
    for path, value in leaves(section)
    if isinstance(value, int | float) and not isinstance(value, bool)
]


NULLABLE = ("resolution", "mesh.max_error_pixels", "video.target_psnr")
"""Keys whose numbers may be null."""


@pytest.mark.parametrize(("stage", "section", "path", "value"), NUMBERS, ids=lambda v: v if isinstance(v, str) else "")
def test_only_finite_numbers_in_bounds_are_taken_for_numbers(
    stage: str, section: Section, path: str, value: float
) -> None:
    checked(stage, section, nested(path, value))
    absurd: list[object] = [str(value), True, None if path not in NULLABLE else "x", float("nan"), float("inf"), -1e300]
    absurd += [1e300, 10**30, [value], {}]
    for wrong in absurd:
        with pytest.raises(UserError) as caught:
            checked(stage, section, nested(path, wrong))
        assert caught.value.place is not None and caught.value.place.startswith(f"{stage}.{path}")


def test_whole_numbers_and_lists_do_for_floats_and_tuples() -> None:
    made = train_params({"follow": {"min_error": 1}, "geometry": {"rounds": [3, 1]}})
    assert isinstance(made, ExplicitParams)
    assert made.follow.min_error == 1.0 and made.geometry.rounds == (3.0, 1.0)


OF_PERCEPTRONS = sorted(set(MlpParams.model_fields) - set(ExplicitParams.model_fields) - OLD)


@pytest.mark.parametrize(
    ("preset", "model", "other", "key", "named"),
    [
        *(("fast", "explicit", "mlp", key, "geometry") for key in OF_PERCEPTRONS),
        *(("paper", "mlp", "explicit", key, "lr_manifold") for key in ("follow", "geometry", "textures")),
    ],
)
def test_keys_of_the_other_model_are_refused(preset: str, model: str, other: str, key: str, named: str) -> None:
    with pytest.raises(UserError) as caught:
        train_params({"preset": preset, key: 1})
    assert caught.value.place == f"train.{key}"
    assert f"model `{model}`" in str(caught.value.expected) and named in str(caught.value.expected)
    assert f"`{other}`" in str(caught.value.remedy)


@pytest.mark.parametrize(("old", "new"), [(old, new) for old, new in RENAMED.items()])
def test_a_renamed_key_names_the_new_one_which_exists(old: str, new: str) -> None:
    with pytest.raises(UserError) as caught:
        train_params({old.removeprefix("train."): 0.01})
    path = new.removeprefix("train.")
    assert f"`{path}`" in str(caught.value.remedy)
    assert dict(leaves(train_params(nested(path, 0.01))))[path] == 0.01


@pytest.mark.parametrize("path", REPLACED)
def test_a_replaced_key_is_refused_with_what_took_its_place(path: str) -> None:
    stage, _, key = path.partition(".")
    assert REPLACED[path] in str(remedy_for(path))
    if stage in SECTIONS:
        with pytest.raises(UserError) as caught:
            section_of(stage, nested(key, 1))
        assert caught.value.remedy == remedy_for(path)


def test_an_unknown_key_of_a_nested_section_lists_those_there_are() -> None:
    with pytest.raises(UserError) as caught:
        section_of(
            "compress", {"levels": [{"name": "s", "mesh_resolution": 8, "texture_resolution": 8, "crf": 1, "q": 1}]}
        )
    assert caught.value.place == "compress.levels.0.q" and "mesh_resolution" in str(caught.value.expected)


def test_another_model_than_the_presets_is_refused() -> None:
    assert train_params({"preset": "quick", "model": "mlp"}) == train_params({"preset": "quick"})
    with pytest.raises(UserError, match="leave `model` out"):
        train_params({"preset": "quick", "model": "explicit"})


@pytest.mark.parametrize("preset", PRESETS)
def test_a_section_is_read_again_as_it_was_written(preset: str) -> None:
    section = train_params({"preset": preset})
    assert train_params(json.loads(section.model_dump_json())) == section


@pytest.mark.parametrize("preset", ["fast", "paper"])
def test_dvc_can_set_every_key_with_two_plus_signs(tmp_path: Path, project_root: Path, preset: str) -> None:
    file = tmp_path / "params.yaml"
    file.write_text((project_root / "params.yaml").read_text())
    values = {
        f"{place}{stage}.{path}": value
        for place in ("", "subjects.actor.")
        for stage, section in sections()
        for path, value in leaves(section)
        if (stage != "train" or section.preset == preset) and isinstance(value, int | float | str)  # type: ignore[attr-defined]
    }
    values |= {"train.layers": 5, "train.preset": preset}
    apply_overrides(file, [f"++{name}={json.dumps(value)}" for name, value in values.items()])
    train = load_params(file).stage("train", "actor")
    assert isinstance(train, ExplicitParams if preset == "fast" else MlpParams) and train.layers == 12
    apply_overrides(file, ["++subjects.actor.train.layers=7", "++subjects.actor.bake.hold=1e-5"])
    params = load_params(file)
    assert dict(leaves(params.stage("train", "actor")))["layers"] == 7
    assert dict(leaves(params.stage("bake", "actor")))["hold"] == 1e-5


def test_the_page_of_all_keys_is_up_to_date(project_root: Path) -> None:
    assert (project_root / PAGE).read_text(encoding="utf-8") == page(), "run python -m docs.tools.params_page"


def test_every_key_is_described() -> None:
    def undescribed(kind: type[Section], path: str) -> Iterator[str]:
        for name, field in kind.model_fields.items():
            if not field.description:
                yield f"{path}.{name}"
            if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
                yield from undescribed(field.annotation, f"{path}.{name}")

    assert [key for stage, kinds in SECTIONS.items() for kind in kinds for key in undescribed(kind, stage)] == []


def test_there_are_few_keys() -> None:
    """A key needs a user who would turn it; what nobody turns is a constant beside the code that uses it."""
    counts = {section: len(list(leaves(section))) for _, section in sections()}
    assert sum(counts.values()) <= 120
    assert counts[ExplicitParams()] <= 60
