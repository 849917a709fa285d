"""The stop watch and the moments at which a run is looked at, on a fake clock."""

from bench.clock import Clock, milestones


class Time:
    """A clock that is moved by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_pauses_are_not_counted_nor_seen_while_they_last() -> None:
    time = Time()
    clock = Clock(time)
    time.now += 2
    with clock.paused():
        time.now += 50
        assert clock.seconds == 2
        with clock.paused():
            time.now += 50
        assert clock.seconds == 2
    time.now += 3
    assert clock.seconds == 5


def test_a_clock_goes_on_from_where_it_is_set() -> None:
    time = Time()
    clock = Clock(time)
    clock.set(40.0)
    time.now += 1
    assert clock.seconds == 41


def test_milestones_come_after_the_step_that_passes_them() -> None:
    time = Time()
    clock = Clock(time)
    steps = []

    def step() -> None:
        time.now += 4
        steps.append(clock.seconds)

    seen = []
    for passed in milestones(clock, [30, 5, 7, 10], step):
        seen.append((passed, clock.seconds))
        time.now += 1000  # evaluation
    assert seen == [([5, 7], 8), ([10], 12), ([30], 32)]
    assert steps == [4, 8, 12, 16, 20, 24, 28, 32]
