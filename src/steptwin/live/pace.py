"""Control of the time of a live world: pause, step, another speed, and saving the recording.

The world is not affected, because its time only advances later: a recording replays independently of its pace.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.fields import FASTEST, SLOWEST
from steptwin.files import recording as recordings
from steptwin.files.export import axis_views, check_target, write_trace
from steptwin.files.loader import check_recording_target, is_recording
from steptwin.files.textfiles import check_folder
from steptwin.live.realtimedriver import REST_S, RealTimeDriver
from steptwin.messages import Message, text_of
from steptwin.numerals import read_number
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.world.model import WORLD
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.subject import commands as command
from steptwin.subject.dispatch import Action
from steptwin.subject.events import line_of
from steptwin.subject.payloads import PacePayload
from steptwin.subject.subscriptions import Subscription
from steptwin.subject.time import MOST_SHOWN, end_of, happened, shown_of

if TYPE_CHECKING:
    from steptwin.live.world import LiveWorld

SLICE_NS: Nanos = 10 * SECOND
"""Virtual time per slice without a clock, ns, so that clients are served between slices."""
PART_NS: Nanos = SECOND // 10
"""Longest real time of a part of a step, ns; each request executes one part. Where an advance is bounded, a part is, too."""
PERMITTED_SPEEDS = Message("live.permitted-speeds", "permitted are {least:g} to {most:g}, and 'max'")
PERMITTED_SPEEDS_AND_NONE = Message(
    "live.permitted-speeds-and-none", "permitted are 0 (paused), {least:g} to {most:g}, and 'max'"
)
WRONG_SPEED = Message("live.wrong-speed", "--speed {problem}: {permitted}")
SPEED_IS_NOT_PERMITTED = Message("live.speed-is-not-permitted", "--speed {text}: {permitted}")


def read_speed(text: str, least: float = SLOWEST) -> float:
    """Parse a speed, virtual seconds per second; infinite for ``max``. Raises `Misuse`."""
    if text == "max":
        return inf
    permitted = PERMITTED_SPEEDS(least=SLOWEST, most=FASTEST) if least else PERMITTED_SPEEDS_AND_NONE(least=SLOWEST, most=FASTEST)
    try:
        speed = read_number(text)
    except Misuse as error:
        raise Misuse(WRONG_SPEED(problem=text_of(error), permitted=permitted)) from None
    if not SLOWEST <= speed <= FASTEST and speed != least:
        raise Misuse(SPEED_IS_NOT_PERMITTED(text=text, permitted=permitted))
    return speed


_STANDS = PacePayload(paused=True, speed=None)
SPEED_MAX_WITH_CLIENTS = Message(
    "live.speed-max-with-clients", "--speed max: this world has lines with external clients, which need real time"
)
FILE_IS_NOT_ABSOLUTE = Message("live.file-is-not-absolute", "file = {file!r}: must be the absolute path of a file")
NO_LAST_RECORDS = Message(
    "live.no-last-records",
    "{path}: this world does not keep its last records: start it with --trace 'ring 10000'; for a recording, name the file "
    "NAME.json",
)


class Pace:
    """The pace of a live world; at first it is paused. ``show`` is called with notices for the user."""

    def __init__(self, live: LiveWorld, realtime: RealTimeDriver, show: Callable[[str], None], *, has_clients: bool) -> None:
        self.speed = 1.0
        """Virtual seconds per second while it runs; infinite: as fast as possible."""
        self.is_paused = True
        self._live = live
        self._realtime = realtime
        self._show = show
        self._has_clients = has_clients
        self._turn: asyncio.Handle | None = None
        self._is_held = False
        """Whether the debugger has ended a step."""
        realtime.clock.stop(live.now)
        live.on_break = self._hold

    def begin(self, speed: float) -> None:
        """Start time at ``speed``; 0: paused."""
        if speed:
            self.speed = speed
            self.is_paused = False
            self._go()
        if speed != 1.0:
            self._say(self._goes() if speed else _STANDS)

    def pause(self) -> None:
        """Pause."""
        self._halt()
        if not self.is_paused:
            self._stand()
        self._report_pause()

    def _stand(self) -> None:
        self.is_paused = True
        self._say(_STANDS)

    def _hold(self) -> None:
        """The debugger has stopped it."""
        self._is_held = True
        self.close()
        self._realtime.close()
        self._realtime.clock.stop(self._live.now)
        if not self.is_paused:
            self._stand()

    def _report_pause(self) -> None:
        if self._live.run_control is not None:
            self._live.run_control.paused()

    def resume(self, speed: float | None = None) -> None:
        """Continue, at ``speed`` if given; while time runs, only the speed changes. Raises `Misuse`."""
        if speed == inf and self._has_clients:
            raise Misuse(SPEED_MAX_WITH_CLIENTS())
        changes = self.is_paused or speed not in (None, self.speed)
        if speed is not None:
            self.speed = speed
        if changes:
            was_paused = self.is_paused
            self._halt()
            if self.is_paused and not was_paused:
                return  # a debugger has stopped it on the way to the present
            self._say(self._goes())
            self.is_paused = False
            self._go()

    def _goes(self) -> PacePayload:
        return PacePayload(paused=False, speed=None if self.speed == inf else self.speed)

    def _say(self, pace: PacePayload) -> None:
        """Notify users and subscribers."""
        self._show(line_of(self._live.now, WORLD, pace.text))
        self._live.subject.paced(pace)

    def _halt(self) -> None:
        """Advance the world to the present and stop the clock there."""
        self.close()
        self._realtime.enter()
        self._realtime.clock.stop(self._live.now)

    def _go(self) -> None:
        if self._live.run_control is not None:
            self._live.run_control.resumed()
        if self.speed == inf:
            self._turn = asyncio.get_running_loop().call_soon(self._run_freely)
            return
        self._realtime.close()  # its timer was set for another clock
        self._realtime.clock.run(self.speed)
        self._realtime.start()

    def _run_freely(self) -> None:
        """Run without a clock, in slices."""
        world, end = self._live.world, self._live.now + SLICE_NS
        self._turn = None
        if self._live.run_control is None and self._realtime.longest_ns is None:
            world.run(for_=SLICE_NS / SECOND)
            end = world.now
        self._realtime.advance(end)
        self._realtime.clock.stop(world.now)
        if not self.is_paused and world.stopped is None:
            rest_s = 0.0 if self._realtime.longest_ns is None else REST_S
            self._turn = asyncio.get_running_loop().call_later(rest_s, self._run_freely)

    def close(self) -> None:
        if self._turn is not None:
            self._turn.cancel()
            self._turn = None

    def go_back(self, snapshot: SimulationSnapshot, name: str | None = None) -> None:
        """To a state, under its name where it has one; time stands from now on. Raises `Refusal`."""
        self.pause()
        try:
            self._live.go_back(snapshot, name)
        finally:
            self._realtime.clock.stop(self._live.now)
            self._realtime.close()
            self._realtime.moments += 1  # what was read at this moment is shared no more

    # ------------------------------------------------------------------ steps

    def step(self, end: Nanos, condition: SignalCondition | None, subscription: Subscription) -> bool | None:
        """Advance to the moment ``end``, or until a condition is true; returns whether the condition ended it, None if
        unfinished.

        A part also ends when ``subscription`` is full.
        """
        live = self._live
        world = live.world
        wall_ns = self._realtime.clock.wall_ns
        until = wall_ns() + min(PART_NS, self._realtime.longest_ns or PART_NS)
        moves = self._is_held = False
        if live.run_control is not None:
            live.run_control.resumed()
        try:
            while True:
                if condition is not None and world.holds(condition):
                    return True
                if live.now >= end or world.stopped is not None:
                    return False
                if moves and (wall_ns() >= until or len(subscription) >= MOST_SHOWN // 2):
                    return None
                deadlines = [end, live.deadline(), None if condition is None else condition.due(live.now)]
                live.advance(max(live.now, min(due for due in deadlines if due is not None)))
                if self._is_held:
                    return False
                moves = True
        finally:
            self._realtime.clock.stop(live.now)
            self._realtime.close()  # a timer set for what has been done would find that it was held up

    # ------------------------------------------------------------------ commands

    def actions(self) -> dict[type, Action]:
        """Commands that advance the world to the present themselves."""
        return {
            command.Pause: self._pause,
            command.Resume: self._resume,
            command.Advance: self._advance,
            command.Save: self._save,
            command.RestoreSnapshot: self._restore,
        }

    def where(self) -> dict[str, object]:
        """The present moment and pace."""
        speed = "max" if self.speed == inf else self.speed
        return {**self._live.subject.time(), "paused": self.is_paused, "speed": speed}

    def _pause(self, _: command.Pause) -> object:
        self.pause()
        return self.where()

    def _resume(self, wanted: command.Resume) -> object:
        self.resume(wanted.speed)
        return self.where()

    def _advance(self, wanted: command.Advance) -> object:
        """A step, or its next part: ``to_ns`` of the answer, if present, is the argument for the next part."""
        live = self._live
        condition = None if wanted.until is None else live.world.condition(wanted.until)
        self.pause()
        end = end_of(live.world, wanted, live.deadline())
        subscription = live.subject.subscribe(shown_of(wanted), MOST_SHOWN)
        try:
            came = False if end is None else self.step(end, condition, subscription)
        finally:
            subscription.close()
        if came is not None:
            self._report_pause()
        rest = {} if came is not None else {"to_ns": str(end)}
        return {
            **self.where(),
            **happened(subscription),
            "came": came is True,
            "idle": end is None,
            "statements": self._statements(),
            **rest,
        }

    def _restore(self, wanted: command.RestoreSnapshot) -> object:
        self.go_back(self._live.subject.snapshots.find(wanted), wanted.name)
        return self.where()

    def _statements(self) -> dict[str, str]:
        """The current statements of running and paused programs, by controller."""
        world = self._live.world
        programs = {name: world.state_of(name).program for name in world.controllers}
        return {name: f"line {one.line}: {one.statement}" for name, one in programs.items() if one.line is not None}

    def _save(self, wanted: command.Save) -> object:
        path = Path(wanted.file)
        if not path.is_absolute():
            raise Misuse(FILE_IS_NOT_ABSOLUTE(file=wanted.file))
        if not is_recording(path):
            return self._save_ring(path)
        check_recording_target(path)
        check_folder(path)
        self._realtime.enter()
        recording = self._live.recording()
        recordings.save(recording, path)
        return {**self.where(), "file": wanted.file, "inputs": len(recording.inputs), "digest": recording.digest}

    def _save_ring(self, path: Path) -> object:
        """The last records, in the format of the file's suffix."""
        ring, world = self._live.ring, self._live.world
        if ring is None:
            raise Misuse(NO_LAST_RECORDS(path=path))
        check_target(path)
        self._realtime.enter()
        trace = ring.trace()
        begin = next((record.time for record in trace), world.now)
        written = write_trace(trace, path, views=axis_views(world), title=world.spec.name, begin=begin, ended=world.now)
        return {**self.where(), "files": [str(one) for one in written], "records": len(trace)}
