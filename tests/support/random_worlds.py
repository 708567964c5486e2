"""Small worlds with values by chance, and all that can be seen of them.

A world is made of a `Scene`, a description with gaps (`Chance.filled`). What begins with ``?``, a line or a whole table, is left
out by chance. ``! kind = ...`` is a fault, of the description or of a step. ``* condition`` is an event.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import islice

from axis_scenes import AXIS_SCENES
from belt_scenes import BELT_SCENES
from chance import Chance
from heard import Listener, faults_as_text
from machine_scenes import MACHINE_SCENES
from plant_scenes import PLANT_SCENES
from scenes import Scene

from steptwin.diagnostics import render, to_json
from steptwin.errors import Misuse, Refusal
from steptwin.files.export import axis_views
from steptwin.files.session import session_of
from steptwin.files.world import World
from steptwin.machine import SECOND, Nanos
from steptwin.motion.divisions import StepTrain
from steptwin.motion.profile import Profile
from steptwin.simulation.describe.overrides import read_overrides
from steptwin.simulation.describe.pieces import given_files
from steptwin.simulation.describe.steptable import read_steps
from steptwin.simulation.kinds.programs import Place, StatementFollower
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.trace import TraceRecord, encode
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.world.actions import ACTIONS
from steptwin.simulation.world.check import diagnose
from steptwin.simulation.world.history import History, Past
from steptwin.simulation.world.inputs import Bytes, Download, Leave, See, SetVariable
from steptwin.simulation.world.plant import Plant
from steptwin.simulation.world.unfinished import unchanged_inputs, waiting
from steptwin.simulation.world.views import MechanicsView
from steptwin.simulation.world.worldprograms import WorldPrograms, program_texts
from steptwin.subject.describe import describe
from steptwin.wire.crc import with_crc

STEPS = 16
MOMENTS = 7
TURNS = 3
WRONG = 16
END_S = 1.5
SCENES = BELT_SCENES | AXIS_SCENES | MACHINE_SCENES | PLANT_SCENES


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


def seen(name: str, seed: int) -> dict[str, list[str]]:
    """What a world is made of, what it shows at some moments, and what has happened in it.

    It is brought back to one of the moments, or another world goes on from there, and its session is replayed: if anything is
    different then, that is said, too.
    """
    chance, scene = Chance(name, seed), SCENES[name]
    text, from_outside = described(chance, scene)
    files = {file: chance.filled(content).encode() for file, content in scene.files.items()}
    world = World.from_toml(text, files)
    statements: list[TraceRecord] = []
    follower = StatementFollower(world.programs, statements.append)
    listener, history = Listener(world), History(world)
    moments = sorted(chance.below(round(END_S * SECOND)) for _ in range(MOMENTS))
    steps = list(zip(moments, from_outside, strict=True))
    cut = chance.below(MOMENTS)
    values = go_on(world, steps[:cut], moments[cut], files)
    values += do_from_outside(world, steps[cut][1], files)
    history.take()
    snapshot = world.snapshot()
    values += go_on(world, steps[cut + 1 :], round(END_S * SECOND), files)
    happened = [repr((*one[:4], shown_value(one), one.facts)) for one in (*world.trace, *statements)]
    follower.close()
    listener.close()
    happened += listener.found + watched(text, files)
    end, digest_there = shown(world), world.trace.digest()
    values += past_of(history, chance.below(round(END_S * SECOND)))
    replayed = session_of(world).replay()
    other = world if chance.below(2) else world.branch(snapshot)
    other.restore(snapshot)
    go_on(other, steps[cut + 1 :], round(END_S * SECOND), files)
    if shown(other) != end:
        values.append("it goes on differently from a snapshot")
    if not replayed.trace.digest() == other.trace.digest() == digest_there:
        values.append("something else happens when it is replayed, or from a snapshot")
    return {"parts": parts(world), "values": values, "trace": happened}


def past_of(history: History, moment: int) -> list[str]:
    """What has changed between its states, and what another world shows that goes back to a moment and then to the end."""
    history.take()
    found = [repr(sorted(history.state_at(history.world.now).changed)), repr(sorted(history.state_at(moment).changed))]
    past = Past(history)
    for _ in past.go(moment):
        pass
    found += shown(past.world)
    for _ in past.go(history.world.now):
        pass
    history.close()
    if seen_of_machines(past.world) != seen_of_machines(history.world):
        found.append("it was different in the past")
    return found


def go_on(world: World, steps: list[tuple[int, str]], end: int, files: Mapping[str, bytes]) -> list[str]:
    """Do steps at their moments, and run on to the end; what the world shows then."""
    found: list[str] = []
    for moment, step in steps:
        world.run(until=moment / SECOND)
        found += [f"due {world.due()}", *shown(world)]
        found += do_from_outside(world, step, files)
    world.run(until=end / SECOND)
    for name, line in world.lines.items():
        there = line.places.get("python")
        if there is not None:
            found.append(repr((name, there.kind, world.line[name].received())))
    return found + shown(world)


def do_from_outside(world: World, text: str, files: Mapping[str, bytes]) -> list[str]:
    """Do now, as somebody outside of the world, a step of a description, or what no description has; why it cannot be done."""
    if not text.startswith("@ "):
        toml = TomlText("steps", f"steps = [{text}]")
        for step in read_steps(toml, ("steps",), toml.data["steps"]):
            if type(step) in ACTIONS:
                world.apply_input(step)
            else:
                world.at(world.time, step)
        return []
    try:
        match text[2:].split():
            case ["see", machine, *numbers]:
                world.apply_input(See(machine, *map(float, numbers)))
            case ["variable", machine, variable, value]:
                world.apply_input(SetVariable(machine, variable, float(value)))
            case ["download", machine, place, file]:
                world.apply_input(Download(machine, place.replace("_", " "), files[file].decode()))
            case [line, "tcp", data]:
                request = bytes.fromhex(data)
                world.apply_input(Bytes(line, "host", "tcp", bytes((0, 1, 0, 0, 0, len(request))) + request))
            case [line, "leave"]:
                world.apply_input(Leave(line, "python"))
            case [line, data]:
                world.line[line].send(with_crc(bytes.fromhex(data)))
    except (Misuse, Refusal) as error:
        return [str(error)]
    return []


def watched(text: str, files: Mapping[str, bytes]) -> list[str]:
    """What programs with a text do in such a world, if nothing comes from outside."""
    if not any(file.endswith(".prg") for file in files):
        return []
    world = World.from_toml(text, files)
    kernels = world.parts.kernel_of
    watches = [world.kind(name).watch_program(machine, kernels[name], name) for name, machine in world.machines.items()]
    world.run(until=END_S)
    acts = [act for watch in watches if watch is not None for act in watch.happened]
    return [repr((act.time, act.text, act.place)) for act in acts]


def shown_value(record: TraceRecord) -> object:
    """Of a motion all that it has, as in the digest of a trace."""
    return encode(record).hex() if isinstance(record.value, Profile | StepTrain) else record.value


def shown(world: Plant) -> list[str]:
    """What a viewer sees of it, and what scripts wait for."""
    return [f"stopped: {world.stopped}", *seen_of_machines(world), *(repr(one) for one in waiting(world))]


def seen_of_machines(world: Plant) -> list[str]:
    """Signals of elements, controllers and axes."""
    found = [f"{world.now}"]
    for name in world.parts.element_names:
        signals = world.parts.element_signals(name) or {}
        found += [told_of(f"{name}.{signal}", of, world.now) for signal, of in signals.items()]
    for name, fitted in world.axes.items():
        axis = MechanicsView(world, fitted)
        found.append(f"{name} {axis.position:.9g} {axis.rotor:.9g} {axis.lost} {axis.stalled}")
    for name in world.machines:
        world.touch(name)
        found.append(repr(world.kind(name).state(world.machines[name], world.now)))
    for programs in world.programs.values():
        found.append(repr((programs.stack(world.now), dict(programs.variables(world.now)), programs.depth())))
    found.append(repr(WorldPrograms(world).list()))
    return found


def told_of(name: str, signal: SignalOf, now: Nanos) -> str:
    """A signal: its value, unit and bounds, and where it may turn next."""
    signal.bring(now)
    turns = list(islice(signal.turning(now), TURNS)) if signal.turning is not None else []
    return f"{name} {signal.value(now):.9g} {signal.unit} {signal.bounds} {turns}"


def parts(world: World) -> list[str]:
    """As viewers and exports get them."""
    there = describe(world)
    found: list[object] = [*there.axes, there.buttons, *there.elements, *there.connections, *there.lines]
    spec = world.spec
    found += [spec.lines, spec.gateways, spec.history, spec.drawing, dict(axis_views(world)), unchanged_inputs(world, 0)]
    return [*(repr(one) for one in found), *faults_as_text(world), *programs_of(world)]


def programs_of(world: World) -> Iterator[str]:
    """What is in the program memories of its controllers, as editors and debuggers get it."""
    yield repr(WorldPrograms(world).files())
    for machine, programs in world.programs.items():
        for place, source in programs.texts.items():
            numbers = range(len(programs.statements(place)))
            yield repr((machine, source.name, programs.statements(place), programs.labels(place), dict(programs.after(place))))
            for number in numbers:
                at = Place(place, number)
                yield repr((programs.use(at), programs.comes_back(at), sorted(programs.reached(place, [number]))))
        for text in program_texts(world, machine):
            yield repr((text.place, to_json(text.source, text.check()), text.memory(text.source.text)))


VALUES = ("0", "-1", "1e300", "''", "'x'", "'c.IN1'", "'c.OUT1'", "'c.M1'", "[]", "[[0, 1]]", "true", "'10 ms'", "{}")


def wrong(name: str, seed: int) -> list[str]:
    """Descriptions with one or two mistakes by chance, or with a value in the place of another; and what is told of each."""
    chance, scene = Chance(name, seed), SCENES[name]
    text, _ = described(chance, scene)
    files = {file: chance.filled(content).encode() for file, content in scene.files.items()}
    found = []
    for _ in range(WRONG):
        lines = text.split("\n")
        found += replaced(chance, text, files)
        for _ in range(1 + chance.below(2)):
            damage(chance, lines)
        found += told("\n".join(lines), files)
    return found


def told(text: str, files: Mapping[str, bytes]) -> list[str]:
    """What is wrong with a description. What is said of a text that is not TOML is Python's."""
    diagnosis = diagnose("w.toml", text, given_files(files))
    if any(one.code == "D001" for one in diagnosis.findings):
        return []
    shown = [f"{one.code} {one.span} {one.message} ({one.hint}) {one.fix}" for one in diagnosis.findings]
    return [text, *shown, *(render(source, of) for source, of in diagnosis.files)]


def replaced(chance: Chance, text: str, files: Mapping[str, bytes]) -> list[str]:
    """What comes of an override of a key of a table by the value of another one."""
    keys = re.findall(r"^([a-z_]+) = (.*)$", text, re.MULTILINE)
    names = re.findall(r"^name = .(\w+).$", text, re.MULTILINE)
    tables = re.findall(r"^\[+(.*?)\]+$", text, re.MULTILINE)
    owner = (names if chance.below(4) else tables)[chance.below(min(len(names), len(tables)))]
    key, value = keys[chance.below(len(keys))][0], keys[chance.below(len(keys))][1]
    given = read_overrides([f"{owner}.{key}={value}"])
    try:
        return [repr(given), *parts(World.from_toml(text, files, overrides=given))]
    except Misuse as error:
        return [repr(given), str(error)]


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
