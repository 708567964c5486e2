"""Questions with `why`: the first one about a past, those about what never changed, and the same again; of sessions, in a
debugger, and of the examples as shares of their runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import process_time

from steptwin.controller import SECOND
from steptwin.debug.debugger import Debugger
from steptwin.files.world import World

GOAL_S = 0.1
EXAMPLES = Path(__file__).parents[1] / "examples/worlds"
MOVES = (
    "M1 = ON\nn = 0\nMAIN:\n"
    "    n = n + 1\n    $I4 = n\n    PABS M1 500\n    WAITPOS\n    OUT1 = ON\n    PABS M1 0\n    WAITPOS\n    OUT1 = OFF\n"
    "JUMP MAIN\n"
)
CALCULATES = "n = 0\nMAIN:\n" + "    n = n + 1\n" * 20 + "    $I4 = n\n    OUT1 = ON\n    DELAY 0.1\n    OUT1 = OFF\nJUMP MAIN\n"
ONLY = "n = 0\nMAIN:\n" + "    n = n + 1\n" * 90 + "    $I4 = n\nJUMP MAIN\n"
ACTS = "n = 0\nMAIN:\n" + "    n = n + 1\n" * 90 + "    $I4 = n\n    OUT1 = ON\n    M1 = ON\n    OUT1 = OFF\nJUMP MAIN\n"
WORLD = """
[[mic488]]
name = "m"
program = "m.prg"
start = true

[[button]]
name = "go"
to = "m.IN1"

[[axis]]
name = "x"
drive = "m.M1"
unit = "mm"
pulses_per_unit = 40
"""
FIRST = "m.OUT1"
EDGES = ("m.OUT7", "go", "m.IN1 == 1 or m.OUT7 == 1", "x.position > 9 m")
POINTS = ("m.M_STATUS", "m.M2_ACC", "m.M3.status", "m.USER_REGISTER[400]:real", "m.M3.status == 3 and m.IN1 == 0")


def measure(name: str, ask: Callable[[str], object]) -> None:
    def longest(*questions: str) -> str:
        found: list[tuple[float, str]] = []
        for question in questions:
            begin = process_time()
            ask(question)
            found.append((process_time() - begin, question))
        seconds, question = max(found)
        return f"{seconds:.3f} s ({question})"

    first, edges, points, again = longest(FIRST), longest(*EDGES), longest(*POINTS), longest(FIRST, *EDGES, *POINTS)
    print(f"{name}: first {first}; of what never changed: pins {edges}, points {points}; again {again} (goal {GOAL_S:g} s)")


def session(name: str, program: str) -> None:
    world = World.from_toml(WORLD, {"m.prg": program.encode()})
    world.run(300.0)
    measure(name, world.past.ask)


def debugger(name: str, program: str) -> None:
    text = WORLD.replace("start = true", 'start = true\nstatement_time = "1 us"')
    world = World.from_toml(text, {"m.prg": program.encode()}, keep_trace=False, keep_inputs=False)
    debugger = Debugger(world)
    debugger.run(SECOND)
    measure(name, debugger.why)


def examples() -> None:
    """As ``steptwin run --why``, and as ``steptwin why`` of a recording."""
    for path in sorted(EXAMPLES.glob("*/*.toml")):
        world = World.load(path)
        world.keep_states()
        run = seconds(lambda world=world: world.run(for_=40.0))
        again = World.load(path)
        again.run(for_=40.0)
        name = next(iter(world.controllers))
        shares: list[str] = []
        programs = [owner for owner, one in world.programs.items() if one.texts]
        for question in (*programs[:1], f"{name}.OUT1", f"{name}.IN1"):
            kept, replayed = (seconds(lambda one=one, question=question: one.why(question)) for one in (world, again))
            shares.append(f"{question} {kept:.2f} s, {kept / run:.2f} of the run (of a recording {replayed / run:.2f})")
        print(f"{path.stem}: 40 s took {run:.2f} s; {'; '.join(shares)}")


def seconds(do: Callable[[], object]) -> float:
    begin = process_time()
    do()
    return process_time() - begin


def main() -> None:
    session("300 s, moves", MOVES)
    session("300 s, calculates", CALCULATES)
    debugger("debugger, 1 000 000 statements that calculate", ONLY)
    debugger("debugger, 1 000 000 statements, some of which act", ACTS)
    examples()
