"""A world with its files: the Python interface of worlds.

with World.load("machine.toml") as world:
    world.run(until="x.position > 100", for_="1 min")
    print(world.mic488["table"].axis[1].position)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from functools import cached_property, partial
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.files.blueprintcache import DescriptionKey, keep_blueprint, known_blueprint
from steptwin.files.export.progress import TimeProgress, silent
from steptwin.files.memory import StateDirectory, StateFailure
from steptwin.files.textfiles import read_text
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES, format_path, read_bytes
from steptwin.simulation.describe.blueprint import Blueprint, memory_file
from steptwin.simulation.describe.description import describe, read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.describe.overrides import NO_OVERRIDES, Overrides
from steptwin.simulation.describe.servicetables import SERVICE_TABLES
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.faults import Fault
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.kinds.kind import ControllerKind, M, S, V
from steptwin.simulation.kinds.m1486.view import M1486View
from steptwin.simulation.kinds.mic488.view import Mic488View
from steptwin.simulation.kinds.registry import M1486, MIC488
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.running import Script
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.simulation.world.views import LineView, MechanicsView, Views
from steptwin.why.answer import Answer
from steptwin.why.keptstates import KeptStates
from steptwin.why.replayedrun import ReplayedRun

LONGEST_RUN_NS: Nanos = 3600 * SECOND
"""Default limit of a run with a condition, ns: an hour."""
SLICES = 200
"""Least number of parts of a run whose progress is shown."""
LONGEST_SLICE_NS: Nanos = 10 * SECOND
"""So that it can be interrupted in time."""


class FailedSave(NamedTuple):
    """A failed save of the non-volatile memory of a controller, for example on a full disk."""

    time: Nanos
    controller: str
    reason: str


Duration: TypeAlias = float | str
"""Seconds, or a text such as ``"10 min"``."""
Reaction: TypeAlias = do.Step | tuple[do.Step, ...] | Callable[[], object]
"""The action of `World.at` and `World.when`: steps, or a function of the world."""


class World(Simulation):
    """A world in virtual time. It begins at 0 s and runs only on request.

    Calls of its methods go into its recording and can be replayed; direct changes of a `device` or `chip` cannot.
    """

    def __init__(
        self,
        blueprint: Blueprint,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        state: StateDirectory | None = None,
        failing: Iterable[FailedSave] = (),
        at: SimulationSnapshot | None = None,
    ) -> None:
        """``failing``: saves of memory that fail, as they did in the run that is replayed. ``at``: as for `Simulation`."""
        self._state = state
        self._failing = {(failed.time, failed.controller): failed.reason for failed in failing}
        self.failed_saves: list[FailedSave] = []
        """Failed saves so far, if inputs are kept: a replay repeats them."""
        self._states: KeptStates | None = None
        """Its past since its beginning, if it keeps states."""
        keep = None if state is None and not self._failing else self._save
        super().__init__(blueprint, keep_trace=keep_trace, keep_inputs=keep_inputs, keep_memory=keep, at=at)

    @cached_property
    def mic488(self) -> Views[Mic488View]:
        """The MIC488 controllers by name."""
        return self.views(MIC488)

    @cached_property
    def m1486(self) -> Views[M1486View]:
        """The M1486 chips by name."""
        return self.views(M1486)

    @cached_property
    def axis(self) -> Views[MechanicsView]:
        """The mechanics by the names of their axes."""
        return Views(self, "axis", {name: MechanicsView(self, axis) for name, axis in self.axes.items()})

    @cached_property
    def line(self) -> Views[LineView]:
        """The lines by name."""
        return Views(self, "line", {name: LineView(self, name) for name in self.lines})

    def views(self, kind: ControllerKind[S, M, V]) -> Views[V]:
        """The controllers of a kind by name."""
        view: Callable[[Simulation, str, Any], V] = kind.view
        there = {name: view(self, name, controller) for name, controller in self.controllers.items() if self.kind(name) is kind}
        return Views(self, kind.model, there)

    # ------------------------------------------------------------------ making one

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        seed: int | None = None,
        overrides: Overrides = NO_OVERRIDES,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        allow_outside: bool = False,
        state: str | Path | None = None,
    ) -> Self:
        """The world described by a TOML file. Raises `WorldError` (a `Misuse`).

        ``seed`` replaces that of the description, ``overrides`` other values in it: ``{"axis.x.pitch": 4.0}``. Without
        ``keep_trace`` and ``keep_inputs`` the memory of a long run does not grow; it then has neither trace nor recording. Files
        the description names are read from its folder and those below, with ``allow_outside`` from anywhere: their content
        becomes part of recordings. ``state`` replaces the directory of non-volatile memory that the description names; the world
        owns that directory until `close`, and raises `StateInUse` or `StateFailure` if it cannot be used.
        """
        place = Path(path)
        files: dict[str, bytes] = {}

        def read(name: str) -> bytes:
            files[name] = read_beside(place.parent, name, allow_outside=allow_outside)
            return files[name]

        text = read_text(place, MOST_DESCRIPTION_BYTES).source.text
        loaded = DescriptionKey(str(path), text, seed, repr(overrides), tuple(SERVICE_TABLES))
        known = known_blueprint(loaded, read) if state is None else None
        if known is not None:
            return cls(known, keep_trace=keep_trace, keep_inputs=keep_inputs)
        files.clear()
        spec = describe(str(path), text, seed, overrides, read)
        for name, key in spec.files():
            try:
                _ = files.get(name) or read(name)
            except Misuse as error:
                spec.text.wrong(key, "D009", str(error))
        where = None if state is None else Path(state)
        if where is None and spec.state is not None:
            try:
                where = _beside(place.parent, spec.state, allow_outside=allow_outside)
            except Misuse as error:
                spec.text.wrong(("world", "state"), "D003", str(error))
        world = cls._with_memory(spec, files, where, keep_trace=keep_trace, keep_inputs=keep_inputs)
        if where is None:
            keep_blueprint(loaded, world.blueprint)
        return world

    def _save(self, controller: str, data: bytes, now: Nanos) -> None:
        """Raises `StateFailure` if it could not be stored."""
        try:
            if (now, controller) in self._failing:
                raise StateFailure(self._failing[now, controller])
            if self._state is not None:
                self._state.save(controller, data)
        except StateFailure as error:
            if self.keeps_inputs:
                self.failed_saves.append(FailedSave(now, controller, str(error)))
            raise

    @classmethod
    def _with_memory(
        cls, spec: WorldSpec, files: dict[str, bytes], where: Path | None, *, keep_trace: bool, keep_inputs: bool
    ) -> Self:
        """A world that reads its non-volatile memories from a directory and keeps them there."""
        if where is None:
            return cls(Blueprint(spec, files), keep_trace=keep_trace, keep_inputs=keep_inputs)
        with ExitStack() as opened:
            state = opened.enter_context(StateDirectory(where))
            for described in spec.controllers:
                image = state.load(described.name)
                if image is not None:
                    files[memory_file(described.name)] = image
            world = cls(Blueprint(spec, files), keep_trace=keep_trace, keep_inputs=keep_inputs, state=state)
            opened.pop_all()
            return world

    @classmethod
    def from_toml(
        cls,
        text: str,
        files: Mapping[str, bytes] | None = None,
        *,
        name: str = "world.toml",
        seed: int | None = None,
        overrides: Overrides = NO_OVERRIDES,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        state: str | Path | None = None,
    ) -> Self:
        """The world described by a text. ``files`` are the contents of the files it names; the rest is as in `load`, but that
        non-volatile memory lasts in ``state`` alone: a text lies in no folder."""
        spec = describe(name, text, seed, overrides, given_files(files or {}))
        where = None if state is None else Path(state)
        return cls._with_memory(spec, dict(files or {}), where, keep_trace=keep_trace, keep_inputs=keep_inputs)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    @property
    def state(self) -> Path | None:
        """The directory of non-volatile memory; None: memory ends with this world."""
        return None if self._state is None else self._state.path

    def close(self) -> None:
        """Release the directory of non-volatile memory, if any. Closing twice has no effect."""
        if self._state is not None:
            self._state.close()

    # ------------------------------------------------------------------ running

    @property
    def time(self) -> float:
        """The present moment in seconds."""
        return self.now / SECOND

    def run(self, until: float | str | None = None, *, for_: Duration | None = None, watch: TimeProgress = silent) -> str | None:
        """Run ``for_`` a time, or ``until`` a moment (seconds) or a condition (text, such as ``"idle"``) for an hour at most.

        With both it is whichever comes first. Raises `Misuse` for a moment that has passed.

        Gives the condition, or the reason of a script, that ended the run before its time; else None. ``watch`` is called
        with the time reached.
        """
        end = self.now + (LONGEST_RUN_NS if for_ is None else duration(for_))
        condition = until if isinstance(until, str) else None
        if isinstance(until, int | float):
            moment = duration(until)
            if moment < self.now:
                raise Misuse(f"until {until:g} s: this world is at {self.time:g} s already")
            end = moment if for_ is None else min(moment, end)
        elif until is None and for_ is None:
            raise Misuse("run needs until (a moment or a condition) or for_ (a duration)")
        if watch is silent:
            return self.run_to(end, condition)
        begin = self.now
        slices = max(SLICES, (end - begin) // LONGEST_SLICE_NS)
        for part in range(1, slices + 1):
            reason = self.run_to(begin + (end - begin) * part // slices, condition)
            watch(self.now)
            if reason is not None:
                return reason
        return None

    def due(self) -> Nanos | None:
        """The next moment (ns) at which anything happens without input; None if nothing will."""
        deadlines = [due for scheduler in self.schedulers if (due := scheduler.deadline()) is not None]
        own = self.next()
        return min(deadlines if own is None else [*deadlines, own], default=None)

    def step(self) -> Nanos | None:
        """Run to the next moment (ns) at which anything happens without input, and return it; None if nothing will."""
        due = self.due()
        if due is not None:
            self.run_to(max(due, self.now))
        return due

    # ------------------------------------------------------------------ operators

    def at(self, time: Duration, reaction: Reaction, name: str = "at") -> Script:
        """Execute an action at a moment. Raises `Misuse` for one that has passed."""
        moment = duration(time)
        if moment < self.now:
            raise Misuse(f"at {moment / SECOND:g} s: this world is at {self.time:g} s already")
        return self.start(name, partial(do.run_through, (do.At(moment), *_steps(reaction))), is_external=True)

    def when(self, condition: str, reaction: Reaction, *, once: bool = False, name: str = "when") -> Script:
        """Execute an action whenever a condition comes true, or only the first time. Raises `Misuse`."""
        self.condition(condition)
        return self.start(name, partial(do.run_when, _steps(reaction), condition, once=once), is_external=True)

    def script(self, operator: Callable[[], do.Steps], name: str | None = None) -> Script:
        """Start a script: a function that yields steps (`steptwin.simulation.script.steps`) and is sent their results.

        It touches the world by its steps only; so it can be brought back to any moment.
        """
        return self.start(name or getattr(operator, "__name__", "script"), operator, is_external=True)

    def press(self, button: str, for_: Duration | None = None) -> None:
        """Press a button, until it is released or for a time."""
        self.apply_input(do.Press(button, None if for_ is None else duration(for_)))

    def release(self, button: str) -> None:
        self.apply_input(do.Release(button))

    def put(self, on: str, front: float | None = None) -> None:
        """Put a new workpiece on a conveyor, its front ``front`` mm from the beginning, or into the first free cell of a nest.
        Raises `Misuse`; `Refusal` where there is no room."""
        self.apply_input(do.Put(on, front))

    def remove(self, workpiece: str) -> None:
        """Take a workpiece out of the world, such as ``infeed.3``. Raises `Misuse`; `Refusal` where it is not there."""
        self.apply_input(do.Remove(workpiece))

    def fault(self, fault: str | Fault) -> str:
        """Set a fault from now on, such as ``"crc unit=1 nth=3"`` (`steptwin fault --kinds`); gives its name.

        Raises `Misuse` for one that cannot happen here.
        """
        self.apply_input(do.SetFault(read_fault(fault) if isinstance(fault, str) else fault))
        return self.objects.faults.active[-1].name

    def clear_fault(self, name: str) -> None:
        """Remove a fault. Raises `Misuse` with the names there are."""
        self.apply_input(do.ClearFault(name))

    # ------------------------------------------------------------------ causes

    def keep_states(self) -> None:
        """Keep states of this world at its beginning and while it runs, so that `past` need not run it again to have them; until
        a snapshot is restored. Raises `Misuse` for a world that does not keep its inputs, and later than at its beginning."""
        if not self.keeps_inputs or self.now:
            raise Misuse("states are kept of worlds that keep their inputs, from their beginning on")
        self._states = KeptStates(self)

    def run_to(self, end: Nanos, until: str | None = None) -> str | None:
        """As `Simulation.run_to`; in parts, if states are kept."""
        states = self._states
        while states is not None and end > self.now + states.distance:
            reason = super().run_to(self.now + states.distance, until)
            if reason is not None:
                return reason
            states.take(len(self.inputs))
        return super().run_to(end, until)

    @property
    def past(self) -> ReplayedRun:
        """The past until now, for questions (`ReplayedRun.ask`). Raises `Misuse` for a world that does not keep its inputs."""
        if not self.keeps_inputs:
            raise Misuse("this world does not keep its inputs, so its past is not known: make it with keep_inputs=True")
        self.advance(self.now)
        self.sync_all()
        again = partial(type(self), self.blueprint, failing=self.failed_saves)
        return ReplayedRun(again, self.inputs, self.now, self._states)

    def why(self, question: str, at: Duration | None = None, *, try_without: bool = False, everything: bool = False) -> Answer:
        """Why a signal has its value, a condition its truth, or a controller's program waits; now or at a moment.

        ``everything``: all that is found, not only the first sixteen links. ``try_without``: the same, and what would be without
        each root: an input, an action of a script, a request or a fault, each left out in a run of its own.

        Each call runs the past again; for several questions about one past, use `past`. Raises `Misuse` for what is no question.
        """
        return self.past.ask(question, None if at is None else duration(at), try_without=try_without, everything=everything)

    # ------------------------------------------------------------------ branches

    def restore(self, snapshot: SimulationSnapshot) -> None:
        """As `Simulation.restore`."""
        super().restore(snapshot)
        if self._states is not None:
            self._states.close()
            self._states = None
        self.failed_saves = [failed for failed in self.failed_saves if failed.time <= snapshot.now]

    def branch(self, snapshot: SimulationSnapshot | None = None) -> Self:
        """Another world in the state of this one, now or at a snapshot; both continue independently.

        Scripts go along. Functions given to `at` and `when` do what they did: those that name this world act on this one.
        """
        return type(self)(
            self.blueprint,
            keep_trace=self.trace.is_kept,
            keep_inputs=self.keeps_inputs,
            failing=self.failed_saves,
            at=self.snapshot() if snapshot is None else snapshot,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy: the description and a snapshot. Functions given to `at`, `when` and `script` must be such as
        pickle can find by name; a world that keeps no trace cannot be pickled (`Misuse`)."""
        return _revived, (type(self), self.spec.text.source.name, self.snapshot(), self.keeps_inputs)


def _revived(kind: type[World], name: str, snapshot: SimulationSnapshot, keep_inputs: bool) -> World:
    text, seed, overrides, files = snapshot.description
    blueprint = Blueprint(read_world(name, text, seed, overrides, given_files(files)), files)
    return kind(blueprint, keep_inputs=keep_inputs, at=snapshot)


def read_beside(folder: Path, name: str, *, allow_outside: bool = False) -> bytes:
    """A file that a description in this folder names. Raises `Misuse` for one elsewhere, or that cannot be read."""
    return read_bytes(_beside(folder, name, allow_outside=allow_outside))


def _beside(folder: Path, name: str, *, allow_outside: bool) -> Path:
    """The path of a file named in a description in this folder. Raises `Misuse` for one elsewhere."""
    path = folder / name
    try:
        if not allow_outside and not path.resolve().is_relative_to(folder.resolve()):
            raise Misuse(f"{format_path(Path(name))} is outside the folder of the description: --allow-outside permits it")
    except (OSError, RuntimeError) as error:  # links in a circle
        raise Misuse(f"{format_path(Path(name))}: {error}") from None
    except ValueError as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{format_path(Path(name))}: {error}") from None
    return path


def _steps(reaction: Reaction) -> tuple[do.Step, ...]:
    if isinstance(reaction, tuple):
        return reaction
    return (do.Call(partial(reaction)),) if callable(reaction) else (reaction,)
