"""Stops of M1486 chips at drawn moments, very often: none is overtaken by what was asked for before it."""

from __future__ import annotations

import random

from chip_stops import ASKED, FAMILIES, WAYS, trial
from soak import scaled


def test_no_stop_is_overtaken() -> None:
    """Through the drivers for threads and asyncio, and as commands of a twin, also over a line of 300 bit/s."""
    chance = random.Random(29)
    drawn = [
        (chance.choice(FAMILIES), chance.choice(ASKED), chance.choice(WAYS), chance.choice((0.0, chance.uniform(0.0, 2.0))))
        for _ in range(scaled(2000))
    ]
    overtaken = [fault for one in drawn if (fault := trial(*one)) is not None]
    assert not overtaken, "\n".join(overtaken)
