"""The model as its users see it: initialisation, latents, rendering, export queries, files."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.errors import UserError
from facefolds_core.geometry.sphere_uv import points_to_uv
from facefolds_core.model import load_model, save_model
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import ModelSpec, build_model

LEVELS = (0.36, 0.34, 0.32, 0.30)
FEW = {"uv_frequencies": 3, "level_frequencies": 2, "view_frequencies": 1, "search_samples": 48}


def spec(**values: object) -> ModelSpec:
    place = {"centre": SPHERE_CENTRE, "levels": LEVELS, "radius": 0.42, "num_frames": 3}
    manifold, texture = ({f"{part}_layers": 2, f"{part}_width": 16} for part in ("manifold", "texture"))
    return ModelSpec.model_validate({**place, **manifold, **texture, "latent_dim": 4, **FEW, **values})


def make_model(seed: int = 0) -> RadianceManifolds:
    torch.manual_seed(seed)
    return build_model(spec())


def rays(count: int = 50) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    origins = torch.tensor([[1.0, 0.1, 0.05]]).expand(count, 3).contiguous()
    targets = 0.3 * (torch.rand(count, 3, generator=generator) - 0.5)
    return origins, torch.nn.functional.normalize(targets - origins, dim=-1)


@pytest.mark.parametrize("seed", range(5))
def test_initialisation_is_an_exact_sphere(seed: int) -> None:
    model = make_model(seed)
    uv = 1.9 * (torch.rand(200, 2) - 0.5)
    points, valid = model.surface_points(uv)
    assert valid.all()
    radii = (points - model.centre).norm(dim=-1)
    torch.testing.assert_close(radii, torch.tensor(LEVELS)[:, None].expand_as(radii), atol=2e-6, rtol=0)


def test_initial_gradient_has_length_one() -> None:
    model = make_model()
    x = torch.rand(50, 3, requires_grad=True)
    (gradient,) = torch.autograd.grad(model.manifolds.value(x).sum(), x)
    torch.testing.assert_close(gradient.norm(dim=-1), torch.ones(50), atol=1e-5, rtol=0)


def test_slope_matches_autograd() -> None:
    model = make_model()
    torch.nn.init.normal_(model.manifolds.last.weight, std=0.1)
    x, d = torch.rand(50, 3, requires_grad=True), torch.nn.functional.normalize(torch.randn(50, 3), dim=-1)
    value, slope = model.manifolds.value_and_slope(x, d)
    (gradient,) = torch.autograd.grad(value.sum(), x)
    torch.testing.assert_close(slope, (gradient * d).sum(-1), atol=1e-5, rtol=1e-5)
    assert not slope.requires_grad


def test_surface_points_lie_in_the_asked_directions() -> None:
    model = make_model()
    torch.nn.init.normal_(model.manifolds.last.weight, std=0.002)
    uv = 1.8 * (torch.rand(100, 2) - 0.5)
    points, valid = model.surface_points(uv)
    found, _ = points_to_uv(points, model.centre)
    assert valid.all()
    torch.testing.assert_close(found, uv.expand_as(found), atol=1e-5, rtol=0)


def test_latents_interpolate_linearly_and_are_held_beyond_the_ends() -> None:
    textures = make_model().textures
    a, b, c = textures.latents
    times = torch.tensor([-1.0, 0.0, 0.25, 1.0, 1.5, 2.0, 7.0])
    torch.testing.assert_close(textures.latent(times), torch.stack([a, a, 0.75 * a + 0.25 * b, b, 0.5 * (b + c), c, c]))


def test_initial_alpha_lets_all_layers_be_seen() -> None:
    _, alpha = make_model().texture(torch.rand(500, 2) * 2 - 1, 0, 0.0)
    assert float(alpha.mean()) == pytest.approx(1 / (1 + math.exp(1.5)), abs=0.1)


def test_render_composites_the_textures_at_the_crossings() -> None:
    model = make_model()
    origins, directions = rays()
    rendered = model.render(origins, directions, 1.0, view_effects=False)
    crossings = model.crossings(origins, directions)
    rgb, through = torch.zeros(len(origins), 3), torch.ones(len(origins))
    for i in range(model.num_layers):
        uv, _ = points_to_uv(crossings.points[:, i], model.centre)
        colour, alpha = model.texture(uv, i, 1.0)
        alpha = alpha * crossings.hit[:, i]
        rgb, through = rgb + (through * alpha)[:, None] * colour, through * (1 - alpha)
    torch.testing.assert_close(rendered.rgb, rgb, atol=1e-6, rtol=1e-5)
    torch.testing.assert_close(rendered.alpha, 1 - through, atol=1e-6, rtol=1e-5)


def test_view_branch_is_grey_and_can_be_left_out() -> None:
    model = make_model()
    torch.nn.init.normal_(model.textures.view.weight, std=0.05)
    origins, directions = rays()
    with_view = model.render(origins, directions, 0.0, view_effects=True).rgb
    without = model.render(origins, directions, 0.0, view_effects=False).rgb
    change = (with_view - without)[(with_view > 0).all(-1)]
    assert change.abs().max() > 1e-3
    torch.testing.assert_close(change[:, 0], change[:, 1], atol=1e-6, rtol=1e-5)


def test_rays_that_miss_everything_are_black_and_clear() -> None:
    origins = torch.tensor([[1.0, 0, 0]])
    rendered = make_model().render(origins, torch.tensor([[1.0, 0, 0]]), 0.0, view_effects=True)
    assert rendered.rgb.tolist() == [[0, 0, 0]] and rendered.alpha.tolist() == [0]


def test_saved_model_loads_to_the_same_picture(tmp_path: Path) -> None:
    """And loading leaves the random state alone."""
    model = make_model()
    save_model(model, spec(), tmp_path)
    before = torch.get_rng_state()
    loaded = load_model(tmp_path)
    assert torch.equal(torch.get_rng_state(), before)
    assert torch.equal(*(one.render(*rays(), 0.5, True).rgb for one in (model, loaded)))


def test_a_model_keeps_its_scales(tmp_path: Path) -> None:
    other = spec(input_scale=2.5, output_scale=0.5)
    save_model(build_model(other), other, tmp_path)
    manifolds = load_model(tmp_path).manifolds
    assert (manifolds.scale, manifolds.output_scale) == (pytest.approx(2.5 / LEVELS[0]), 0.5)


def test_model_json_of_another_configuration(tmp_path: Path) -> None:
    save_model(make_model(), spec(), tmp_path)
    (tmp_path / "model.json").write_text(spec(texture_width=32).model_dump_json())
    with pytest.raises(UserError, match="different models") as caught:
        load_model(tmp_path)
    assert caught.value.expected != caught.value.found


@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        ("model.safetensors", lambda _: None),
        ("model.safetensors", lambda whole: whole[:100]),
        ("model.json", lambda _: b"{"),
        ("model.json", lambda _: b'{"format": "something else"}'),
    ],
    ids=["missing", "truncated", "garbled json", "unknown key"],
)
def test_damaged_model_folder(tmp_path: Path, name: str, spoil: Callable[[bytes], bytes | None]) -> None:
    save_model(make_model(), spec(), tmp_path)
    left = spoil((tmp_path / name).read_bytes())
    (tmp_path / name).unlink()
    if left is not None:
        (tmp_path / name).write_bytes(left)
    with pytest.raises(UserError) as caught:
        load_model(tmp_path)
    assert caught.value.file == tmp_path / name and caught.value.remedy


def test_numbers_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    model = make_model()
    with torch.no_grad():
        model.textures.base.bias[0] = math.nan
    save_model(model, spec(), tmp_path)
    with pytest.raises(UserError, match="not finite"):
        load_model(tmp_path)
