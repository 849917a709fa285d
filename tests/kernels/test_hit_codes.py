"""Texture coordinates in 16 bits: what is written is what is read."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.kernels.hit_codes import SCALE, corner, encode


@pytest.mark.parametrize("size", [2, 7, 512])
def test_a_code_leads_back_to_its_place(size: int) -> None:
    for at in np.linspace(0, 1, 9):
        texel, beyond = corner.py_func(int(encode(np.float64(at))), size)  # type: ignore[attr-defined]
        wanted = min(max(at * size - 0.5, 0), size - 1)
        assert 0 <= texel <= size - 2
        assert texel + beyond == pytest.approx(wanted, abs=0.51 * size / SCALE + 1e-6)


def test_codes_fit_into_16_bits_and_leave_0_for_misses() -> None:
    codes = encode(np.array([-3.0, 0.0, 1.0, 7.0]))
    assert codes.tolist() == [1, 1, 65535, 65535]
