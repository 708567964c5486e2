"""The beginning of a world: its description, or a moment of a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.textfiles import check_writable
from steptwin.files.world import World
from steptwin.files.writing import is_written_directly
from steptwin.messages import Message
from steptwin.simulation.describe.overrides import NO_OVERRIDES, Overrides
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do

RECORDING_SUFFIX = ".json"


def is_recording(path: Path) -> bool:
    """Whether a file is a recording; others are descriptions."""
    return path.suffix.lower() == RECORDING_SUFFIX


WRONG_SUFFIX_OF_A_RECORDING = Message(
    "files.wrong-suffix-of-a-recording", "{path}: the name of a recording must end with {suffix}"
)


def check_recording_target(path: Path) -> None:
    """Check that a recording can be written to a path, and that its name ends as that of a recording. Raises `Misuse`."""
    if not is_recording(path) and not is_written_directly(path):
        raise Misuse(WRONG_SUFFIX_OF_A_RECORDING(path=path, suffix=RECORDING_SUFFIX))
    check_writable(path)


def load_world(
    path: Path,
    warn: Callable[[str], object],
    *,
    moment: Nanos | None = None,
    seed: int | None = None,
    overrides: Overrides = NO_OVERRIDES,
    keep_trace: bool = True,
    keep_inputs: bool = True,
    allow_outside: bool = False,
    state: Path | None = None,
    begun: Callable[[World], object] = lambda world: None,
) -> World:
    """The world that a file describes; that of a recording at its end, or at ``moment`` (ns) with all inputs up to then.

    ``warn`` is called with warnings, ``begun`` with the world at 0 s. Raises `Misuse`.
    """
    if not is_recording(path):
        if moment is not None:
            raise Misuse(f"--from: {path} is not a recording; a description begins at 0 s")
        world = World.load(
            path,
            seed=seed,
            overrides=overrides,
            keep_trace=keep_trace,
            keep_inputs=keep_inputs,
            allow_outside=allow_outside,
            state=state,
        )
        for warning in world.blueprint.warnings:
            warn(warning)
        begun(world)
        return world
    if seed is not None:
        raise Misuse(f"--seed: {path} is a recording, which continues with its own seed")
    if overrides:
        raise Misuse(f"--with: {path} is a recording, which continues with its own values")
    if state is not None:
        raise Misuse(f"--state: {path} is a recording, which continues with its own memory")
    recording = recordings.load(path)
    world = recording.replay(moment, keep_trace=keep_trace, keep_inputs=keep_inputs, begun=begun)
    if moment is None and world.trace.digest() != recording.digest:
        warn(
            f"{path}: the replay differs from the run recorded with steptwin {recording.version}; the world continues from the "
            "replay"
        )
    world.go_on()
    return world


def set_faults(world: World, faults: Sequence[str]) -> None:
    """Set faults of the command line. Raises `Misuse`."""
    for fault in faults:
        world.apply_input(do.SetFault(read_fault(fault)))
