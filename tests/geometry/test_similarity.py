"""Similarity transforms."""

from __future__ import annotations

import json

import numpy as np
import pytest

from facefolds_core.geometry.similarity import Similarity


def similarity(seed: int) -> Similarity:
    rng = np.random.default_rng(seed)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Similarity(float(rng.uniform(1e-3, 9)), rotation * np.linalg.det(rotation), rng.normal(size=3) * 50)


POINTS = np.random.default_rng(0).normal(size=(4, 5, 3)) * 100


def test_identity_moves_nothing_and_the_inverse_undoes() -> None:
    assert np.array_equal(Similarity.identity().apply(POINTS), POINTS)
    assert similarity(1).inverse().apply(similarity(1).apply(POINTS)) == pytest.approx(POINTS)


def test_after_applies_the_argument_first() -> None:
    first, second = similarity(1), similarity(2)
    assert second.after(first).apply(POINTS) == pytest.approx(second.apply(first.apply(POINTS)))


def test_json_round_trip_is_exact() -> None:
    back = Similarity.from_json(json.loads(json.dumps(similarity(3).to_json())))
    assert np.array_equal(back.apply(POINTS), similarity(3).apply(POINTS))
