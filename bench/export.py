"""How fast traces become files; one processor, best of several rounds."""

from __future__ import annotations

import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from steptwin.controller import SECOND, Nanos
from steptwin.files.export import AxisChannel, write_trace
from steptwin.motion import MotionState, plan_position
from steptwin.simulation.mechanics.channels import PhaseOutputs
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

HOUR: Nanos = 3600 * SECOND
AXES = 4
ROUNDS = 3
TRAVEL_P = 50_000


def run_of(duration: Nanos, speed: float) -> Trace:
    """Four axes that go to and fro, an output for each, and a request and its answer every 0.1 s."""
    trace = Trace(["table"])
    chance = random.Random(1)
    records = [
        TraceRecord(n, "table", "frame", f"tcp-1/{end}", bytes(12))
        for n in range(0, duration, SECOND // 10)
        for end in ("in", "out")
    ]
    for axis in range(1, AXES + 1):
        now: Nanos = 0
        at = 0
        while now < duration:
            target = chance.randrange(TRAVEL_P)
            plan = plan_position(MotionState(now, at, 0.0, 0.0), target, 4 * speed, 4 * speed, speed)
            records += [TraceRecord(now, "table", "edge", f"OUT{axis}", 1.0), TraceRecord(now, "table", "plan", str(axis), plan)]
            at, now = target, plan.end or now
            records.append(TraceRecord(now, "table", "edge", f"OUT{axis}", 0.0))
            now += SECOND // 4
    for record in sorted(records, key=lambda record: record.time):
        trace.add(record)
    return trace


def best_s(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    times: list[float] = []
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def changes_in(path: Path) -> int:
    """Lines of a value change dump that are changes."""
    with path.open("rb") as file:
        body = file.read().partition(b"$enddefinitions $end\n")[2]
    return sum(1 for line in body.split(b"\n") if line and line[:1] not in b"#$")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        minute = run_of(60 * SECOND, 32_000.0)
        steps = {("table", str(axis)): AxisChannel(f"M{axis}") for axis in range(1, AXES + 1)}
        phases = {key: view._replace(outputs=PhaseOutputs()) for key, view in steps.items()}
        print(f"{'value change dump':<34}{'changes':>12}")
        for title, views in (("STEP and DIR, four axes, a minute", steps), ("phase currents of the same", phases)):
            path = folder / "run.vcd"
            seconds = best_s(lambda views=views: write_trace(minute, folder / "run.vcd", views=views))
            count = changes_in(path)
            print(f"{title:<34}{count:>12,} {count / seconds / 1e6:>8.2f} M/s {path.stat().st_size / 1e6:>8.0f} MB")
        hour = run_of(HOUR, 16_000.0)
        print(f"an hour of four axes, {len(hour):,} records")
        for form in ("png", "svg", "html", "jsonl"):
            path = folder / f"run.{form}"
            seconds = best_s(lambda path=path: write_trace(hour, path, views=steps), 2)
            print(f"{form:<34}{seconds:>10.2f} s {path.stat().st_size / 1e6:>8.1f} MB")
        for form in ("csv", "parquet"):
            path = folder / f"run.{form}"
            seconds = best_s(lambda path=path: write_trace(hour, path, views=steps, period=SECOND // 100), 1)
            print(f"{form + ', every 10 ms':<34}{seconds:>10.2f} s {path.stat().st_size / 1e6:>8.1f} MB")


if __name__ == "__main__":
    main()
