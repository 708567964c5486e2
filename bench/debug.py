"""The debugger: statements per second with a breakpoint elsewhere, and steps back in a million statements, in both languages."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from unittest.mock import patch

from steptwin.controller import MICROSECOND, Nanos
from steptwin.debug.debugger import Debugger
from steptwin.debug.values import LabelPoint
from steptwin.files.world import World
from steptwin.wbc.interpreter import Interpreter

STATEMENTS = 1_000_000
WBC = "n = 0\nMAIN:\n" + "    n = n + 1\n" * 20 + "JUMP MAIN\nNEVER:\n    OUT2 = ON\nEND\n"
WBC_WORLD = '[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\nstatement_time = "1 us"\n'
CHIP = "[\n@1\n" + "+1\n" * 20 + "J1\n@2\n+2\n.\n]\n"
CHIP_WORLD = (
    '[[line]]\nname = "chips"\nkind = "m1486"\n'
    '[[m1486]]\nname = "c"\nline = "chips"\nprogram = "c.m1486"\nstatement_time = "1 us"\n'
)
ROUNDS = 3
"""Runs with and without a debugger take turns, so that both have the same machine; the best counts."""
STEPS_BACK = 10
BACK_GOAL_S = 0.2
UNUSED_GOAL = 0.9
RATE_GOAL = 3.0
"""Million statements per second, with a breakpoint elsewhere."""


def world(text: str) -> World:
    files = {"m.prg": WBC.encode(), "c.m1486": CHIP.encode()}
    made = World.from_toml(text, files, keep_trace=False, keep_inputs=False)
    for programs in made.programs.values():
        programs.execute_all(True, made.now)
    return made


def seconds(run: Callable[[Nanos], object]) -> float:
    begin = process_time()
    run(STATEMENTS * MICROSECOND)
    return process_time() - begin


def measure(name: str, text: str, label: str) -> None:
    without: list[float] = []
    debugged: list[float] = []
    debugger = Debugger(world(text))
    for _ in range(ROUNDS):
        without.append(seconds(world(text).run_to))
        debugger = Debugger(world(text))
        (point,) = debugger.set_breakpoints([LabelPoint(label=label)])
        assert point.is_set, point.problem
        debugged.append(seconds(debugger.run))
    rate, slower = STATEMENTS / min(without) / 1e6, STATEMENTS / min(debugged) / 1e6
    print(
        f"{name}: {rate:.2f} million statements/s, with a debugger and a breakpoint elsewhere {slower:.2f} (goal {RATE_GOAL:g}),"
        f" {slower / rate:.0%} of that"
    )
    controller = debugger.threads[0]
    longest = 0.0
    for part in range(STEPS_BACK):
        debugger.go(round((part + 0.37) / STEPS_BACK * STATEMENTS) * MICROSECOND)
        begin = process_time()
        debugger.step_back(controller)
        longest = max(longest, process_time() - begin)
    print(f"{name}: a step back in {STATEMENTS} statements: at most {longest:.3f} s (goal {BACK_GOAL_S:g} s)")


def measure_unused() -> None:
    """What it costs that there can be hooks, where there are none."""
    with_them: list[float] = []
    without: list[float] = []
    for _ in range(3 * ROUNDS):
        with_them.append(seconds(world(WBC_WORLD).run_to))
        with patch.object(Interpreter, "_with_hooks", lambda _, code: code):
            without.append(seconds(world(WBC_WORLD).run_to))
    share = min(without) / min(with_them)
    print(f"MIC488, nothing listens: {share:.1%} of the speed without hooks (goal {UNUSED_GOAL:.0%})")


def main() -> None:
    measure_unused()
    measure("MIC488", WBC_WORLD, "NEVER")
    measure("M1486", CHIP_WORLD, "@2")


if __name__ == "__main__":
    main()
