"""Faults of a described world: on its lines, at its switches, at the load of an axis."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script.steps import ClearFault

WORLD = """
[world]
seed = 11

[[line]]
name = "bus"
kind = "modbus"
timing = "real"

[[mic488]]
name = "table"
line = "bus"
[mic488.M1]
gear = 100.0
acc = 100.0
dec = 100.0
vel = 50.0
enc_resol = 400
mot_resol = 100

[[axis]]
name = "x"
drive = "table.M1"
pulses_per_unit = 100
[axis.encoder]
counts_per_rev = 400

[[button]]
name = "start"
to = "table.IN5"

[[script]]
name = "operator"
steps = [
  { write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 100.0 } },
  { wait = "300 ms" },
  { press = "start", for = "200 ms" },
  { write = { "table.M1_VMAX" = 40.0 } },
  { wait = "300 ms" },
  { write = { "table.M1_VMAX" = 50.0 } },
]
"""

FAULTS = """
[[fault]]
kind = "lost-steps"
pulses = 40
at_s = 1.0

[[fault]]
kind = "bounce"
pin = "IN5"

[[fault]]
kind = "crc"
probability = 0.5

[[fault]]
kind = "gap"
probability = 0.1
for_ms = 12
"""


def test_lost_steps_of_a_described_axis_are_lost_by_its_load() -> None:
    sound, spoilt = World.from_toml(WORLD), World.from_toml(WORLD + FAULTS)
    for world in (sound, spoilt):
        world.run(for_="10 s")
    assert sound.read("x.position") == pytest.approx(100.0)
    assert spoilt.read("x.position") == pytest.approx(99.6)
    assert spoilt.read("table.M1.position") == pytest.approx(100.0)


DRUM = """
[[line]]
name = "chips"
kind = "m1486"

[[m1486]]
name = "drum"
line = "chips"
address = 3

[[axis]]
name = "y"
kind = "rotary"
unit = "rev"
pulses_per_rev = 12800
drive = "drum.M1"

[[fault]]
kind = "lost-steps"
machine = "drum"
pulses = 400
at_s = 2.0

[[fault]]
kind = "stall"
machine = "drum"
at_s = 5.0
for_s = 0.01
"""


def test_the_load_of_an_m1486_is_what_stalls_and_loses_steps() -> None:
    world = World.from_toml(DRUM)
    world.line["chips"].send(b"x3\rf12800\rr\r")
    world.run(for_=1.5)
    assert world.axis["y"].position == 1.0
    world.run(for_=1.0)
    assert world.axis["y"].lost == 400
    assert world.axis["y"].position == pytest.approx(1.0 - 400 / 12800)
    world.run(until="time >= 4.9", for_=10)
    world.line["chips"].send(b"f12800\rr\r")
    world.run(for_=2.0)
    assert world.axis["y"].lost > 400
    assert world.read("drum.position") == 25600
    bare = World.from_toml(DRUM.partition("[[axis]]")[0])
    with pytest.raises(Misuse, match="fault stall: 'drum' has no shaft"):
        bare.put_fault(read("stall at_s=1 for_s=1"))


def test_what_goes_wrong_is_in_the_trace_and_two_runs_share_it() -> None:
    worlds = [World.from_toml(WORLD + FAULTS) for _ in range(2)]
    for world in worlds:
        world.run(for_="10 s")
    first, second = worlds
    assert first.trace.digest() == second.trace.digest()
    assert {record.subject for record in first.trace.faults()} == {"lost-steps", "bounce", "crc", "gap"}
    other = World.from_toml(WORLD.replace("seed = 11", "seed = 12") + FAULTS)
    other.run(for_="10 s")
    assert other.trace.digest() != first.trace.digest()


@settings(max_examples=10)
@given(st.floats(0.0, 2.0))
def test_a_snapshot_at_any_moment_changes_nothing(moment: float) -> None:
    world = World.from_toml(WORLD + FAULTS)
    world.run(for_="3 s")
    digest = world.trace.digest()
    world = World.from_toml(WORLD + FAULTS)
    world.run(for_=f"{moment:.9f} s")
    snapshot = world.snapshot()
    world.run(for_="0.7 s")
    world.restore(snapshot)
    world.run(for_=f"{3.0 - round(moment, 9):.9f} s")
    assert world.trace.digest() == digest


# ---------------------------------------------------------------------- faults where they can happen

NETWORK = """
[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
unit = 4
"""
CHIPS = """
[[line]]
name = "chips"
kind = "m1486"
pty = "/tmp/chips"
[[m1486]]
name = "drum"
line = "chips"
address = 3
[[axis]]
name = "y"
drive = "drum.M1"
"""
LINELESS = '[[mic488]]\nname = "alone"\n'

ON_TCP = "line 'bus' carries Modbus TCP, where gap, split, delay, no-answer, late, wrong-unit, exception, busy can happen"
ON_CHIPS = "line 'chips' carries M1486, where flip, drop, insert, gap, split, noise can happen"


@pytest.mark.parametrize(
    ("world", "fault", "message"),
    [
        (
            NETWORK,
            "crc",
            f"fault crc happens on Modbus RTU: {ON_TCP}; with link=script it happens to the scripts' own requests, as Modbus RTU",
        ),
        (NETWORK, "noise", "fault noise happens on Modbus RTU and M1486: line 'bus' carries Modbus TCP, where"),
        (NETWORK, "crc link=tcp-1", f"fault crc happens on Modbus RTU: {ON_TCP}"),
        (NETWORK, "delay link=pty", "fault delay: link = 'pty': there are tcp, script"),
        (NETWORK, "delay link=tcp-x", "fault delay: link = 'tcp-x': there are tcp, script"),
        (NETWORK, "busy unit=1", "fault busy: unit = 1: served are 4"),
        (CHIPS, "crc", f"fault crc happens on Modbus RTU: {ON_CHIPS}"),
        (CHIPS, "exception", f"fault exception happens on Modbus RTU and Modbus TCP: {ON_CHIPS}"),
        (CHIPS + NETWORK, "crc", f"fault crc happens on Modbus RTU: {ON_CHIPS}; {ON_TCP}; with link=script"),
        (CHIPS, "slip", "fault slip: 'drum' is an M1486, which reads no encoder"),
        (CHIPS, "wear", "fault wear: 'drum' saves nothing: it has no memory that survives power-off"),
        (LINELESS, "gap", "fault gap happens on Modbus RTU and Modbus TCP and M1486: 'alone' is on no line"),
        (LINELESS, "no-answer", "fault no-answer happens on Modbus RTU and Modbus TCP: 'alone' is on no line"),
        (LINELESS, "busy unit=2", "fault busy: unit = 2: served are 1"),
        (LINELESS, "bounce pin=AIN1", "fault bounce: pin = 'AIN1' is an analog input, which has no switch"),
    ],
)
def test_a_fault_that_cannot_happen_is_refused_from_files_and_from_python(world: str, fault: str, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        World.from_toml(world).put_fault(read(fault))
    assert str(refused.value).startswith(message)
    kind, *words = fault.split()
    table = "".join(
        f"{key} = {value if value.isdecimal() else repr(value)}\n" for key, _, value in (w.partition("=") for w in words)
    )
    with pytest.raises(Misuse) as refused:
        World.from_toml(f'{world}[[fault]]\nkind = "{kind}"\n{table}')
    line = world.count("\n") + 1
    assert message in str(refused.value)
    assert f"world.toml:{line}:" in str(refused.value)
    given = ", ".join([f"kind = '{kind}'", *table.splitlines()])
    with pytest.raises(Misuse) as refused:
        World.from_toml(f"{world}[[event]]\nat = 1\nsteps = [{{ fault = {{ {given} }} }}]\n")
    assert f"step 1: {message}" in str(refused.value)


def test_who_is_connected_counts_as_well() -> None:
    world = World.from_toml(NETWORK.replace('tcp = "127.0.0.1:0"', ""))
    world.fault_setup.check(read("crc"))
    world.lines["bus"].connect("test-1", "tcp")
    world.fault_setup.check(read("delay link=test-1"))
    with pytest.raises(Misuse, match="line 'bus' carries Modbus TCP"):
        world.fault_setup.check(read("crc"))


@pytest.mark.parametrize(
    ("world", "fault"),
    [
        (NETWORK, "crc link=script"),
        (NETWORK, "gap link=tcp-12 direction=in"),
        (NETWORK.replace("[[mic488]]", 'pty = "/tmp/bus"\n[[mic488]]'), "crc"),
        (NETWORK.replace("[[mic488]]", 'rtu_tcp = "127.0.0.1:0"\n[[mic488]]'), "noise link=rtu-2"),
        (CHIPS, "noise link=pty"),
        (CHIPS + NETWORK, "flip"),
        (CHIPS.replace("[[axis]]", 'variant = "E1"\n[[axis]]'), "wear"),
        (LINELESS, "busy unit=1"),
        (LINELESS, "no-answer lost=request"),
    ],
)
def test_a_fault_that_can_happen_is_taken(world: str, fault: str) -> None:
    found = World.from_toml(world)
    found.put_fault(read(fault))
    assert [str(active.fault) for active in found.objects.faults.active] == [fault]


# ---------------------------------------------------------------------- faults of one line alone

TWO_LINES = """
[[line]]
name = "a"
{timing}
[[line]]
name = "b"
{timing}
[[mic488]]
name = "s"
line = "a"
[[mic488]]
name = "t"
line = "b"
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "drum"
line = "chips"
address = 3
"""
READ = bytes.fromhex("01 03 27 24 00 02 8e b4")


def answers(world: World, line: str) -> list[bytes]:
    found = []
    for _ in range(3):
        world.line[line].send(READ)
        world.run(for_=0.5)
        found.append(world.line[line].received())
    return found


@pytest.mark.parametrize("timing", ["", 'timing = "real"'])
@pytest.mark.parametrize(
    "fault", ["crc", "delay for_ms=900", "no-answer", "no-answer lost=request", "busy", "exception", "drop", "split for_ms=300"]
)
def test_a_fault_of_one_line_leaves_the_others_alone(fault: str, timing: str) -> None:
    text = TWO_LINES.format(timing=timing)
    sound, spoilt = World.from_toml(text), World.from_toml(text)
    spoilt.put_fault(read(f"{fault} line=b"))
    assert answers(spoilt, "a") == answers(sound, "a")
    assert list(spoilt.trace.faults()) == []
    assert answers(spoilt, "b") != answers(sound, "b")
    assert {record.controller for record in spoilt.trace.faults()} in ({"b"}, {"t"})


def test_bytes_of_chips_are_spared_by_a_fault_of_a_modbus_line() -> None:
    world = World.from_toml(TWO_LINES.format(timing=""))
    world.put_fault(read("drop line=a direction=in"))
    world.line["chips"].send(b"x3\rf12800\rr\r")
    world.run(until="idle")
    assert world.read("drum.position") == 12800
    world.put_fault(read("drop line=chips direction=in"))
    world.line["chips"].send(b"f12800\rr\r")
    world.run(for_=2.0)
    assert world.read("drum.position") == 12800
    first = next(world.trace.faults())
    assert (first.controller, first.value) == ("chips", "python, towards the twin, byte 1 of 9: 66 is lost")


@pytest.mark.parametrize(
    ("fault", "heard"), [("drop nth=2", b"\0"), ("flip nth=2 bit=1", b"\0\2"), ("insert nth=2 value=66", b"\0B\0")]
)
def test_bytes_that_nobody_hears_are_no_occasions(fault: str, heard: bytes) -> None:
    """One program is connected; the scripts of the world send, but read nothing."""
    world = World.from_toml('[[line]]\nname = "chips"\nkind = "m1486"\n[[m1486]]\nname = "a"\naddress = 3\nline = "chips"\n')
    world.put_fault(read(f"{fault} direction=out"))
    world.line["chips"].send(b"x3\rU1\r")
    world.run(for_=0.5)
    world.line["chips"].send(b"U1\r")
    world.run(for_=0.5)
    assert world.line["chips"].received() == heard
    assert [str(record.value).split(",")[0] for record in world.trace.faults()] == ["python"]


def test_the_link_of_a_fault_is_kept_on_a_line_that_takes_its_time() -> None:
    world = World.from_toml(TWO_LINES.format(timing='timing = "real"'))
    world.put_fault(read("busy link=script line=a"))
    world.line["a"].send(READ)
    world.run(for_=0.5)
    assert world.line["a"].received()[1] == 3
    assert list(world.trace.faults()) == []


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("crc line=c", "fault crc: line = 'c': there are a, b, chips"),
        ("crc line=chips", "fault crc happens on Modbus RTU: line 'chips' carries M1486, where flip"),
        ("busy line=a unit=2", "fault busy: unit = 2: served are 1"),
        ("busy line=a link=tcp", "fault busy: link = 'tcp': there are script"),
    ],
)
def test_a_fault_of_a_line_that_is_not_there_or_cannot_have_it_is_refused(fault: str, message: str) -> None:
    with pytest.raises(Misuse) as refused:
        World.from_toml(TWO_LINES.format(timing="")).put_fault(read(fault))
    assert str(refused.value).startswith(message)


# ---------------------------------------------------------------------- faults that steps set and clear

STEPS = '[[mic488]]\nname = "m"\n[[fault]]\nkind = "busy"\nfrom_s = 9\n[[script]]\nname = "s"\nsteps = [\n{steps}\n]\n'


@pytest.mark.parametrize("name", ["slipp", "slip-a", "stall", "slip-2"])
def test_a_fault_that_is_never_set_cannot_be_cleared(name: str) -> None:
    sets = '{ fault = { kind = "slip", name = "mine" } },\n{ fault = { kind = "lost-steps" } },\n'
    steps = f'{sets}{{ clear_fault = "{name}" }},'
    with pytest.raises(Misuse) as refused:
        World.from_toml(STEPS.replace("{steps}", steps))
    assert f"world.toml:11:1: error D009: step 3: no fault {name!r}: set are busy" in str(refused.value)


def test_what_steps_set_and_the_file_sets_can_be_cleared_by_name_or_kind_and_again() -> None:
    steps = """
      { clear_fault = "busy" }, { fault = { kind = "slip", name = "mine" } }, { fault = { kind = "lost-steps" } },
      { repeat = 2, steps = [{ fault = { kind = "stall", for_s = 9 } }] }, { wait = "1 s" },
      { repeat = 2, steps = [{ clear_fault = "mine" }, { clear_fault = "stall-2" }] }, { note = "done" },
    """
    world = World.from_toml(STEPS.replace("{steps}", steps))
    world.run(for_=2)
    assert [active.name for active in world.objects.faults.active] == ["lost-steps", "stall"]
    assert [record.value for record in world.trace if record.subject == "note"] == ["done"]
    with pytest.raises(Misuse, match=r"no fault 'mine': set are lost-steps, stall"):
        world.apply_input(ClearFault("mine"))
    assert world.inputs == []
