"""The editor's worker of a page: the editor server, which computes beside the twin."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TypeVar

from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.controller import Nanos
from steptwin.inpage.connections import Connections, Page
from steptwin.studio.editors import Editors

T = TypeVar("T")


class PageEditor:
    """Editor servers for ``files``: texts of a twin by address."""

    def __init__(
        self, page: Page, files: Mapping[str, bytes | memoryview], clock: Callable[[], Nanos] = time.monotonic_ns
    ) -> None:
        given = {address: bytes(content) for address, content in files.items()}
        editing = Editors(AccessGate(open_to=Role.ENGINEER), lambda: given, clock, _here)
        self.connections = Connections(editing.serve, page)


async def _here(call: Callable[[], T]) -> T:
    """The worker has nothing else to do."""
    return call()
