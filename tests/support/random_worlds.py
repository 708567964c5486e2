"""Small worlds with values by chance, and rules that hold for each of them.

A world is made of a `Scene`, a description with gaps (`Chance.filled`). What begins with ``?``, a line or a whole table, is left
out by chance. ``! kind = ...`` is a fault, of the description or of a step. ``* condition`` is an event.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice

from axis_scenes import AXIS_SCENES
from belt_scenes import BELT_SCENES
from chance import Chance
from machine_scenes import MACHINE_SCENES
from plant_scenes import PLANT_SCENES
from scenes import Scene
from workpiece_scenes import WORKPIECE_SCENES

from steptwin.controller import SECOND, Nanos
from steptwin.diagnostics import Severity
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.describe.steptable import read_steps
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.toml.reader import TomlText, WorldError
from steptwin.simulation.world.actions import ACTIONS
from steptwin.simulation.world.check import diagnose
from steptwin.simulation.world.inputs import Bytes, Download, Leave, See, SetVariable
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshotlog import PastWorld, SnapshotLog
from steptwin.simulation.world.unfinished import unfinished
from steptwin.simulation.world.views import MechanicsView
from steptwin.simulation.world.worldprograms import WorldPrograms
from steptwin.wire.crc import with_crc

STEPS = 16
MOMENTS = 7
TURNS = 3
WRONG = 16
END_S = 1.5
SCENES = BELT_SCENES | AXIS_SCENES | MACHINE_SCENES | PLANT_SCENES | WORKPIECE_SCENES


def described(chance: Chance, scene: Scene) -> tuple[str, list[str]]:
    """The description of a world, and a step from outside for each of the moments."""
    tables: list[str] = [f"[world]\nseed = {chance.below(99)}"]
    steps = scene.steps.split("\n")
    is_left_out = False
    for number, line in enumerate(scene.tables.split("\n")):
        if not line:
            is_left_out = False
        elif line.startswith("?") and not chance.is_so():
            is_left_out = is_left_out or line.startswith("?[")
        elif line.startswith("! "):
            table, step = fault(chance, line[2:], f"fault-{number}")
            tables.append(table)
            steps.append(step)
        elif line.startswith("* "):
            once = "true" if chance.below(2) else "false"
            note = f"steps = [{{ note = 'event {number}' }}]"
            tables.append(f'[[event]]\nwhen = "{chance.filled(line[2:])}"\nonce = {once}\n{note}')
        elif not is_left_out:
            tables += chance.filled(line.removeprefix("?")).split("; ")
    others = [step for step in steps if step.startswith("{ ")]

    def drawn(number: int, among: list[str]) -> list[str]:
        return [chance.filled(among[chance.below(len(among))]) for _ in range(number)]

    first = [chance.filled(step[2:]) for step in steps if step.startswith("+ ")]
    hand = [f"  {step}, {{ wait = '{chance.number('0', '120')} ms' }},\n" for step in (*first, *drawn(STEPS, others))]
    text = "\n".join([*tables, f"[[script]]\nname = 'hand'\nsteps = [\n{''.join(hand)}]\n"])
    return text, drawn(MOMENTS, [step for step in steps if step[:2] in ("{ ", "@ ") and "fault" not in step])


def fault(chance: Chance, line: str, name: str) -> tuple[str, str]:
    """A fault as a table of the description, or as steps that set and clear it; or neither."""
    given = chance.filled(line)
    if not chance.is_so():
        return "", ""
    if chance.below(3) == 0:
        wait = f"{{ wait = '{chance.number('5', '90')} ms' }}"
        return "", f"{{ fault = {{ {given}, name = '{name}' }} }}, {wait}, {{ clear_fault = '{name}' }}"
    if "_s = " not in given and "for_ms" not in given:
        given = f"{given}, from_s = {chance.number('0.1', '0.6')}, until_s = {chance.number('0.8', '1.4')}"
    return "[[fault]]\n" + given.replace(", ", "\n"), ""


def check_it_goes_on_alike(name: str, seed: int) -> None:
    """What a world shows and does is the same when it goes on from a snapshot, goes back to its past, and is replayed."""
    chance, scene = Chance(name, seed), SCENES[name]
    text, from_outside = described(chance, scene)
    files = {file: chance.filled(content).encode() for file, content in scene.files.items()}
    world = World.from_toml(text, files)
    assert [str(read_fault(str(one))) for one in world.spec.faults] == [str(one) for one in world.spec.faults]
    snapshots = SnapshotLog(world)
    moments = sorted(chance.below(round(END_S * SECOND)) for _ in range(MOMENTS))
    steps = list(zip(moments, from_outside, strict=True))
    cut = chance.below(MOMENTS)
    go_on(world, steps[:cut], moments[cut], files)
    do_from_outside(world, steps[cut][1], files)
    snapshots.take()
    snapshot = world.snapshot()
    go_on(world, steps[cut + 1 :], round(END_S * SECOND), files)
    end, digest = shown(world), world.trace.digest()
    check_past(snapshots, chance.below(round(END_S * SECOND)))
    assert recording_of(world).replay().trace.digest() == digest
    other = world if chance.below(2) else world.branch(snapshot)
    other.restore(snapshot)
    go_on(other, steps[cut + 1 :], round(END_S * SECOND), files)
    assert shown(other) == end
    assert other.trace.digest() == digest


def check_past(snapshots: SnapshotLog, moment: int) -> None:
    """Another world that goes back to a moment and then to the end shows the same there."""
    snapshots.take()
    past = PastWorld(snapshots)
    for until in (moment, snapshots.world.now):
        for _ in past.go(until):
            pass
    snapshots.close()
    assert seen_of_controllers(past.world) == seen_of_controllers(snapshots.world)


def go_on(world: World, steps: list[tuple[int, str]], end: int, files: Mapping[str, bytes]) -> None:
    """Do steps at their moments, and run on to the end; who looks on does not matter."""
    for moment, step in steps:
        world.run(until=moment / SECOND)
        shown(world)
        do_from_outside(world, step, files)
    world.run(until=end / SECOND)


def do_from_outside(world: World, text: str, files: Mapping[str, bytes]) -> None:
    """Do now, as somebody outside of the world, a step of a description, or what no description has, as far as it can be done."""
    if not text.startswith("@ "):
        toml = TomlText("steps", f"steps = [{text}]")
        for step in read_steps(toml, ("steps",), toml.data["steps"]):
            if type(step) in ACTIONS:
                with suppress(Refusal):  # no room, or no such workpiece
                    world.apply_input(step)
            else:
                world.at(world.time, step)
        return
    with suppress(Misuse, Refusal):
        match text[2:].split():
            case ["see", controller, *numbers]:
                world.apply_input(See(controller, *map(float, numbers)))
            case ["variable", controller, variable, value]:
                world.apply_input(SetVariable(controller, variable, float(value)))
            case ["download", controller, place, file]:
                world.apply_input(Download(controller, place.replace("_", " "), files[file].decode()))
            case [line, "tcp", data]:
                request = bytes.fromhex(data)
                world.apply_input(Bytes(line, "host", "tcp", bytes((0, 1, 0, 0, 0, len(request))) + request))
            case [line, "leave"]:
                world.apply_input(Leave(line, "python"))
            case [line, data]:
                world.line[line].send(with_crc(bytes.fromhex(data)))


def shown(world: Simulation) -> list[str]:
    """What a viewer sees of it, and what scripts wait for."""
    return [f"stopped: {world.stopped}", *seen_of_controllers(world), *(repr(one) for one in unfinished(world))]


def seen_of_controllers(world: Simulation) -> list[str]:
    """Signals of elements, controllers and axes."""
    found = [f"{world.now}"]
    for name in world.objects.element_names:
        signals = world.objects.element_signals(name) or {}
        found += [told_of(f"{name}.{signal}", of, world.now) for signal, of in signals.items()]
    for name, fitted in world.axes.items():
        axis = MechanicsView(world, fitted)
        found.append(f"{name} {axis.position:.9g} {axis.rotor:.9g} {axis.lost} {axis.stalled}")
    for name in world.controllers:
        world.sync(name)
        found.append(repr(world.kind(name).state(world.controllers[name], world.now)))
    for programs in world.programs.values():
        found.append(repr((programs.stack(world.now), dict(programs.variables(world.now)), programs.depth())))
    found.append(repr(WorldPrograms(world).list()))
    return found


def told_of(name: str, signal: SignalOf, now: Nanos) -> str:
    """A signal: its value, unit and bounds, and where it may turn next."""
    signal.sync(now)
    turning_points = list(islice(signal.turning(now), TURNS)) if signal.turning is not None else []
    return f"{name} {signal.value(now):.9g} {signal.unit} {signal.bounds} {turning_points}"


VALUES = ("0", "-1", "1e300", "''", "'x'", "'c.IN1'", "'c.OUT1'", "'c.M1'", "[]", "[[0, 1]]", "true", "'10 ms'", "{}")


def check_mistakes_are_found(name: str, seed: int) -> None:
    """A description with one or two mistakes by chance has an error at a place of its text, or can be built."""
    chance, scene = Chance(name, seed), SCENES[name]
    text, _ = described(chance, scene)
    files = {file: chance.filled(content).encode() for file, content in scene.files.items()}
    for _ in range(WRONG):
        lines = text.split("\n")
        for _ in range(1 + chance.below(2)):
            damage(chance, lines)
        mistaken = "\n".join(lines)
        findings = diagnose("w.toml", mistaken, given_files(files)).findings
        assert all(0 <= one.span.start <= one.span.end <= len(mistaken) for one in findings), mistaken
        try:
            World.from_toml(mistaken, files)
        except WorldError:
            can_be_built = False
        else:
            can_be_built = True
        assert can_be_built is not any(one.severity is Severity.ERROR for one in findings), mistaken


def damage(chance: Chance, lines: list[str]) -> None:
    """A mistake in a description."""
    there = [number for number, line in enumerate(lines) if line.strip()]
    at, other = there[chance.below(len(there))], there[chance.below(len(there))]
    line = lines[at]
    key, sign, value = line.partition(" = ")
    words = re.findall(r"[A-Za-z_][A-Za-z_0-9]+", value)
    match chance.below(8):
        case 0:
            lines[at] = ""
        case 1:
            lines.insert(other, line)
        case 2:
            lines[at] = f"{key}{sign}{VALUES[chance.below(len(VALUES))]}" if sign else f"[{line}]"
        case 3:
            lines[at] = f"{key}{sign}{lines[other].partition(' = ')[2] or '7'}"
        case 4 if sign:
            lines[at] = f"{key}{key[-1]}{sign}{value}"
        case 5 if sign:
            lines[at] = re.sub(r"\d+\.?\d*", ("0", "1000000", "-3")[chance.below(3)], line, count=1)
        case 6:
            lines[at], lines[other] = lines[other], lines[at]
        case _ if words:
            word = words[chance.below(len(words))]
            lines[at] = line.replace(word, word + word[-1] if chance.below(2) else word[:-1])
