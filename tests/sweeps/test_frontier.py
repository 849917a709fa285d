"""The Pareto frontier."""

from facefolds_core.sweeps.frontier import frontier


def test_frontier_holds_what_nothing_beats() -> None:
    points = [(30.0, 24.0), (10.0, 20.0), (20.0, 19.0), (10.0, 18.0), (60.0, 24.0), (90.0, 25.0)]
    assert frontier(points) == [1, 0, 5]
    assert frontier([(t, -v) for t, v in points], up=False) == [1, 0, 5]
    assert frontier([]) == []


def test_of_equal_points_the_first_stays() -> None:
    assert frontier([(1.0, 2.0), (1.0, 2.0)]) == [0]
