"""A world with its files: the Python interface of worlds.

with World.load("machine.toml") as world:
    world.run(until="x.position > 100", for_="1 min")
    print(world.mic488["table"].axis[1].position)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeAlias

from steptwin.errors import Misuse
from steptwin.files.export.progress import Progress, silent
from steptwin.files.textfiles import read_text
from steptwin.inputfiles import read_bytes, shown
from steptwin.m1486.chip import M1486
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.device import Mic488
from steptwin.world import script as do
from steptwin.world.description import describe, read_world
from steptwin.world.durations import duration
from steptwin.world.faults import Fault
from steptwin.world.faults import read as read_fault
from steptwin.world.overrides import NO_OVERRIDES, Overrides
from steptwin.world.plant import Plant, PlantSnapshot
from steptwin.world.running import Script
from steptwin.world.spec import WorldSpec
from steptwin.world.views import AxisView, LineView, M1486View, Mic488View, Views

LONGEST_RUN_NS: Nanos = 3600 * SECOND
"""A condition that never comes true is given up after an hour, where nothing else is said."""
SLICES = 200
"""In so many parts a run is done at least, where somebody watches its progress."""
LONGEST_SLICE_NS: Nanos = 10 * SECOND
"""Somebody who watches may want it to end."""

Duration: TypeAlias = float | str
"""Seconds, or a text such as ``"10 min"``."""
Reaction: TypeAlias = do.Step | tuple[do.Step, ...] | Callable[[], object]
"""What `World.at` and `World.when` do: steps, or a function that may do anything with the world."""


class World(Plant):
    """A world in virtual time. It begins at 0 s and runs when it is told to.

    What is done to it from Python goes into its session and can be replayed; what is done to a `device` or `chip` behind its
    back cannot.
    """

    def __init__(
        self,
        spec: WorldSpec,
        files: Mapping[str, bytes] | None = None,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
    ) -> None:
        super().__init__(spec, files or {}, keep_trace=keep_trace, keep_inputs=keep_inputs)
        machines = self.machines
        self.mic488: Views[Mic488View] = Views(
            self, "MIC488", {name: Mic488View(self, name, m) for name, m in machines.items() if isinstance(m, Mic488)}
        )
        """The MIC488 controllers by name."""
        self.m1486: Views[M1486View] = Views(
            self, "M1486", {name: M1486View(self, name, m) for name, m in machines.items() if isinstance(m, M1486)}
        )
        """The M1486 chips by name."""
        self.axis: Views[AxisView] = Views(self, "axis", {name: AxisView(self, axis) for name, axis in self.axes.items()})
        """The mechanics by the names of their axes."""
        self.line: Views[LineView] = Views(self, "line", {name: LineView(self, name) for name in self.lines})

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
    ) -> Self:
        """The world described by a TOML file. Raises `WorldError` (a `Misuse`).

        ``seed`` replaces that of the description, ``overrides`` other values in it: ``{"axis.x.pitch": 4.0}``. Without
        ``keep_trace`` and ``keep_inputs`` the memory of a long run does not grow with what happens; it then has no trace and no
        session. Files the description names are read from its folder and those below, with ``allow_outside`` from anywhere: their
        content becomes part of sessions.
        """
        place = Path(path)
        spec = describe(str(path), read_text(place).source.text, seed, overrides)
        files: dict[str, bytes] = {}
        for name, key in spec.files():
            try:
                files[name] = read_bytes(_beside(place.parent, name, allow_outside=allow_outside))
            except Misuse as error:
                spec.text.wrong(key, "D009", str(error))
        return cls(spec, files, keep_trace=keep_trace, keep_inputs=keep_inputs)

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
    ) -> Self:
        """The world described by a text. ``files`` are the contents of the files it names; the rest is as in `load`."""
        return cls(describe(name, text, seed, overrides), files, keep_trace=keep_trace, keep_inputs=keep_inputs)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing is open: for those who read with `with`."""

    # ------------------------------------------------------------------ running

    @property
    def time(self) -> float:
        """The present moment in seconds."""
        return self.now / SECOND

    def run(  # type: ignore[override]
        self, until: float | str | None = None, *, for_: Duration | None = None, watch: Progress = silent
    ) -> str | None:
        """Run ``for_`` a time, or ``until`` a moment (seconds) or a condition (text, such as ``"idle"``) for an hour at most.

        With both it is whichever comes first. Raises `Misuse` for a moment that has passed.

        Gives the condition, or the reason of a script, that ended the run before its time; else None. ``watch`` is told how far
        it is.
        """
        end = self.now + (LONGEST_RUN_NS if for_ is None else duration(for_))
        condition = until if isinstance(until, str) else None
        if isinstance(until, int | float):
            moment = duration(until)
            if moment < self.now:
                raise Misuse(f"until {until:g} s: this world is at {self.time:g} s already")
            end = moment if for_ is None else min(moment, end)
        elif until is None and for_ is None:
            raise Misuse("run needs until or for_: a moment, a condition, or a duration")
        if watch is silent:
            return super().run(end, condition)
        begin = self.now
        slices = max(SLICES, (end - begin) // LONGEST_SLICE_NS)
        for part in range(1, slices + 1):
            reason = super().run(begin + (end - begin) * part // slices, condition)
            watch(self.now)
            if reason is not None:
                return reason
        return None

    def step(self) -> Nanos | None:
        """Run to the next moment at which anything happens by itself; gives it, None when nothing will."""
        dues = [due for kernel in self.kernels if (due := kernel.deadline()) is not None]
        own = self.next()
        due = min(dues if own is None else [*dues, own], default=None)
        if due is not None:
            super().run(max(due, self.now))
        return due

    # ------------------------------------------------------------------ operators

    def at(self, time: Duration, reaction: Reaction, name: str = "at") -> Script:
        """Do something at a moment. Raises `Misuse` for one that has passed."""
        moment = duration(time)
        if moment < self.now:
            raise Misuse(f"at {moment / SECOND:g} s: this world is at {self.time:g} s already")
        return self.start(name, partial(do.run_through, (do.At(moment), *_steps(reaction))), is_outside=True)

    def when(self, condition: str, reaction: Reaction, *, once: bool = False, name: str = "when") -> Script:
        """Do something whenever a condition comes true, or only the first time. Raises `Misuse`."""
        self.condition(condition)
        return self.start(name, partial(do.run_when, _steps(reaction), condition, once=once), is_outside=True)

    def script(self, operator: Callable[[], do.Steps], name: str | None = None) -> Script:
        """Let an operator work from now on: a function that yields steps (`steptwin.world.script`) and is sent what they give.

        It touches the world by its steps only; so it can be brought back to any moment.
        """
        return self.start(name or getattr(operator, "__name__", "script"), operator, is_outside=True)

    def press(self, button: str, for_: Duration | None = None) -> None:
        """Press a button, until it is released or for a time."""
        self.outside(do.Press(button, None if for_ is None else duration(for_)))

    def release(self, button: str) -> None:
        self.outside(do.Release(button))

    def fault(self, fault: str | Fault) -> str:
        """Set a fault from now on, such as ``"crc unit=1 nth=3"`` (`steptwin fault --kinds`); gives its name.

        Raises `Misuse` for one that cannot happen here.
        """
        self.outside(do.SetFault(read_fault(fault) if isinstance(fault, str) else fault))
        return self.plan.faults.active[-1].name

    def clear_fault(self, name: str) -> None:
        """Remove a fault. Raises `Misuse` with the names there are."""
        self.outside(do.ClearFault(name))

    # ------------------------------------------------------------------ branches

    def branch(self, snapshot: PlantSnapshot | None = None) -> Self:
        """Another world in the state of this one, now or at a snapshot, which goes its own way.

        Scripts go along. Functions given to `at` and `when` do what they did: those that name this world act on this one.
        """
        other = type(self)(self.spec, self.files, keep_trace=self.trace.is_kept, keep_inputs=self.keeps_inputs)
        other.restore(self.snapshot() if snapshot is None else snapshot)
        return other

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy: the description and a snapshot. Functions given to `at`, `when` and `script` must be such as
        pickle can find by name; a world that keeps no trace cannot be pickled (`Misuse`)."""
        return _revived, (type(self), self.spec.text.source.name, self.snapshot(), self.keeps_inputs)


def _revived(kind: type[World], name: str, snapshot: PlantSnapshot, keep_inputs: bool) -> World:
    text, seed, overrides, files = snapshot.description
    world = kind(read_world(name, text, seed, overrides), files, keep_inputs=keep_inputs)
    world.restore(snapshot)
    return world


def _beside(folder: Path, name: str, *, allow_outside: bool) -> Path:
    """The path of a file named in a description in this folder. Raises `Misuse` for one elsewhere."""
    path = folder / name
    try:
        if not allow_outside and not path.resolve().is_relative_to(folder.resolve()):
            raise Misuse(f"{shown(Path(name))} does not lie beside the description or below: --allow-outside permits it")
    except (OSError, RuntimeError) as error:  # links in a circle
        raise Misuse(f"{shown(Path(name))}: {error}") from None
    except ValueError as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{shown(Path(name))}: {error}") from None
    return path


def _steps(reaction: Reaction) -> tuple[do.Step, ...]:
    if isinstance(reaction, tuple):
        return reaction
    return (do.Call(partial(reaction)),) if callable(reaction) else (reaction,)
