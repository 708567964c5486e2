"""Hooks on statements: which are told, when, and how often."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from mic488_rig import Rig, loaded, programmed

from steptwin.controller import MICROSECOND, MILLISECOND

Told = list[tuple[int, int]]

ROUNDS = "WHILE 1 = 1\nWAIT IN1 = ON\nOUT1 = ON\nWAIT IN1 = OFF\nENDWHILE\n"
"""Steps 0 to 4."""


def hooked(rig: Rig, *numbers: int) -> tuple[Told, Callable[[int, int], None]]:
    """A hook on these statements (none: on all), and what it is told: moment in ms, and number."""
    told: Told = []

    def hook(now: int, number: int) -> None:
        told.append((now // MILLISECOND, number))

    rig.device.program.interpreter.add_hook(hook, numbers or None)
    return told, hook


@pytest.mark.parametrize("statement_time", [MILLISECOND, 0])
def test_every_statement_is_told_once_and_a_wait_that_looks_again_is_not(statement_time: int) -> None:
    rig = programmed("x = 1\nWAIT IN1 = ON\nWAIT TIMA1 > 20\nOUT1 = ON\nWAIT 1 = 2\n", statement_time=statement_time)
    told, _ = hooked(rig)
    rig.start()
    rig.wait(0.1)
    one = statement_time // MILLISECOND
    assert told == [(one, 0), (2 * one, 1)]
    rig.pin("IN1", 1)
    rig.wait(0.05)
    rig.pin("IN1", 0)
    rig.wait(0.05)
    rig.pin("IN1", 1)
    rig.wait(1)
    assert [number for _, number in told] == [0, 1, 2, 3, 4]
    assert rig.out(1)


def test_a_wait_that_comes_again_is_told_again() -> None:
    rig = programmed(ROUNDS)
    told, _ = hooked(rig)
    rig.start()
    for _ in range(2):
        for level in (1, 0):
            rig.wait(0.02)
            rig.pin("IN1", level)
    rig.wait(0.02)
    assert [number for _, number in told] == [0, 1, 2, 3, 4] * 2 + [0, 1]
    open_now = programmed("L:\nWAIT IN1 = ON\nJUMP L\n")
    rounds, _ = hooked(open_now, 0)
    open_now.start()
    open_now.wait(0.0203)
    open_now.pin("IN1", 1)
    open_now.wait(0.0165)  # seen after the filter of 10 ms
    assert [moment for moment, _ in rounds] == [1, 33, 35]
    once = programmed("L:\nWAIT 1 = 1\nJUMP L\n")
    again, _ = hooked(once, 0)
    once.start()
    once.wait(0.0075)
    assert again == [(1, 0), (3, 0), (5, 0), (7, 0)]


def test_a_wait_that_comes_again_without_a_rest_is_told_again() -> None:
    rig = programmed("L:\nWAIT TIMA1 > 1\nJUMP L\n")
    rig.device.program.interpreter.rests = False
    told, _ = hooked(rig)
    rig.start()
    rig.wait(0.05)
    numbers = [number for _, number in told]
    assert numbers == [number % 2 for number in range(len(numbers))]
    assert len(numbers) > 8


def test_only_the_chosen_statements_are_told() -> None:
    rig = programmed("a = 1\nb = 2\nc = 3\nd = 4\nWAIT 1 = 2\n")
    some, _ = hooked(rig, 1, 3)
    last, _ = hooked(rig, 3, 4)
    rig.start()
    rig.wait(0.1)
    assert (some, last) == ([(2, 1), (4, 3)], [(4, 3), (5, 4)])


def test_several_hooks_are_called_in_order_until_each_is_taken_away() -> None:
    rig = programmed("L:\nDELAY 0.01\nJUMP L\n")
    order: list[str] = []

    def first(now: int, number: int) -> None:
        order.append(f"first {number}")

    def second(now: int, number: int) -> None:
        order.append(f"second {number}")

    interpreter = rig.device.program.interpreter
    interpreter.rests_in_loops = False
    interpreter.add_hook(first)
    interpreter.add_hook(second)
    rig.start()
    rig.wait_ns(MILLISECOND + MICROSECOND)
    assert order == ["first 0", "second 0"]
    interpreter.remove_hook(first)
    rig.wait(0.0115)
    assert order[2:] == ["second 1", "second 0"]
    interpreter.remove_hook(second)
    rig.wait(1)
    assert len(order) == 4
    interpreter.add_hook(second)
    rig.wait(0.0115)
    alone = order[4:]
    assert set(alone) == {"second 0", "second 1"}
    interpreter.add_hook(first)
    rig.wait(0.0115)
    assert order[4 + len(alone) :] == ["second 1", "first 1", "second 0", "first 0"]


def test_a_hook_that_comes_while_a_statement_is_in_progress_is_told_of_the_next() -> None:
    rig = programmed("x = 1\nWAIT IN1 = ON\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.1)
    told, _ = hooked(rig)
    rig.pin("IN1", 1)
    rig.wait(0.1)
    assert [number for _, number in told] == [2, 3]


def test_a_hook_stays_when_another_program_is_started() -> None:
    rig = programmed("x = 1\nOUT1 = ON\nWAIT 1 = 2\n")
    told, _ = hooked(rig)
    rig.start()
    rig.wait(0.1)
    program, table = loaded("OUT2 = ON\nOUT3 = ON\nWAIT 1 = 2\nEND\n")
    rig.halt()
    rig.device.load_program(1, program)
    rig.device.load_positions(1, table)
    rig.word("PROG_BANK_SEL", 1)
    rig.start()
    rig.wait(0.1)
    assert [number for _, number in told] == [0, 1, 2, 0, 1, 2]
    assert (rig.out(1), rig.out(2), rig.out(3)) == (False, True, True)
