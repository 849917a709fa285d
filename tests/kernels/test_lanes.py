"""Eight numbers at once do what they do one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.kernels import jit, lanes
from facefolds_core.kernels.jit import fingerprint, kernel
from facefolds_core.kernels.lanes import fill, highest, least, load, most, store, total, where_less


@kernel
def _all(a, b, out):  # type: ignore[no-untyped-def]
    for at in range(0, a.shape[0], 8):
        x, y = load(a, at), load(b, at)
        store(out[0], at, x + y * np.float32(2) - np.float32(1) / y)
        store(out[1], at, least(x, y))
        store(out[2], at, most(x, y))
        store(out[3], at, where_less(x, y, fill(np.float32(3)), x / y))
        out[4, at], out[5, at] = total(x), highest(x)


def test_arithmetic() -> None:
    a, b = np.random.default_rng(0).uniform(0.5, 2, (2, 24)).astype(np.float32)
    out = np.zeros((6, 24), np.float32)
    _all(a, b, out)
    np.testing.assert_array_equal(out[0], a + b * np.float32(2) - np.float32(1) / b)
    np.testing.assert_array_equal(out[1], np.minimum(a, b))
    np.testing.assert_array_equal(out[2], np.maximum(a, b))
    np.testing.assert_array_equal(out[3], np.where(a < b, np.float32(3), a / b))
    rows = a.reshape(3, 8)
    halves = rows[:, :4] + rows[:, 4:]
    quarters = halves[:, :2] + halves[:, 2:]
    np.testing.assert_array_equal(out[4, ::8], quarters[:, 0] + quarters[:, 1])
    np.testing.assert_array_equal(out[5, ::8], rows.max(1))


def test_a_kernel_on_disk_is_of_these_lanes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    before = fingerprint(_all)
    changed = tmp_path / "lanes.py"
    changed.write_text(Path(lanes.__file__).read_text() + "\nMORE = 1\n")
    monkeypatch.setattr(lanes, "__file__", str(changed))
    jit._text.cache_clear()
    assert fingerprint(_all) != before
    jit._text.cache_clear()
