"""Goals of the guided search: at most half the runs of a random search until two slides meet, median of seeds, and never more
until other planted mistakes are found.

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
PLANTED = Path(__file__).parents[1] / "tests" / "campaign" / "planted"
LIKELY = 400
"""Most runs until the other mistakes."""
FRICTION = {
    "program.prg": "M1 = ON\nPABS M1 100\nWAITPOS\nPABS M1 0\nWAITPOS\n",
    "world.toml": """
[[mic488]]
name = "cell"
program = "program.prg"
start = true
M1 = { unit = "mm", gear = 640.0, acc = 500.0, dec = 500.0, vel = 50.0 }
[[axis]]
name = "x"
drive = "cell.M1"
pitch = 5.0
motor = { torque = [[0, 1.0], [600, 0.9], [3000, 0.3]], inertia = 5e-5, friction = 0.1, start_speed = 120 }
""",
    "campaign.toml": """
[campaign]
world = "world.toml"
until_failure = true
end = "5 s"
[[vary]]
path = "x.motor.friction"
between = [0.05, 0.95]
[[vary]]
path = "x.motor.inertia"
between = [2e-5, 1e-4]
[[property]]
holds = "no-lost-step-unnoticed"
""",
}
CLAMP = {
    "program.prg": """OUT1 = ON
TIMA1 = 0
WHILE IN1 = OFF
    IF TIMA1 > 50
        OUT8 = ON
        END
    ENDIF
ENDWHILE
OUT2 = ON
""",
    "world.toml": """
[[mic488]]
name = "cell"
program = "program.prg"
start = true
[[cylinder]]
name = "clamp"
extend = "cell.OUT1"
stroke = 40.0
extend_time = "200 ms"
retract_time = "200 ms"
[[wire]]
from = "clamp.extended"
to = "cell.IN1"
""",
    "campaign.toml": """
[campaign]
world = "world.toml"
until_failure = true
end = "2 s"
[[vary]]
path = "clamp.extend_time"
between = ["100 ms", "520 ms"]
[[vary]]
path = "clamp.switching"
between = ["1 ms", "30 ms"]
[[property]]
name = "clamps"
after = "cell.OUT1 within 520 ms cell.OUT2"
""",
}
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


def random_runs(campaign: Campaign, most: int = MOST) -> int:
    """Runs until one fails."""
    return next((n + 1 for n in range(most) if campaign.run_case(n).failed), most)


def guided_runs(campaign: Campaign, most: int = MOST) -> int:
    """Runs until one fails, that one included."""
    search, asked = GuidedSearch(campaign.cases), 0
    while asked < most:
        results = [campaign.run_case(case) for case in search.ask()]
        failed = next((n for n, one in enumerate(results) if one.failed), None)
        if failed is not None:
            return asked + failed + 1
        asked += len(results)
        search.tell([distance(one) for one in results])
    return most


def main() -> None:
    with TemporaryDirectory() as folder:
        campaigns = [race(Path(folder), seed) for seed in range(FIRST_SEED, FIRST_SEED + SEEDS)]
        random, guided = (median(map(runs, campaigns)) for runs in (random_runs, guided_runs))
    print(f"two slides, median of {SEEDS} seeds: {random:.0f} runs at random, {guided:.0f} guided, {random / guided:.1f} times")
    with TemporaryDirectory() as folder:
        for name, files in {"friction": FRICTION, "clamp": CLAMP}.items():
            (Path(folder) / name).mkdir()
            for file, text in files.items():
                (Path(folder) / name / file).write_text(text, encoding="utf-8")
        for place in [*sorted(Path(folder).iterdir()), *sorted(PLANTED.iterdir())]:
            base = Campaign.load(place / "campaign.toml")
            campaigns = [base.changed(seed=seed) for seed in range(FIRST_SEED, FIRST_SEED + SEEDS)]
            random, guided = (median(runs(one, LIKELY) for one in campaigns) for runs in (random_runs, guided_runs))
            print(f"{place.name}: {random:g} runs at random, {guided:g} guided")


if __name__ == "__main__":
    main()
