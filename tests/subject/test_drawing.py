"""The kernels against the reference: pictures and gradients."""

from __future__ import annotations

import numba
import numpy as np
import torch

from facefolds_core.subject.drawing import differentiate, draw, view_of
from facefolds_core.subject.splats import COLUMNS
from tests.scenes import look_at_origin
from tests.subject import reference
from tests.subject.splats import some_splats
from tests.threads import each_of


def test_picture_and_gradients_are_those_of_the_reference() -> None:
    values, camera = some_splats(60), look_at_origin("one", 20, 10, 37)
    values[0, :3] = camera.centre - 0.3 * camera.forward  # behind the camera
    values[1, :3] = camera.centre + 0.3 * camera.forward + 0.25 * camera.rotation[0]  # beside the picture, wide
    values[1, 3:6] = -2.0
    values[2, 10] = 9.0  # cut off at the most opaque
    drawing = draw(values, view_of(camera))
    rgb, light = drawing.picture()
    free = torch.tensor(values.astype(np.float64), requires_grad=True)
    true_rgb, true_light = reference.draw(free, camera)
    np.testing.assert_allclose(rgb, true_rgb.detach().numpy(), atol=2e-3)
    np.testing.assert_allclose(light, true_light.detach().numpy(), atol=2e-3)
    assert np.abs(rgb - true_rgb.detach().numpy()).mean() < 1e-4

    random = np.random.default_rng(1)
    wish = np.zeros_like(drawing.rgb)
    wish_light = np.zeros_like(drawing.light)
    wish[:, :37, :37] = random.normal(0, 1, (3, 37, 37))
    wish_light[:37, :37] = random.normal(0, 1, (37, 37))
    gradient, moved = differentiate(values, drawing, wish, wish_light)
    loss = (true_rgb * torch.tensor(wish[:, :37, :37]).permute(1, 2, 0)).sum()
    loss = loss + (true_light * torch.tensor(wish_light[:37, :37])).sum()
    loss.backward()
    assert free.grad is not None
    true = free.grad.numpy()
    for columns in (slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 11), slice(11, 14), slice(14, 23)):
        error = np.abs(gradient[:, columns] - true[:, columns]).max()
        assert error < 0.02 * np.abs(true[:, columns]).max(), (columns, error)
    assert (gradient[0] == 0).all() and moved[0] == 0 and (moved >= 0).all()


def test_nothing_is_black_and_light() -> None:
    camera = look_at_origin("one", 0, 0, 20)
    for values in (np.zeros((0, COLUMNS), np.float32), some_splats(1) + np.float32(100)):
        rgb, light = draw(values, view_of(camera)).picture()
        assert (rgb == 0).all() and (light == 1).all()


def test_threads_change_nothing() -> None:
    values, view = some_splats(300), view_of(look_at_origin("one", 20, 10, 64))

    def drawn() -> tuple[np.ndarray, ...]:
        drawing = draw(values, view)
        return drawing.rgb, *differentiate(values, drawing, drawing.rgb, drawing.light)

    for one, two in zip(*each_of((1, numba.config.NUMBA_NUM_THREADS), drawn), strict=True):
        np.testing.assert_array_equal(one, two)
