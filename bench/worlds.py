"""The goal of worlds: 1000 MIC488, every axis on a point-to-point move each second, ten virtual minutes on one core.

``CONTROLLERS`` and ``SECONDS`` in the environment make it smaller.
"""

from __future__ import annotations

import os
import time

from steptwin.runtime.world import World

CONTROLLER = """
[[mic488]]
name = "c{n}"
[mic488.M1]
acc = 20000.0
dec = 20000.0
vel = 8000.0
[mic488.M2]
acc = 20000.0
dec = 20000.0
vel = 8000.0
[mic488.M3]
acc = 20000.0
dec = 20000.0
vel = 8000.0
[mic488.M4]
acc = 20000.0
dec = 20000.0
vel = 8000.0

[[script]]
name = "s{n}"
at = "{at} ms"
repeat = 1000000
steps = [
  {{ write = {{ "c{n}.M_ENABLE" = 15, {out} }} }},
  {{ wait = "1 s" }},
  {{ write = {{ {back} }} }},
  {{ wait = "1 s" }},
]
"""


def described(n: int) -> str:
    out, back = (", ".join(f'"c{n}.M{axis}_POS_ABS" = {far * axis}' for axis in range(1, 5)) for far in (500, 0))
    return CONTROLLER.format(n=n, at=n % 1000, out=out, back=back)


def main() -> None:
    controllers = int(os.environ.get("CONTROLLERS", "1000"))
    seconds = int(os.environ.get("SECONDS", "600"))
    text = "".join(described(n) for n in range(controllers))
    begin = time.perf_counter()
    world = World.from_toml(text, keep_trace=False)
    built = time.perf_counter()
    cpu = time.process_time()
    world.run(for_=seconds)
    cpu = time.process_time() - cpu
    moves = controllers * 4 * seconds
    print(f"{controllers} controllers described and built in {built - begin:.1f} s")
    print(f"{seconds} virtual seconds, {moves} moves: {cpu:.1f} s of one core, {cpu / moves * 1e6:.1f} us per move")
    print(f"{len(world.trace)} records, digest {world.trace.digest()}")


if __name__ == "__main__":
    main()
