"""The goals of worlds: 1000 MIC488, every axis on a point-to-point move each second, ten virtual minutes on one core; and scripts
that wait for a condition cost at most twice as much as scripts that wait for a time.

``CONTROLLERS`` and ``SECONDS`` in the environment make it smaller.
"""

from __future__ import annotations

import os
import time

from steptwin.files.world import World

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


MOVES = """
[[mic488]]
name = "c{n}"
[mic488.M1]
acc = 20000.0
dec = 20000.0
vel = 8000.0

[[script]]
name = "s{n}"
repeat = 10
steps = [
  {{ write = {{ "c{n}.M1_EN" = 1, "c{n}.M1_POS_ABS" = 500 }} }},
  {first}
  {{ write = {{ "c{n}.M1_POS_ABS" = 0 }} }},
  {second}
]
"""
MOVES_S = 20
WAITS = {
    "a time": ('{ wait = "1 s" },',) * 2,
    "a condition": ('{ until = "cN.M1.status == 4" }, { wait = "500 ms" },',) * 2,
}


def waiting(controllers: int, kind: str) -> float:
    """Processor time of `MOVES_S` with scripts that wait for ``kind``."""
    first, second = WAITS[kind]
    parts = [
        MOVES.format(n=n, first=first.replace("cN", f"c{n}"), second=second.replace("cN", f"c{n}")) for n in range(controllers)
    ]
    world = World.from_toml("".join(parts), keep_trace=False)
    begin = time.process_time()
    world.run(for_=MOVES_S)
    return time.process_time() - begin


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
    fixed, watching = (waiting(controllers, kind) for kind in WAITS)
    print(
        f"{controllers} scripts that wait, {MOVES_S} s: for a time {fixed:.2f} s of one core, "
        f"for a condition {watching:.2f} s, {watching / fixed:.2f} times"
    )


if __name__ == "__main__":
    main()
