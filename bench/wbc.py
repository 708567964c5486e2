"""Programs of the MIC488: statements per second, an hour of a typical machine, 4000 lines through the checker."""

from __future__ import annotations

from functools import partial
from time import perf_counter

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import load
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions

COMPUTE = """
n = 0
sum = 0
WHILE n < 1000000
    n = n + 1
    square = n * n
    rest = n % 7
    IF rest = 0
        sum = sum + square
    ENDIF
ENDWHILE
$R0 = sum
END
"""
COMPUTE_GOAL = 3_000_000

# A feeder hands parts over, the machine picks them up, moves, places them, and polls its buttons in between.
MACHINE = """
#ready IN1
#halt IN2
#grip OUT1
#done OUT2
M1 = ON
M2 = ON
M3 = ON
MAIN:
    IF halt = ON
        JUMP SHUTDOWN
    ENDIF
    IF ready = ON
        JUMP PICK
    ENDIF
JUMP MAIN
PICK:
    MOVEPTP @pick
    WAITPOS
    grip = ON
    DELAY 0.2
    MOVEPTP @over
    WAIT PosM1 > 50
    MOVELIN @place
    WAITPOS
    grip = OFF
    done = ON
    WAIT ready = OFF
    done = OFF
    parts = parts + 1
    $D0 = parts
RETURN
SHUTDOWN:
    END
"""
ROWS = "pick;0;0;10;x\nover;80;40;0;x\nplace;120;60;100;x\n"
FEEDER = """
MAIN:
    OUT1 = ON
    WAIT IN1 = ON
    OUT1 = OFF
    DELAY 1.5
JUMP MAIN
"""
HOUR_GOAL_S = 1.0

CHECK_LINES = 4000
CHECK_GOAL_S = 0.1

RUNS = 3
"""The best counts."""


def statements_per_second() -> float:
    """Of the compute loop with a statement time of 0."""
    device = Mic488Device(ControllerConfig(), programs={0: load(check(COMPUTE))}, statement_time=0)
    device.command(partial(device.program.command, 1), 0)
    begin = perf_counter()
    now: Nanos = 0
    while device.program.state:
        now += 10 * SECOND
        device.advance(now)
    seconds = perf_counter() - begin
    # Six statements a round (a false IF goes on behind its ENDIF); two more every seventh.
    executed = 1_000_000 * 6 + 1_000_000 // 7 * 2
    return executed / seconds


CONFIG = ControllerConfig(axes=(AxisConfig(gear=100.0, acc=1000.0, dec=1000.0, vel=200.0),) * 4)


def machine_hour() -> tuple[float, int]:
    """Seconds for an hour of a machine, statement time 1 ms, and the parts it made."""
    table, _ = parse_positions(ROWS)
    controller = Mic488Device(CONFIG, programs={0: load(check(MACHINE, table))}, positions={0: table})
    controller.command(partial(controller.program.command, 1), 0)
    begin = perf_counter()
    for part in range(900):
        now = part * 4 * SECOND
        controller.set_pin("IN1", 1.0, now)
        controller.set_pin("IN1", 0.0, now + 3 * SECOND)
    controller.advance(3600 * SECOND)
    return perf_counter() - begin, controller.user[0]


def cell_hour() -> tuple[float, int]:
    """Seconds for an hour of a machine and its feeder, a controller too, on the wires of a world."""
    table, _ = parse_positions(ROWS)
    controller = Mic488Device(CONFIG, programs={0: load(check(MACHINE, table))}, positions={0: table})
    feeder = Mic488Device(CONFIG, programs={0: load(check(FEEDER))})
    scheduler = Scheduler()
    scheduler.add("machine", controller)
    scheduler.add("feeder", feeder)
    scheduler.connect(Wire(PinName("feeder", "OUT1"), PinName("machine", "IN1")))
    scheduler.connect(Wire(PinName("machine", "OUT2"), PinName("feeder", "IN1")))
    for device in (controller, feeder):
        device.command(partial(device.program.command, 1), 0)
    begin = perf_counter()
    scheduler.advance(3600 * SECOND)
    return perf_counter() - begin, controller.user[0]


def polling_hour() -> float:
    """Seconds for an hour of a machine that only looks at its inputs."""
    table, _ = parse_positions(ROWS)
    device = Mic488Device(ControllerConfig(), programs={0: load(check(MACHINE, table))}, positions={0: table})
    device.command(partial(device.program.command, 1), 0)
    begin = perf_counter()
    for minute in range(60):
        device.advance(minute * 60 * SECOND + MILLISECOND)
    return perf_counter() - begin


def checking() -> float:
    """Best of five: seconds for a program of 4000 executable lines."""
    body = "".join(f"x{n % 100} = x{(n + 1) % 100} + {n}\nIF x{n % 100} > 10\nOUT{n % 8 + 1} = ON\nENDIF\n" for n in range(1000))
    text = "".join(f"x{n} = {n}\n" for n in range(100)) + body
    text = "\n".join(text.splitlines()[: CHECK_LINES - 1]) + "\n"
    best = 1e9
    for _ in range(5):
        begin = perf_counter()
        check(text)
        best = min(best, perf_counter() - begin)
    return best


def main() -> None:
    rate = max(statements_per_second() for _ in range(RUNS))
    print(f"compute loop: {rate / 1e6:.2f} million statements/s (goal {COMPUTE_GOAL / 1e6:g})")
    seconds, parts = min(machine_hour() for _ in range(RUNS))
    print(f"an hour of a machine: {seconds:.3f} s, {parts} parts (goal {HOUR_GOAL_S:g} s)")
    seconds, parts = min(cell_hour() for _ in range(RUNS))
    print(f"an hour of a machine and its feeder on wires: {seconds:.3f} s, {parts} parts")
    print(f"an hour of polling two inputs: {polling_hour():.4f} s")
    print(f"{CHECK_LINES} lines checked: {checking():.3f} s (goal {CHECK_GOAL_S:g} s)")


if __name__ == "__main__":
    main()
