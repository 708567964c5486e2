"""``[history]``: keeps what happens at a subject in its database, in the event loop of the subject."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from steptwin.access.audit import Entry
from steptwin.controller import SECOND
from steptwin.errors import LineFailure, SteptwinError
from steptwin.eventloop import endless
from steptwin.gateways.contract import GatewayState, GatewaySubject
from steptwin.gateways.points import registers_by_controller
from steptwin.history.database import format_url, read_url
from steptwin.history.options import HistorySpec
from steptwin.history.recorder import Recorder, WallAndSteady
from steptwin.history.rows import RowBatch, RunHead
from steptwin.history.spool import Spool
from steptwin.history.storedvalues import StoredValues
from steptwin.history.writer import HistoryWriter
from steptwin.messages import Message
from steptwin.simulation.describe.servicetables import HISTORY
from steptwin.system import reason

CANNOT_BE_KEPT = Message("history.cannot-be-kept", "{folder}: {why}")


class HistoryKeeper:
    """Keeps the past of ``subject``, whose description is in ``folder``. A `Gateway`."""

    protocol = "history"

    def __init__(self, spec: HistorySpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._subject = subject
        self._notice: Callable[[str], object] = lambda _: None
        self._url = read_url(spec.database, folder)
        self.history = StoredValues(self._url)
        """The values that it has kept."""
        self._folder = folder / (spec.spool or f"{subject.description.name}.spool")
        self._recorder: Recorder | None = None
        self._spool: Spool | None = None
        self._writer: HistoryWriter | None = None
        self._task: asyncio.Task[None] | None = None
        self._has_room = True
        self._head: RunHead | None = None
        """Head of a run that has begun while there was no room."""
        self._failed: str | None = None
        """Why nothing is kept any more."""

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        """It listens nowhere, whatever is permitted."""
        self._notice = notice
        registers = registers_by_controller(f"[{HISTORY}]", self._spec.registers, self._subject.description)
        self._spool = Spool(self._folder)
        loop = asyncio.get_running_loop()

        def from_thread(text: str) -> None:
            loop.call_soon_threadsafe(notice, text)

        self._writer = HistoryWriter(self._url, self._spool, from_thread, keep_days=self._spec.keep_days)
        self._writer.start()
        self._recorder = Recorder(self._subject, registers, clock=CLOCKS, dead_band=self._spec.dead_band)
        head = await self._recorder.begin()
        try:
            self._spool.begin(head)
        except OSError as error:
            raise LineFailure(CANNOT_BE_KEPT(folder=self._folder, why=reason(error))) from error
        self._task = endless(self._keep(self._recorder, self._spool), self._fail)
        return {"url": format_url(self._url)}

    def _fail(self, text: str) -> None:
        self._failed = text
        self._notice(f"history: {text}")

    async def _keep(self, recorder: Recorder, spool: Spool) -> None:
        while True:
            try:
                found = await recorder.look(has_room=spool.has_room())
            except SteptwinError as error:
                self._notice(f"history: {error}")
            else:
                if lost := self._put(spool, found):
                    recorder.lost(lost)
            await asyncio.sleep(self._spec.interval / SECOND)

    def _put(self, spool: Spool, found: Iterable[RunHead | RowBatch]) -> list[RowBatch]:
        """Into the spool; the batches for which there is no room."""
        lost: list[RowBatch] = []
        why = "the database takes nothing, and the spool is full"
        for one in found:
            try:
                if isinstance(one, RunHead):
                    self._head = one
                if self._head is not None:
                    spool.begin(self._head)
                    self._head = None
                if isinstance(one, RunHead):
                    continue
                if not spool.append(one):
                    lost.append(one)
                else:
                    self._has_room = True
            except OSError as error:
                why = reason(error)
                lost += [one] if isinstance(one, RowBatch) else []
        if lost and self._has_room:
            self._notice(f"history: nothing is kept: {why} ({self._folder})")
            self._has_room = False
        return lost

    def log(self, entry: Entry) -> None:
        """Keep a command that the audit log has been told."""
        if self._recorder is not None:
            self._recorder.log(entry)

    @property
    def url(self) -> str:
        """Address of its database, with its password."""
        return self._url.render_as_string(hide_password=False)

    def state(self) -> GatewayState:
        waiting = 0 if self._spool is None else self._spool.waiting
        lost = self._failed or (None if self._writer is None else self._writer.lost)
        text = "writes" if lost is None else lost
        return GatewayState(is_up=lost is None, text=f"{text}; {waiting} bytes wait" if waiting else text)

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait((self._task,))
        if self._recorder is not None and self._spool is not None:
            if self._task is not None:
                if self._failed is None:
                    with contextlib.suppress(SteptwinError):
                        lost = self._put(self._spool, await self._recorder.look(has_room=self._spool.has_room()))
                        self._recorder.lost(lost)
                self._put(self._spool, [self._recorder.end()])
            self._recorder.close()
        if self._writer is not None:
            await asyncio.to_thread(self._writer.close)
        if self._spool is not None:
            if self._spool.waiting:
                self._notice(f"history: {self._spool.waiting} bytes wait for the database in {self._folder}")
            self._spool.close()


CLOCKS = WallAndSteady(lambda: time.time_ns() // 1000, lambda: time.monotonic_ns() // 1000)
