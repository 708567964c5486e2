"""The goals of campaigns: runs per second where variation begins after 90 % of a run, from a common beginning and each anew; with
one process and with two; memory.

``RUNS`` in the environment makes it smaller.
"""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from steptwin.campaign.campaign import Campaign

EXAMPLES = Path(__file__).parent.parent / "examples" / "worlds"
RUNS = int(os.environ.get("RUNS", "200"))
WORLD = """
[[mic488]]
name = "table"
[mic488.M1]
acc = 20000.0
dec = 20000.0
vel = 8000.0

[[axis]]
name = "x"
drive = "table.M1"
pitch = 4.0

[[axis.switch]]
position = 0.0
width = 0.5
to = "table.IN1"

[[script]]
name = "shuttle"
repeat = 1000000
steps = [
  { write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 500 } },
  { wait = "100 ms" },
  { write = { "table.M1_POS_ABS" = 0 } },
  { wait = "100 ms" },
]
"""
LATE = """
[campaign]
world = "shuttle.toml"
runs = {runs}
end = "60 s"
{start}
[[vary]]
name = "t"
between = ["54 s", "60 s"]
[[fault]]
do = "supply-drop machine=table at_s=0 for_s=0.2"
at = "t"
"""
TRIVIAL = """
[campaign]
world = "press.toml"
runs = {runs}
end = "100 ms"
"""


def rate(campaign: Campaign, jobs: int, clock: Callable[[], float] = time.perf_counter) -> tuple[float, str]:
    """Runs per second without the set-up, and the digest."""
    marks: list[tuple[float, int]] = []
    summary = campaign.run(jobs=jobs, progress=lambda progress: marks.append((clock(), progress.done)))
    (began, first), (ended, last) = marks[0], marks[-1]
    return (last - first) / (ended - began), summary.digest


def late(folder: Path, start: str, runs: int) -> Campaign:
    return Campaign.from_toml(LATE.format(runs=runs, start=start), folder)


def main() -> None:
    with TemporaryDirectory() as folder:
        (Path(folder) / "shuttle.toml").write_text(WORLD)
        anew, _ = rate(late(Path(folder), "", max(RUNS // 4, 10)), 1, time.process_time)
        branched, _ = rate(late(Path(folder), 'start = "54 s"', RUNS), 1, time.process_time)
    print(f"variation after 90 %: {anew:.1f} runs/s anew, {branched:.1f} from there on, {branched / anew:.1f} times")
    trivial = Campaign.from_toml(TRIVIAL.format(runs=RUNS * 20), EXAMPLES / "press")
    single, one = rate(trivial, 1)
    double, other = rate(trivial, 2)
    print(f"{RUNS * 20} short runs: {single:.0f} runs/s, with two processes {double:.0f}, {double / single:.2f} times")
    print(
        f"digests are {'equal' if one == other else 'NOT equal'}; {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10} MiB"
    )


if __name__ == "__main__":
    main()
