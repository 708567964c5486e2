"""Results that come later: coroutines go on when what they wait for is there."""

from __future__ import annotations

import pytest

from steptwin.later import Later, start


async def doubled(later: Later[int]) -> int:
    return 2 * await later


def test_what_is_there_is_not_waited_for() -> None:
    there: Later[int] = Later()
    there.put(4)
    result = start(doubled(there))
    assert (result.is_done, result.result()) == (True, 8)


def test_a_coroutine_goes_on_with_each_result_and_others_run_meanwhile() -> None:
    first, second = Later[int](), Later[int]()

    async def both() -> int:
        return await first + await second

    sums = [start(both()), start(both())]
    other = start(doubled(second))
    second.put(5)
    assert other.result() == 10
    assert not any(one.is_done for one in sums)
    first.put(1)
    assert [one.result() for one in sums] == [6, 6]


def test_an_error_is_raised_where_it_is_waited_for() -> None:
    later: Later[int] = Later()

    async def guarded() -> str:
        try:
            return str(await later)
        except ValueError as error:
            return f"caught {error}"

    guarding, failing = start(guarded()), start(doubled(later))
    later.fail(ValueError("nothing"))
    assert guarding.result() == "caught nothing"
    with pytest.raises(ValueError, match="nothing"):
        failing.result()


def test_only_the_first_result_counts_and_actions_are_called_once() -> None:
    later: Later[int] = Later()
    called: list[int] = []
    later.then(lambda: called.append(later.result()))
    later.put(1)
    later.put(2)
    later.fail(ValueError())
    later.then(lambda: called.append(-later.result()))
    assert called == [1, -1]
