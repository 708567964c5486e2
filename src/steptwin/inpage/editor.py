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


def page_editor(
    page: Page,
    files: Mapping[str, bytes],
    on_internal: Callable[[Exception], object],
    clock: Callable[[], Nanos] = time.monotonic_ns,
) -> Connections:
    """Editor servers for ``files``: texts of a twin by address."""
    editing = Editors(AccessGate(open_to=Role.ENGINEER), lambda: files, clock, _here)
    return Connections(editing.serve, page, on_internal)


async def _here(call: Callable[[], T]) -> T:
    """The worker has nothing else to do."""
    return call()
