"""Functions on several threads."""

from functools import partial
from time import sleep

import pytest

from facefolds_core.system.threads import in_order


def test_answers_come_in_the_order_of_the_questions() -> None:
    def slow(number: int) -> int:
        sleep(0.01 * (3 - number % 3))
        return number

    assert list(in_order(partial(slow, number) for number in range(20))) == list(range(20))


def test_little_is_begun_before_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    asked = []

    def questions():
        for number in range(100):
            asked.append(number)
            yield partial(int, number)

    answers = in_order(questions())
    assert next(answers) == 0
    assert len(asked) == 5
    answers.close()


def test_an_error_comes_to_who_asks() -> None:
    def fails() -> int:
        raise ValueError("the third")

    with pytest.raises(ValueError, match="the third"):
        list(in_order([lambda: 1, lambda: 2, fails]))
