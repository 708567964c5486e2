"""The opening of gateways."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Generator
from pathlib import Path
from typing import Any, cast

import pytest

from steptwin.errors import Misuse
from steptwin.live.gateways import open_gateways
from steptwin.services import Services


@pytest.mark.parametrize("fails", [False, True])
def test_the_garbage_collector_rests_while_gateways_are_opened(fails: bool) -> None:
    resting: list[bool] = []

    def specs() -> Generator[Any]:
        resting.append(not gc.isenabled())
        if fails:
            raise Misuse("not this one")
        yield from ()

    nothing = cast("Any", None)
    services = Services(cast("Any", specs()), None)
    opening = open_gateways(nothing, services, Path(), nothing, None, listen_any=False)
    assert gc.isenabled()
    if fails:
        with pytest.raises(Misuse, match="not this one"):
            asyncio.run(opening)
    else:
        assert asyncio.run(opening) == []
    assert resting == [True]
    assert gc.isenabled()
