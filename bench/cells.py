"""The cost of a world by its size: 1, 10, 100 and 1000 machines, each with a program, a waiting script and a conveyor; 60 virtual
seconds. Separate machines share nothing; connected ones are wired in a chain, so that one scheduler runs them all.

``SIZES`` (such as ``1,10``) and ``SECONDS`` in the environment make it smaller.
"""

from __future__ import annotations

import os
import time

from steptwin.files.world import World

CELL = """
[[mic488]]
name = "c{n}"
program = "cell.prg"
start = true
[mic488.M1]
acc = 20000.0
dec = 20000.0
vel = 8000.0

[[conveyor]]
name = "belt{n}"
length = 600.0
speed = {speed}
run = "c{n}.OUT1"
feed_every = "1 s"
[[conveyor.sensor]]
at = 300.0
to = "c{n}.IN1"

[[script]]
name = "s{n}"
repeat = 1000000
steps = [{{ until = "belt{n}.count > 0 and c{n}.IN1" }}, {{ note = "a workpiece" }}, {{ until = "not c{n}.IN1" }}]
"""
WIRE = """
[[wire]]
from = "c{n}.OUT2"
to = "c{next}.IN2"
"""
PROGRAM = b"""M1 = ON
OUT1 = ON
AGAIN:
WAIT IN1 = ON
PABS M1 500
WAITPOS
OUT2 = ON
PABS M1 0
WAITPOS
OUT2 = OFF
WAIT IN1 = OFF
JUMP AGAIN
"""


def cost(controllers: int, seconds: int, *, connected: bool) -> tuple[float, int]:
    """Processor time of a run, s, and the number of records."""
    text = "".join(CELL.format(n=n, speed=200 + n % 100 * 0.37) for n in range(controllers))
    if connected:
        text += "".join(WIRE.format(n=n, next=n + 1) for n in range(controllers - 1))
    world = World.from_toml(text, {"cell.prg": PROGRAM}, keep_trace=False)
    begin = time.process_time()
    world.run(for_=seconds)
    return time.process_time() - begin, len(world.trace)


def main() -> None:
    sizes = [int(size) for size in os.environ.get("SIZES", "1,10,100,1000").split(",")]
    seconds = int(os.environ.get("SECONDS", "60"))
    for connected in (False, True):
        for controllers in sizes:
            spent, records = cost(controllers, seconds, connected=connected)
            print(
                f"{controllers} {'connected' if connected else 'separate'} machines, {seconds} virtual seconds: {spent:.2f} s, "
                f"{records} records, {spent / records * 1e6:.0f} us each"
            )


if __name__ == "__main__":
    main()
