"""Sessions: a world, its files, and all inputs with their moments, in one JSON file.

``steptwin replay FILE`` runs it again and compares the digest of the trace. No other file is needed.
"""

from __future__ import annotations

import json
from base64 import b64decode, b64encode
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from textwrap import indent
from typing import Any, get_type_hints

from steptwin import __version__
from steptwin.controller import SECOND, Nanos
from steptwin.datatypes import fitting
from steptwin.durations import LONGEST_NS
from steptwin.errors import Misuse
from steptwin.files.textfiles import write_bytes
from steptwin.files.world import FailedSave, World
from steptwin.inputfiles import MOST_RECORDED_BYTES, read_recorded
from steptwin.later import finish
from steptwin.messages import Message
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.faults import Fault, parse
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.actions import ACTIONS
from steptwin.simulation.world.inputs import ExternalInput
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.simulation.world.snapshotlog import replay

FORMAT = 1
LONGEST_NUMBER = 100
"""Limit of the digits of a whole number; permitted values have far fewer."""

_STEPS = {kind.__name__: kind for kind in ACTIONS}


RECORDING_ENDS_BEFORE = Message("files.recording-ends-before", "the recording ends at {until:g} s, before {end:g} s")
RECORDING_ENDS_BEFORE_AN_INPUT = Message(
    "files.recording-ends-before-an-input", "the recording ends at {until} ns, before an input at {time} ns"
)


@dataclass(frozen=True, slots=True)
class Recording:
    """A run of a world. ``digest`` is that of its trace at ``until``; ``firmware`` is that of each MIC488, or the type of an
    M1486: the variant of its data sheet."""

    name: str
    text: str
    files: Mapping[str, bytes]
    firmware: Mapping[str, str]
    seed: int
    inputs: tuple[RecordedInput, ...]
    until: Nanos
    digest: str
    overrides: Overrides = field(default_factory=dict)
    """Values that replace those of the text."""
    version: str = __version__
    failed_saves: tuple[FailedSave, ...] = ()
    """Failed saves of memory, which are part of the inputs."""

    def world(self, *, keep_trace: bool = True, keep_inputs: bool = True) -> World:
        """The world at its beginning. Raises `WorldError`, and `Misuse` where the firmware is not the description's."""
        world = World(
            Blueprint(read_world(self.name, self.text, self.seed, self.overrides, given_files(self.files)), self.files),
            keep_trace=keep_trace,
            keep_inputs=keep_inputs,
            failing=self.failed_saves,
        )
        ran = _firmwares(world)
        for name, firmware in self.firmware.items():
            if ran.get(name) != firmware:
                raise Misuse(f"{name} is {firmware} in the recording, but its world has {ran.get(name, 'no such controller')}")
        return world

    def replay(
        self,
        until: Nanos | None = None,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        begun: Callable[[World], object] = lambda world: None,
    ) -> World:
        """The world after all inputs, or after those up to the moment ``until`` (ns), from which it may continue differently.
        ``begun`` is called with it at its beginning.

        Raises `Misuse` where inputs do not fit the world, and for a moment after the end of the recording.
        """
        end = self.until if until is None else until
        if end > self.until:
            raise Misuse(RECORDING_ENDS_BEFORE(until=self.until / SECOND, end=end / SECOND))
        world = self.world(keep_trace=keep_trace, keep_inputs=keep_inputs)
        if self.inputs and self.inputs[-1].time > self.until:
            raise Misuse(RECORDING_ENDS_BEFORE_AN_INPUT(until=self.until, time=self.inputs[-1].time))
        begun(world)
        for _ in replay(world, self.inputs, end):
            pass
        return world


def _settle(world: World) -> None:
    """A recording ends when everything of its last moment has happened."""
    world.advance(world.now)
    world.sync_all()


def _firmwares(world: World) -> dict[str, str]:
    """The firmware, or type, of every controller that has one."""
    sheets = {name: world.kind(name).datasheet(controller) for name, controller in world.controllers.items()}
    return {name: sheet.variant for name, sheet in sheets.items() if sheet.variant}


NOTHING_IS_RECORDED = Message("files.nothing-is-recorded", "this world is not recorded: it does not keep its inputs")


def recording_of(world: World) -> Recording:
    """The recording of a world up to now. It contains the inputs of Python code, not the code.

    Raises `Misuse` for a world that does not keep its inputs.
    """
    if not world.keeps_inputs:
        raise Misuse(NOTHING_IS_RECORDED())
    _settle(world)
    spec = world.spec
    return Recording(
        spec.text.source.name,
        spec.text.source.text,
        world.files,
        _firmwares(world),
        spec.seed,
        tuple(world.inputs),
        world.now,
        world.trace.digest(),
        spec.overrides,
        failed_saves=tuple(world.failed_saves),
    )


def save(recording: Recording, path: Path | str) -> None:
    """Write a recording, as JSON. Raises `Misuse` when the file cannot be written."""
    write_bytes(Path(path), "".join(text_of(recording)).encode())


def text_of(recording: Recording) -> Iterator[str]:
    """Parts of its file, each of one input after the first: all of them may take seconds."""
    data = {
        "steptwin_session": FORMAT,
        "version": recording.version,
        "name": recording.name,
        "seed": recording.seed,
        "overrides": dict(recording.overrides),
        "firmware": dict(recording.firmware),
        "until_ns": recording.until,
        "digest": recording.digest,
        "world": recording.text,
        "files": {name: b64encode(content).decode() for name, content in recording.files.items()},
        "failed_saves": [
            {"time_ns": time, "machine": controller, "reason": text} for time, controller, text in recording.failed_saves
        ],
    }
    yield json.dumps(data, indent=1).removesuffix("\n}") + ',\n "inputs": ['
    between = "\n"
    for time, what, settled in recording.inputs:
        given = {"time_ns": time, "settled": settled, "do": type(what).__name__, **_to_json(what)}
        yield between + indent(json.dumps(given, indent=1), "  ")
        between = ",\n"
    yield "\n ]\n}\n" if recording.inputs else "]\n}\n"


RECORDING_OF_ANOTHER_FORMAT = Message(
    "files.recording-of-another-format", "{path} is a recording of format {format}: this version reads {own}"
)


def load(path: Path | str) -> Recording:
    """Read a recording. Raises `Misuse` for a file that cannot be read or is not a recording."""
    return finish(loading(path))


def loading(path: Path | str, most: int = MOST_RECORDED_BYTES) -> Generator[None, None, Recording]:
    """As `load`, in parts, a file of at most ``most`` bytes."""
    content = read_recorded(Path(path), most)
    try:
        data = json.loads(content, parse_int=_whole, parse_constant=_finite)
        if data["steptwin_session"] != FORMAT:
            raise Misuse(RECORDING_OF_ANOTHER_FORMAT(path=path, format=data["steptwin_session"], own=FORMAT))
        return (yield from _recording(data))
    except (LookupError, TypeError, ValueError, RecursionError, OverflowError, AttributeError) as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{path} is not a recording of a world: {_why(error)}") from None


def _whole(text: str) -> int:
    if len(text) > LONGEST_NUMBER:
        raise ValueError(f"a number has {len(text)} digits")
    return int(text)


def _finite(text: str) -> float:
    raise ValueError(f"{text} is not a number of a recording")


def _why(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"{error} is missing"
    return "it is nested too deeply" if isinstance(error, RecursionError) else str(error)


def _recording(data: Mapping[str, Any]) -> Generator[None, None, Recording]:
    """Raises `LookupError`, `TypeError` and `ValueError` for what is not a recording."""
    until = fitting("until_ns", data["until_ns"], int)
    if not 0 <= until <= LONGEST_NS:
        raise ValueError(f"until_ns is {until}: permitted are 0 to {LONGEST_NS}")
    inputs: list[RecordedInput] = []
    for item in fitting("inputs", data["inputs"], list):
        inputs.append(_input(fitting("an input", item, dict)))
        yield
    times = [given.time for given in inputs]
    if times != sorted(times) or (times and times[0] < 0):
        raise ValueError("the moments of the inputs are not in order")
    return Recording(
        fitting("name", data["name"], str),
        fitting("world", data["world"], str),
        {name: b64decode(content) for name, content in fitting("files", data["files"], dict).items()},
        {
            name: fitting(f"firmware of {name}", firmware, str)
            for name, firmware in fitting("firmware", data["firmware"], dict).items()
        },
        fitting("seed", data["seed"], int),
        tuple(inputs),
        until,
        fitting("digest", data["digest"], str),
        fitting("overrides", data.get("overrides", {}), dict),
        fitting("version", data["version"], str),
        tuple(_failed(item) for item in fitting("failed_saves", data.get("failed_saves", []), list)),
    )


def _failed(item: object) -> FailedSave:
    failed = fitting("a failed save", item, dict)
    return FailedSave(
        fitting("time_ns", failed["time_ns"], int),
        fitting("machine", failed["machine"], str),
        fitting("reason", failed["reason"], str),
    )


KEYS = {"controller": "machine"}
"""Keys of recorded inputs that differ from their attributes, so that older recordings can be read."""
ATTRIBUTES = {key: name for name, key in KEYS.items()}


def _to_json(what: ExternalInput) -> dict[str, Any]:
    if isinstance(what, tuple):
        return {KEYS.get(name, name): _value(value) for name, value in what._asdict().items()}
    named = fields(what) if is_dataclass(what) else ()
    return {KEYS.get(field.name, field.name): _value(getattr(what, field.name)) for field in named}


def _value(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"hex": value.hex()}
    if isinstance(value, Fault):
        return {"kind": value.kind.name, "name": value.name, **{key: _value(item) for key, item in value.given.items()}}
    if isinstance(value, tuple):
        return [_value(item) for item in value]
    return value


_hints = cache(get_type_hints)


def _input(item: dict[str, Any]) -> RecordedInput:
    kind = _STEPS[item["do"]]
    values = {ATTRIBUTES.get(key, key): _back(value) for key, value in item.items() if key not in ("time_ns", "settled", "do")}
    if kind is do.SetFault:
        item_fault = fitting("fault of SetFault", item["fault"], dict)
        fault = {key: tuple(value) if isinstance(value, list) else value for key, value in item_fault.items()}
        values = {"fault": parse({key: value for key, value in fault.items() if value != ""})}
    for name, wanted in _hints(kind).items():
        if name in values:
            fitting(f"{name} of {item['do']}", values[name], wanted)
    return RecordedInput(fitting("time_ns", item["time_ns"], int), kind(**values), fitting("settled", item["settled"], bool))


def _back(value: Any) -> Any:
    if isinstance(value, dict) and "hex" in value:
        return bytes.fromhex(value["hex"])
    if isinstance(value, list):
        return tuple(_back(item) for item in value)
    return value
