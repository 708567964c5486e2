"""Servers of OPC UA that begin quickly."""

from __future__ import annotations

import gc
import pickle
from collections.abc import Iterator
from pathlib import Path

import pytest
from asyncua.server.internal_server import InternalServer


@pytest.fixture(scope="session", autouse=True)
def the_standard_nodes_are_made_once() -> Iterator[None]:
    """The library makes the six thousand of them anew for each server, which takes two seconds; here they are copied."""
    made: list[bytes] = []
    make = InternalServer.load_standard_address_space

    async def load(server: InternalServer, shelf_file: Path | None = None) -> None:
        if not made:
            await make(server, shelf_file)
            made.append(pickle.dumps(server.aspace._nodes))
            return
        gc.disable()  # nearly all of the time would be that of looks for garbage among them
        server.aspace._nodes = pickle.loads(made[0])
        gc.enable()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(InternalServer, "load_standard_address_space", load)
        yield
