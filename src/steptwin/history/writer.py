"""The thread that brings batches from the spool into the database, and does the chores between them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

from sqlalchemy import Engine
from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError, IntegrityError, InterfaceError, OperationalError

from steptwin.errors import LineFailure, Misuse, SteptwinError
from steptwin.history.chores import DAY_US, begin_anew, remove_old, summarise
from steptwin.history.database import engine_of, failure, format_url, upgrade
from steptwin.history.spool import Spool, Taken
from steptwin.history.writing import TableWriter
from steptwin.system import reason

PAUSE_S = (0.5, 5.0)
"""After the first failure, doubled after each further one, up to the second."""
CHORES_S = 60.0
REMOVAL_S = 3600.0
END_S = 5.0
"""For what is left when it is closed; the rest stays in the spool."""
MOST_TRIES = 5
"""Most tries for rows that collide with those of another writer."""


class HistoryWriter:
    """``notice`` is called, in the thread, with texts for the user."""

    def __init__(self, url: URL, spool: Spool, notice: Callable[[str], object], *, keep_days: int | None = None) -> None:
        self._url = url
        self._spool = spool
        self._notice = notice
        self._keep_days = keep_days
        self._engine: Engine = engine_of(url)
        self._is_ready = False
        self.lost: str | None = None
        """Why the database takes nothing; None while it does."""
        self._writer = TableWriter()
        self._ending = threading.Event()
        self._removal: Iterator[None] | None = None
        self._next_chores = self._next_removal = self._began = time.monotonic()
        self._began_us = time.time_ns() // 1000
        self._thread = threading.Thread(target=self._work, name="history", daemon=True)

    def prepare(self) -> None:
        """Make the tables. Raises `Misuse` for a database of a later version, `LineFailure` where it does not answer."""
        try:
            with self._engine.begin() as connection:
                upgrade(connection, self._url)
        except DBAPIError as error:
            raise failure(self._url, error) from None
        self._is_ready = True

    def start(self) -> None:
        """Where the database does not answer yet, what comes waits in the spool. Raises `Misuse` as `prepare`."""
        try:
            self.prepare()
        except LineFailure as error:
            self._away(error)
        except Misuse:
            self._engine.dispose()
            raise
        self._thread.start()

    def close(self) -> None:
        """Write what is there, if the database takes it now."""
        self._ending.set()
        self._spool.more.set()
        if self._thread.ident is not None:
            self._thread.join(2 * END_S)
        self._engine.dispose()

    # ------------------------------------------------------------------ the thread

    def _work(self) -> None:
        pause, deadline = 0.0, None
        while True:
            if pause:
                self._ending.wait(pause)
            if self._ending.is_set():
                deadline = deadline or time.monotonic() + END_S
                if time.monotonic() > deadline or (pause and self.lost is not None):
                    return
            try:
                if not self._write_next():
                    if self._ending.is_set():
                        return
                    self._do_chores()
                    self._spool.more.wait(1.0)
            except LineFailure as error:
                self._away(error)
            except SteptwinError as error:
                self.lost = f"the history ends: {error}"
                self._notice(self.lost)
                return
            except OSError as error:
                self._away(LineFailure(f"the spool of the history: {reason(error)}"))
            else:
                if self.lost is not None and self._is_ready:
                    self.lost = None
                    self._notice(f"history: {format_url(self._url)} answers again")
                pause = 0.0
                continue
            pause = min(max(2 * pause, PAUSE_S[0]), PAUSE_S[1])

    def _away(self, error: LineFailure) -> None:
        if self.lost is None:
            self.lost = str(error)
            self._notice(f"history: {error}; rows are buffered on this disk")

    def _write_next(self) -> bool:
        taken = self._spool.take()
        if taken is None:
            return False
        if not self._is_ready:
            self.prepare()
        if taken.head is None:
            self._refuse(taken, "the head of the run is lost")
            return True
        for left in reversed(range(MOST_TRIES)):
            try:
                with self._engine.begin() as connection:
                    first = self._writer.write(connection, taken.head, taken.batches)
                    if first is not None:
                        begin_anew(connection, first)
            except DBAPIError as error:
                self._writer.forget()
                if error.connection_invalidated or isinstance(error, OperationalError | InterfaceError):
                    raise failure(self._url, error) from None
                if isinstance(error, IntegrityError) and left:
                    continue  # another process has added the same point or text
                self._refuse(taken, str(failure(self._url, error)))
                return True
            except BaseException:
                self._writer.forget()
                raise
            break
        self._spool.done(taken)
        return True

    def _refuse(self, taken: Taken, why: str) -> None:
        where = self._spool.refuse(taken.lines)
        self._spool.done(taken)
        self._notice(f"history: {len(taken.lines)} batches cannot be written ({why}); they are in {where}")

    def _do_chores(self) -> None:
        now = time.monotonic()
        if not self._is_ready or now < self._next_chores:
            return
        try:
            if summarise(self._engine, time.time_ns() // 1000):
                return
            self._next_chores = now + CHORES_S
            if self._keep_days is not None and (self._removal is not None or now >= self._next_removal):
                self._remove(now, self._safe_us(now) - self._keep_days * DAY_US)
        except DBAPIError as error:
            self._removal = None
            raise failure(self._url, error) from None

    def _safe_us(self, now: float) -> int:
        """The wall clock; one that has been set forward removes nothing before its time."""
        return min(time.time_ns() // 1000, self._began_us + round((now - self._began) * 1e6))

    def _remove(self, now: float, limit_us: int) -> None:
        """A step of the removal; the next one follows at once."""
        self._removal = self._removal or remove_old(self._engine, limit_us)
        try:
            next(self._removal)
            self._next_chores = now
        except StopIteration:
            self._removal = None
            self._next_removal = now + REMOVAL_S
