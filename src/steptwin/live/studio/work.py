"""Work of the studio on lines of this computer: the search of ``steptwin scan``, the checks of ``steptwin verify``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime

from steptwin import __version__
from steptwin.errors import Misuse
from steptwin.live.ports import serial_ports, twin_ports
from steptwin.live.scanning import found_at, kinds_named, numbers_of
from steptwin.live.twins import find_device
from steptwin.messages import Message
from steptwin.studio.workrequests import FoundOnLine, Work
from steptwin.verify.run import verify

NOTHING_TO_SEARCH = Message("live.nothing-to-search", "this computer has no serial port, and no twin is running")


class LineWork:
    """See `steptwin.studio.work.Worker`."""

    def plan(self, places: Sequence[str], kind: str, units: str, baud: str | None, timeout: float) -> Callable[[Work], None]:
        kinds = kinds_named(kind, "kind")
        numbers = numbers_of(units, "units", 1, 247)
        bauds = None if baud is None else numbers_of(baud, "baud", 300, 1_000_000)

        def search(work: Work) -> None:
            wanted = list(places) or [port.address for port in serial_ports() + twin_ports()]
            if not wanted:
                raise Misuse(NOTHING_TO_SEARCH())
            for place in wanted:
                rows = found_at(place, kinds, numbers, bauds, timeout, progress=work.search, report=work.problems.append)
                work.found += [FoundOnLine(row.device, row.found.what) for row in rows]

        return search

    def verify(self, work: Work, address: str, *, write: bool) -> dict[str, object]:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        found = verify(
            find_device(address), now, __version__, write=write, progress=work.check, is_cancelled=lambda: work.is_cancelled
        )
        return found.to_json()
