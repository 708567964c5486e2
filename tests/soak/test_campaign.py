"""A campaign of very many runs stays as large as it is."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

from soak import scaled

from steptwin.campaign.campaign import Campaign, CampaignProgress

CAMPAIGN = """
[campaign]
world = "world.toml"
runs = {runs}
end = "1 ms"
[[vary]]
name = "t"
between = ["0 s", "1 ms"]
[[step]]
at = "t"
do = {{ set = {{ "table.IN1" = 1 }} }}
"""
MIB = 1 << 20


def test_the_memory_of_a_campaign_is_level(tmp_path: Path) -> None:
    """Eight bytes remain of a case that is done, while it is known that it is."""
    runs = scaled(100_000)
    (tmp_path / "world.toml").write_text('[[mic488]]\nname = "table"\n')
    campaign = Campaign.from_toml(CAMPAIGN.format(runs=runs), tmp_path)
    sizes: list[int] = []

    def measure(progress: CampaignProgress) -> None:
        if progress.done >= runs // 10 * (len(sizes) + 1) and len(sizes) < 10:
            gc.collect()
            sizes.append(tracemalloc.get_traced_memory()[0])

    tracemalloc.start()
    try:
        summary = campaign.run(tmp_path / "out", progress=measure)
    finally:
        tracemalloc.stop()
    assert (summary.runs, summary.failed) == (runs, 0)
    assert len(sizes) >= 2
    assert sizes[-1] - sizes[0] < 2 * MIB
