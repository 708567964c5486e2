"""Questions with `why`: the first one about a past, and the longest of others; of a world that moves and one that calculates."""

from __future__ import annotations

from time import process_time

from steptwin.files.world import World

GOAL_S = 0.1
"""Of each question once the whole past is noted, which the second one needs: what it asks about never changed."""
MOVES = (
    "M1 = ON\nn = 0\nMAIN:\n"
    "    n = n + 1\n    $I4 = n\n    PABS M1 500\n    WAITPOS\n    OUT1 = ON\n    PABS M1 0\n    WAITPOS\n    OUT1 = OFF\n"
    "JUMP MAIN\n"
)
CALCULATES = "n = 0\nMAIN:\n" + "    n = n + 1\n" * 20 + "    $I4 = n\n    OUT1 = ON\n    DELAY 0.1\n    OUT1 = OFF\nJUMP MAIN\n"
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
QUESTIONS = (
    *("m.OUT1", "m.M_STATUS", "m.M2_ACC", "m.M1_POSLIM_L", "m.M1.status", "m.USER_REGISTER[4]", "m.USER_REGISTER[400]:real"),
    *("m.M1_VMAX == 5", "m.M3.status == 3 and m.IN1 == 0", "m", "m.IN1"),
)
MOVING = "x.position > 9 m"
"""Of a quantity that moves, and never true."""


def measure(name: str, program: str, seconds: float) -> None:
    world = World.from_toml(WORLD, {"m.prg": program.encode()})
    begin = process_time()
    world.run(seconds)
    ran = process_time() - begin
    past = world.past
    found: list[tuple[float, str]] = []
    for question in (*QUESTIONS, MOVING):
        begin = process_time()
        past.ask(question)
        found.append((process_time() - begin, question))
    (first, _), (whole, _), *others, (moving, _) = found
    longest, question = max(others)
    print(
        f"{name}: {seconds:g} s run in {ran:.2f} s; first question {first:.2f} s, of the whole past {whole:.2f} s,"
        f" longest of {len(others)} others {longest:.4f} s, {question!r} (goal {GOAL_S:g} s); {MOVING!r} {moving:.2f} s"
    )


def main() -> None:
    measure("moves", MOVES, 300.0)
    measure("calculates", CALCULATES, 300.0)
