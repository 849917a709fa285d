"""Steps in plain torch, as on a GPU, train what the compiled steps train; here on the CPU, as torch's device."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.model.device import device_of
from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.state import TextureState, state_on
from facefolds_core.training.explicit.state_torch import TorchTextureState
from tests.scenes import make_scene

TINY = {
    "preset": "fast",
    "layers": 3,
    "iterations": 8,
    "geometry": {"rounds": [1.0, 0.5], "round_iterations": 2},
    "reflection": {"enabled": False},
    "textures": {"rays_per_texel": 0.3, "steps_per_frame": 1, "full_rate_iterations": 6},
}


@pytest.mark.slow
def test_a_training_in_torch_gives_the_same_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, models = make_scene(tmp_path / "scene", cameras=5, size=20, mattes=True), []
    params = train_params(TINY)
    assert isinstance(params, ExplicitParams)
    for make in (state_on, lambda device: partial(TorchTextureState, device)):
        monkeypatch.setattr("facefolds_core.training.explicit.trainer.state_on", make)
        trained = fit_explicit(scene, params, tmp_path / "log")
        values = {name: value.detach().numpy() for name, value in trained.model.state_dict().items()}
        models.append({**values, "psnr": np.array(trained.report.final_psnr)})
    compiled, plain = models
    assert np.abs(compiled["textures.layers"][..., :3]).max() > 0.01, "nothing was learnt: nothing is compared"
    assert not np.array_equal(compiled["textures.layers"], plain["textures.layers"]), "both are the compiled one"
    for name, values in compiled.items():
        # Worst seen: 9e-5, of three logits: where gradients are small, a step of Adam is mostly its sign.
        np.testing.assert_allclose(plain[name], values, atol=3e-4, err_msg=name)


def test_which_device_steps_run_on() -> None:
    assert state_on(torch.device("cpu")) is TextureState
    assert state_on(torch.device("cuda")).func is TorchTextureState  # type: ignore[attr-defined]
    assert device_of(train_params({"preset": "fast"})).type == "cpu"
