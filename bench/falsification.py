"""The goal of the guided search: five times fewer runs than random search until a planted race is found, median of seeds.

Two slides pass the same place, each a while after its sensor. They meet there only where the delays differ by 1.5 s: a narrow
diagonal of the square of the delays. ``SEEDS`` in the environment makes it smaller.
"""

from __future__ import annotations

import os
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.search.guided import GuidedSearch, distance

SEEDS = int(os.environ.get("SEEDS", "20"))
FIRST_SEED = 100
"""Those below were used to choose the settings of the search."""
MOST = 5000
SLIDE = """
[[mic488]]
name = "{name}"
[mic488.M1]
unit = "mm"
gear = 800.0
vel = 25.0

[[axis]]
name = "{name}_slide"
drive = "{name}.M1"
pitch = 4.0
travel = [0.0, 110.0]

[[script]]
name = "move_{name}"
steps = [
  {{ until = "{name}.IN1 == 1" }},
  {{ wait = "{delay}" }},
  {{ write = {{ "{name}.M1_EN" = 1, "{name}.M1_POS_ABS" = 100 }} }},
]
"""
WORLD = SLIDE.format(name="left", delay="1 ms") + SLIDE.format(name="right", delay="1500 ms")
CAMPAIGN = '''
[campaign]
world = "slides.toml"
until_failure = true
end = "10 s"
[[vary]]
name = "a"
between = ["0 s", "5 s"]
[[vary]]
name = "b"
between = ["0 s", "5 s"]
[[step]]
at = "a"
do = { set = { "left.IN1" = 1 } }
[[step]]
at = "b"
do = { set = { "right.IN1" = 1 } }
[[property]]
name = "they never meet"
never = """
left_slide.position > 59.8 and left_slide.position < 60 and right_slide.position > 59.8 and right_slide.position < 60"""
'''


def race(folder: Path, seed: int = 0) -> Campaign:
    """The campaign of the planted race, in a folder."""
    (folder / "slides.toml").write_text(WORLD, encoding="utf-8")
    return Campaign.from_toml(CAMPAIGN, folder).changed(seed=seed)


def random_runs(campaign: Campaign) -> int:
    """Runs until one fails."""
    return next((n + 1 for n in range(MOST) if campaign.run_case(n).failed), MOST)


def guided_runs(campaign: Campaign) -> int:
    """Runs until one fails, that one included."""
    search, asked = GuidedSearch(campaign.cases), 0
    while asked < MOST:
        results = [campaign.run_case(case) for case in search.ask()]
        failed = next((n for n, one in enumerate(results) if one.failed), None)
        if failed is not None:
            return asked + failed + 1
        asked += len(results)
        search.tell([distance(one) for one in results])
    return MOST


def main() -> None:
    with TemporaryDirectory() as folder:
        campaigns = [race(Path(folder), seed) for seed in range(FIRST_SEED, FIRST_SEED + SEEDS)]
        random, guided = (median(map(runs, campaigns)) for runs in (random_runs, guided_runs))
    print(f"planted race, median of {SEEDS} seeds: {random:.0f} runs at random, {guided:.0f} guided, {random / guided:.1f} times")


if __name__ == "__main__":
    main()
