"""The time of a live world in somebody's hands: it stands, goes in steps or at another speed, and is saved as a session.

Nothing of this is seen in the world, whose time just goes on later: a session replays whatever was done to its pace.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from steptwin.errors import Misuse
from steptwin.files import session as sessions
from steptwin.files.beginning import check_session_target
from steptwin.files.textfiles import check_folder
from steptwin.files.world import LONGEST_RUN_NS
from steptwin.live.cell import Cell
from steptwin.live.control import Handler
from steptwin.machine import SECOND, Nanos
from steptwin.words.records import describe, is_told
from steptwin.world.durations import LONGEST_NS
from steptwin.world.expression import Condition
from steptwin.world.trace import Record

if TYPE_CHECKING:
    from steptwin.live.world import LiveWorld

SLOWEST, FASTEST = 0.001, 1000.0
SLICE_NS: Nanos = 10 * SECOND
"""Without a clock a world runs this much at a time, so that others are served."""
PART_S = 0.1
"""A step that takes longer is taken in parts, one for each request."""
MOST_TOLD = 1000
"""A part ends, too, when so much has happened that people want to know of."""
_SEEN_CLOSELY: dict[str, Callable[[Any], str]] = {
    "edge": lambda level: f"{level:g}",
    "plan": lambda plan: "moves" if getattr(plan, "profile", plan).segments else "stands",
}
"""Records that are shown where the next thing is waited for, and their values in words."""


def read_speed(text: str, least: float = SLOWEST) -> float:
    """Virtual seconds in a second; infinite for ``max``. Raises `Misuse`."""
    if text == "max":
        return inf
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not SLOWEST <= speed <= FASTEST and speed != least:
        standing = "" if least else "0 (stands), "
        raise Misuse(f"--speed {text}: permitted are {standing}{SLOWEST:g} to {FASTEST:g}, and 'max'")
    return speed


class Pace:
    """How the time of a live world goes; at first it stands. ``tell`` is told what a person watching should know."""

    def __init__(self, live: LiveWorld, cell: Cell, tell: Callable[[str], None], *, has_clients: bool) -> None:
        self.speed = 1.0
        """Virtual seconds in a second, once it goes; infinite: as many as there can be."""
        self.is_paused = True
        self._live = live
        self._cell = cell
        self._tell = tell
        self._has_clients = has_clients
        self._turn: asyncio.Handle | None = None
        cell.clock.stop(live.now)

    def begin(self, speed: float) -> None:
        """Time begins to go at ``speed``; with 0 it stands until it is resumed."""
        if speed:
            self.speed = speed
            self.is_paused = False
            self._go()
        if speed != 1.0:
            self._say(f"time goes on{self._how}" if speed else "time stands")

    def pause(self) -> None:
        """Time stands from now on."""
        self._halt()
        if not self.is_paused:
            self.is_paused = True
            self._say("time stands")

    def resume(self, speed: float | None = None) -> None:
        """Time goes on, at another speed where one is given; while it goes, only that changes. Raises `Misuse`."""
        if speed == inf and self._has_clients:
            raise Misuse("--speed max: this world has lines with clients outside, which need a clock")
        changes = self.is_paused or speed not in (None, self.speed)
        if speed is not None:
            self.speed = speed
        if changes:
            self._halt()
            self._say(f"time goes on{self._how}")
            self.is_paused = False
            self._go()

    @property
    def _how(self) -> str:
        if self.speed == inf:
            return " as fast as possible"
        return "" if self.speed == 1.0 else f", {self.speed:g} virtual seconds a second"

    def _say(self, text: str) -> None:
        self._tell(describe(Record(self._live.now, "world", "event", "pace", text)))

    def _halt(self) -> None:
        """Bring the world to the present and stop the clock there."""
        self.close()
        self._cell.enter()
        self._cell.clock.stop(self._live.now)

    def _go(self) -> None:
        if self.speed == inf:
            self._turn = asyncio.get_running_loop().call_soon(self._run_freely)
            return
        self._cell.close()  # its timer was set for another clock
        self._cell.clock.run(self.speed)
        self._cell.start()

    def _run_freely(self) -> None:
        """Without a clock, in slices."""
        world = self._live.world
        world.run(for_=SLICE_NS / SECOND)
        self._cell.clock.stop(world.now)
        self._live.advance(world.now)
        self._turn = None if world.stopped else asyncio.get_running_loop().call_soon(self._run_freely)

    def close(self) -> None:
        if self._turn is not None:
            self._turn.cancel()
            self._turn = None

    # ------------------------------------------------------------------ steps

    def step(self, end: Nanos, condition: Condition | None, happened: list[str], *, closely: bool = False) -> bool | None:
        """Go on to the moment ``end``, or until a condition is true; gives whether that ended it, None for not there yet.

        What people want to know of is added to ``happened``; ``closely``: levels and motions too.
        """
        live = self._live
        world = live.world
        until = perf_counter() + PART_S
        moves = False

        def listen(record: Record) -> None:
            if is_told(record):
                happened.append(describe(record))
            elif closely and record.kind in _SEEN_CLOSELY:
                happened.append(describe(record._replace(value=_SEEN_CLOSELY[record.kind](record.value))))

        world.trace.watchers.append(listen)
        try:
            while True:
                if condition is not None and world.holds(condition):
                    return True
                if live.now >= end or world.stopped is not None:
                    return False
                if moves and (perf_counter() > until or len(happened) >= MOST_TOLD):
                    return None
                dues = [end, live.deadline(), None if condition is None else condition.due(live.now)]
                live.advance(max(live.now, min(due for due in dues if due is not None)))
                moves = True
        finally:
            world.trace.watchers.remove(listen)
            self._cell.clock.stop(live.now)
            self._cell.close()  # a timer set for what has been done would find that it was held up

    # ------------------------------------------------------------------ requests

    def handlers(self) -> dict[str, Handler]:
        """Requests of the control endpoint. Moments and durations are in nanoseconds."""
        return {"pause": self._asked_to_pause, "resume": self._asked_to_resume, "step": self._asked_to_step, "save": self._save}

    def _where(self) -> dict[str, object]:
        return {
            "world": self._live.world.spec.name,
            "time_ns": self._live.now,
            "time_s": self._live.now / SECOND,
            "paused": self.is_paused,
            "speed": "max" if self.speed == inf else self.speed,
        }

    def _asked_to_pause(self, _: Mapping[str, Any]) -> object:
        self.pause()
        return self._where()

    def _asked_to_resume(self, request: Mapping[str, Any]) -> object:
        speed = request.get("speed")
        self.resume(None if speed is None else read_speed(str(speed)))
        return self._where()

    def _asked_to_step(self, request: Mapping[str, Any]) -> object:
        """A step, or its next part: ``to_ns`` of the answer, where there is one, is for the request for that."""
        text = request.get("until")
        if text is not None and not isinstance(text, str):
            raise Misuse(f"until = {text!r}: expected a condition")
        condition = None if text is None else self._live.world.condition(text)
        given = {key: request[key] for key in ("to_ns", "for_ns") if request.get(key) is not None}
        for key, value in given.items():
            if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= LONGEST_NS:
                raise Misuse(f"{key} = {value!r}: permitted are whole nanoseconds from 0 to {LONGEST_NS}")
        self.pause()
        end = self._end_of(given, has_condition=condition is not None)
        happened: list[str] = []
        is_next = condition is None and not given
        came = False if end is None else self.step(end, condition, happened, closely=is_next)
        stopped = self._live.world.stopped
        rest = {} if came is not None else {"to_ns": end}
        return {**self._where(), "happened": happened, "came": came is True, "stopped": stopped, "idle": end is None, **rest}

    def _end_of(self, given: Mapping[str, Nanos], *, has_condition: bool) -> Nanos | None:
        """The moment to which a step goes. Without a time that is the next thing that happens by itself; None: nothing will."""
        if "to_ns" in given:
            return given["to_ns"]
        if "for_ns" in given:
            return self._live.now + given["for_ns"]
        return self._live.now + LONGEST_RUN_NS if has_condition else self._live.deadline()

    def _save(self, request: Mapping[str, Any]) -> object:
        file = request.get("file")
        if not isinstance(file, str) or not Path(file).is_absolute():
            raise Misuse(f"file = {file!r}: must be the absolute path of a file")
        path = Path(file)
        check_session_target(path)
        check_folder(path)
        self._cell.enter()
        session = self._live.session()
        sessions.save(session, path)
        return {**self._where(), "file": file, "inputs": len(session.inputs), "digest": session.digest}
