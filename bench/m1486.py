"""How fast the M1486 computes, moves and gives pulses; processor time, best of several rounds."""

from __future__ import annotations

import time
from collections.abc import Callable

from steptwin.controller import SECOND, Nanos
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.lines import DUAL_DAC
from steptwin.m1486.signals import step_pulses, strobes
from steptwin.m1486.variants import variant
from steptwin.motion.divisions import Microstepping, StepTrain, step_train
from steptwin.motion.ramps import SpeedCurve, plan_distance

ROUNDS = 5
MILLION = 1_000_000
#: L, +, I and J without end.
COMPUTE = "[\r:0\r@1\rl255\r+3\ri87h2\re\r@2\rj1\r]\r"
#: One move every 360 ms: 10 000 in an hour.
MOVES = "[\rv4000\ra40000\r@1\rl200\rf12800\rr\re\rj1\r]\r"
HOUR: Nanos = 3600 * SECOND
STEP = 64


def best_s(work: Callable[[], object]) -> float:
    times: list[float] = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def running(program: str, statement_ns: Nanos | None = None) -> M1486Chip:
    chip = M1486Chip(variant("B"), statement_ns=statement_ns)
    chip.receive(program.encode(), 0)
    return chip


def compute() -> None:
    """Without time for a command a thousand are done in each millisecond (`steptwin.m1486.program.BURST`)."""
    for name, statement_ns, each_ns in (("no time for a command", 0, 1000), ("1 us for a command", 1000, 1000)):
        chip = running(COMPUTE, statement_ns)
        seconds = best_s(lambda chip=chip, each_ns=each_ns: chip.advance(chip.now + MILLION * each_ns))
        print(f"{name:<34}{MILLION / seconds / 1e6:>10.2f} M commands/s")


def an_hour() -> None:
    chip = running(MOVES)
    begin = time.process_time()
    chip.advance(HOUR)
    seconds = time.process_time() - begin
    moves = chip.drive.revision
    print(f"{f'one hour, {moves} moves':<34}{seconds:>10.2f} s {HOUR / SECOND / seconds:>12.0f} times life")


def train(knee: float) -> StepTrain:
    """A move that spends its time on ramps up to 40 000 step/s."""
    curve = SpeedCurve(200.0 * STEP, 5000.0 * STEP, knee * STEP, 40_000.0 * STEP)
    return step_train(plan_distance(0, 0, 300_000 * STEP, curve), 0, Microstepping(STEP, STEP, 1e9))


def pulses() -> None:
    for name, knee in (("STEP, linear ramps", 1e6), ("STEP, parabolic ramps", 2500.0)):
        steps = train(knee)
        end = steps.profile.end
        if end is None:
            raise RuntimeError("the move has no end")
        count = len(step_pulses(steps, 0, end))
        seconds = best_s(lambda steps=steps, end=end: step_pulses(steps, 0, end))
        print(f"{name:<34}{count:>10,} {count / seconds / 1e6:>12.0f} M/s")
    chip = M1486Chip(variant("B"), interface=DUAL_DAC)
    chip.receive(b"v3000\rq4\rf640000\rr\r", 0)
    chip.advance(100 * SECOND)
    count = sum(1 for _ in strobes(chip.drive.train, 1, 0, chip.now))
    seconds = best_s(lambda: sum(1 for _ in strobes(chip.drive.train, 1, 0, chip.now)))
    print(f"{'STROBE, dual DAC':<34}{count:>10,} {count / seconds / 1e6:>12.2f} M/s")


def main() -> None:
    compute()
    an_hour()
    pulses()


if __name__ == "__main__":
    main()
