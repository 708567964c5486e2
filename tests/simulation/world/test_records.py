"""What is shown of a world: of whom, and which kinds."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.world.records import ALL, SHOWN, Selection, describe, named_in, read_selection, shown_kind

TEXT = """
[[mic488]]
name = "a"
[[m1486]]
name = "c"
[[button]]
name = "start"
to = "a.IN5"
[[cylinder]]
name = "clamp"
extend = "a.OUT1"
[[collision]]
name = "crash"
when = "clamp.position > 30 and a.IN5"
[[script]]
name = "s"
steps = [
  { set = { "a.IN3" = 1, "c.B3" = 0 } },
  { write = { "a.OUT1" = 1 } },
  { wait = "2 s" },
  { press = "start" },
  { note = "pressed" },
  { fault = { kind = "no-air", element = "clamp" } },
  { expect = "a.OUT2" },
]
"""

STALLING = """
[[mic488]]
name = "a"
[mic488.M1]
gear = 3200.0
acc = 1000.0
vel = 10.0
mot_resol = 3200
[[axis]]
name = "slide"
drive = "a.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 0.01], [1500, 0.005]]
inertia = 0.0002
start_speed = 60
[[script]]
name = "s"
steps = [
  { note = "slide has no load" },
  { write = { "a.M1_EN" = 1, "a.M1_POS_ABS" = 5 } },
]
"""


@pytest.fixture(scope="module")
def ran() -> World:
    world = World.from_toml(TEXT)
    world.run(for_=3)
    return world


def shown(world: World, names: str = "", kinds: str = "") -> list[str]:
    selection = read_selection([names], [kinds], named_in(world.objects))
    return [describe(record)[16:].strip() for record in world.trace if selection.shows(record)]


def test_all_without_a_selection(ran: World) -> None:
    assert {shown_kind(record) for record in ran.trace if ALL.shows(record)} <= set(SHOWN)
    assert shown(ran) == [describe(record)[16:].strip() for record in ran.trace if Selection().shows(record)]


def test_by_kind(ran: World) -> None:
    assert shown(ran, kinds="note, report") == ["world      note: pressed", "world      expectation: a.OUT2; a.OUT2 is 0"]
    assert shown(ran, kinds="button") == ["a          start: pressed"]
    assert shown(ran, kinds="fault") == ["clamp      no-air: clamp has no air"]


def test_by_name(ran: World) -> None:
    """A controller, an element that is recorded at its controller, what scripts do."""
    assert all(text.startswith("c ") for text in shown(ran, "c"))
    assert not any(text.startswith(("clamp", "crash")) for text in shown(ran, "a"))
    assert shown(ran, "clamp") == ["clamp      no-air: clamp has no air"]
    assert shown(ran, "crash") == ["crash      crash: parts touch", "crash      crash: apart again"]
    assert shown(ran, "start") == ["a          start: pressed"]
    assert shown(ran, "world", "note") == ["world      note: pressed"]
    assert shown(ran, "clamp", "note") == []


def test_names_are_no_words_of_a_text() -> None:
    """A note may begin with the name of an element, and an axis that stalls has its name among the facts."""
    world = World.from_toml(STALLING)
    world.run(for_=3)
    assert shown(world, "slide")[0] == "slide      slide stalls: the motion needs 1.26 N·m, the motor has 0.01 N·m"
    assert shown(world, "world") == ["world      note: slide has no load"]


def test_unknown_ones_are_refused(ran: World) -> None:
    with pytest.raises(Misuse, match=r"^--of clmp \(did you mean 'clamp'\?\): there are a, c, .*clamp.*, world$"):
        shown(ran, "clmp")
    with pytest.raises(Misuse, match=r"^--show notes \(did you mean 'note'\?\): there are program, status, note, report, "):
        shown(ran, kinds="notes")
    many = [f"machine{number}" for number in range(1000)]
    for count, last in ((1000, "machine19 and 981 more"), (20, "machine19 and 1 more"), (19, "machine18, world")):
        with pytest.raises(Misuse, match=f"{last}$"):
            read_selection(["other"], [], many[:count])


def test_what_a_name_has_belongs_to_it() -> None:
    selection = Selection(frozenset({"clamp"}))
    names = ("clamp", "clamp.position", "x.clamp", "clam", "")
    assert [name for name in names if selection.takes_of(name)] == ["clamp", "clamp.position"]
    assert selection.takes_of("x", "clamp.position")
    assert Selection().takes_of("x")
