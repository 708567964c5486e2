"""Worlds with random elements in them, restored at random moments: the same digest as without."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.files.world import World
from steptwin.machine import SECOND
from steptwin.world.elements import ELEMENTS

BASE = """
[[mic488]]
name = "c"
program = "p.prg"
start = true
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 700.0
vel = 90.0
mot_resol = 3200
[mic488.M2]
unit = "mm"
gear = 640.0
acc = 900.0
dec = 700.0
vel = 90.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
travel = [-30.0, 90.0]
backlash = 0.05
[axis.motor]
torque = [[0, 0.8], [900, 0.5], [1500, 0.2]]
inertia = 0.00005
friction = 0.05
load = 0.1
start_speed = 90
when_off = "free"
overruns = true
detent = 0.03
hold_current = 0.1
hold_delay = "30 ms"
resonance = [500, 700]
resonance_growth = 30.0
[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
[axis.motor]
torque = [[0, 0.8], [900, 0.5], [1500, 0.2]]
"""
PROGRAM = b"""M1 = ON
M2 = ON
AGAIN:
PABS M1 80
PABS M2 80
OUT1 = ON
WAITPOS
DELAY 0.1
PABS M2 0
OUT1 = OFF
PABS M1 0
DELAY 0.4
STOP M1
DELAY 0.1
M1 = OFF
DELAY 0.05
M1 = ON
JUMP AGAIN
"""
PARTS = (
    (
        "[[shaft]]\nname = 's'\naxis = 'x'\nratio = 0.04\n[[shaft.cam]]\nfrom = 20\nuntil = 80\nto = 'c.IN1'\n"
        "[[follower]]\nname = 'f'\nshaft = 's'\npoints = [[10, 0], [120, 9], [200, 4]]\n"
        "[[follower.switch]]\nabove = 6\nto = 'c.IN2'\nbounce = '2 ms'\n"
        "[[fault]]\nkind = 'slipping-coupling'\nelement = 's'\nfrom_s = 0.6\nuntil_s = 0.8\n"
    ),
    "[[carriage]]\nname = 't'\naxis = 'x'\nfrequency = 12\n[[carriage.switch]]\nabove = 50\nto = 'c.IN3'\n",
    "[[brake]]\nname = 'b'\naxis = 'x'\ntorque = 0.4\nrelease = 'c.OUT1'\n",
    (
        "[[tool]]\nname = 'tl'\naxis = 'x'\nother = 'y'\n[[tool.y_switch]]\nabove = 2\nto = 'c.IN12'\n"
        "[[fault]]\nkind = 'slipping-belt'\nelement = 'tl'\nbelt = 'other'\nfrom_s = 0.7\nuntil_s = 1.1\n"
        "[[event]]\nwhen = 'tl.x > 30'\nsteps = [{ note = 'far' }]\n"
    ),
    "[[gantry]]\nname = 'g'\naxis = 'x'\nother = 'y'\nlimit = 3\nmass = 4\nfriction_force = 20\n",
    "[[collision]]\nname = 'k'\nwhen = 'abs(x.position - y.position) > 6'\neffect = 'jam'\nreset = 'c.OUT1'\n",
    "[[transducer]]\nname = 'v'\nof = 'x.position'\nto = 'c.AIN1'\npoints = [[0, 0], [80, 8]]\nresolution = 0.1\n",
    (
        "[[supply]]\nname = 'p'\nfeeds = 'c'\nrise = '20 ms'\n"
        "[[fault]]\nkind = 'brown-out'\nelement = 'p'\nfrom_s = 0.9\nuntil_s = 1.0\n"
    ),
    (
        "[[conveyor]]\nname = 'w'\nlength = 200\naxis = 'y'\nfeed_every = '300 ms'\n[[conveyor.sensor]]\nat = 60\nto = 'c.IN4'\n"
        "[[conveyor.stop]]\nat = 66\nhold = 'c.OUT1'\n"
        "[[fault]]\nkind = 'empty-feeder'\nelement = 'w'\nfrom_s = 0.5\nuntil_s = 1.3\n"
    ),
    "[[cylinder]]\nname = 'z'\nextend = 'c.OUT1'\n[[cylinder.switch]]\nabove = 40\nto = 'c.IN5'\n",
    (
        "[[timer]]\nname = 'd'\ninput = 'c.OUT1'\nkind = 'on-delay'\ntime = '70 ms'\n"
        "[[counter]]\nname = 'n'\nup = 'd.out'\npreset = 2\n"
    ),
    (
        "[[relay]]\nname = 'r'\ncoil = 'c.OUT1'\npull_in = '9 ms'\ndrop_out = '5 ms'\n"
        "[[wire]]\nfrom = 'r.no'\nto = 'c.IN6'\ndelay = '3 ms'\n"
        "[[fault]]\nkind = 'stuck-input'\nelement = 'r'\ninput = 'coil'\nfrom_s = 0.8\nuntil_s = 1.2\n"
    ),
    (
        "[[gate]]\nname = 'ga'\nkind = 'xor'\ninputs = ['c.OUT1', 'la.out']\n"
        "[[latch]]\nname = 'la'\nset = 'c.OUT1'\nreset = 'ti.out'\n"
        "[[timer]]\nname = 'ti'\ninput = 'ga.out'\nkind = 'pulse'\ntime = '110 ms'\n"
        "[[fault]]\nkind = 'stuck-output'\nelement = 'la'\nlevel = 1\nfrom_s = 1.4\nuntil_s = 1.6\n"
    ),
    (
        "[[conveyor]]\nname = 'q'\nlength = 120\nspeed = 150\nfeed_every = '250 ms'\n[[conveyor.sensor]]\nat = 80\nto = 'c.IN7'\n"
        "[[vacuum]]\nname = 'u'\nejector = 'c.OUT1'\npick = 'c.OUT1'\nfrom = 'q'\npick_at = 90\n"
        "[[fault]]\nkind = 'leak'\nelement = 'u'\nfrom_s = 0.7\nuntil_s = 0.9\n"
    ),
    (
        "[[conveyor]]\nname = 'o'\nlength = 150\nspeed = 200\nfeed_every = '300 ms'\nmarks = [9]\nmass = 0.3\nnext = 'j'\n"
        "[[conveyor.sensor]]\nat = 50\nsees = 'mark'\nto = 'c.IN14'\n[[conveyor.stop]]\nat = 90\nhold = 'c.OUT1'\n"
        "[[conveyor]]\nname = 'j'\nlength = 150\nspeed = 80\n"
        "[[gripper]]\nname = 'ja'\nclose = 'c.OUT1'\npick = 'c.OUT1'\nfrom = 'o'\npick_at = 90\nclose_time = '300 ms'\n"
        "[[fault]]\nkind = 'worn-jaws'\nelement = 'ja'\nfrom_s = 1.2\nuntil_s = 1.3\n"
    ),
    (
        "[[load]]\nname = 'm'\naxis = 'x'\nmass = 2\nforce = 12\nwhen = 'c.OUT1'\n"
        "[[load]]\nname = 'i'\naxis = 'x'\nfriction_force = 60\nof = 'x.position'\npoints = [[10, 0.2], [60, 1]]\n"
        "[[fault]]\nkind = 'other-load'\nelement = 'm'\nfactor = 4\nfrom_s = 1.1\n"
    ),
    (
        "[[source]]\nname = 'vo'\nto = 'c.AIN2'\nkind = 'sine'\nvalue = 5\namplitude = 2\nfrequency = 3\nperiod = '20 ms'\n"
        "[[fault]]\nkind = 'drift'\nelement = 'vo'\nfrom_s = 0.6\nuntil_s = 1.2\n"
    ),
    (
        "[[button]]\nname = 'e'\nto = 'c.IN8'\nbounce = '3 ms'\n"
        "[[event]]\nevery = '370 ms'\nsteps = [{ press = 'e', for = '90 ms' }]\n"
        "[[event]]\nwhen = 'x.position > 40 or c.IN8'\n"
        "steps = [{ note = 'there' }, { wait = '33 ms' }, { set = { \"c.IN9\" = 1 } }]\n"
    ),
    (
        "[[axis]]\nname = 'h'\ndrive = 'c.M3'\nkind = 'rotary'\n"
        "[[axis.switch]]\nposition = 90\nwidth = 20\nto = 'c.IN10'\nbounce = '1 ms'\n"
        "[axis.encoder]\ncounts_per_rev = 2000\nindex = true\noffset = 10\n"
        '[[event]]\nat = \'20 ms\'\nsteps = [{ write = { "c.M3_EN" = 1 } }, { write = { "c.M3_POS_ABS" = 40000.0 } }]\n'
    ),
)
"""Every element of the product is in one of them, or in the base."""
END_S = 2.5


@settings(max_examples=25, deadline=None)
@given(parts=st.sets(st.sampled_from(PARTS)), moment=st.integers(0, round(END_S * SECOND)))
def test_what_is_restored_goes_on_alike(parts: set[str], moment: int) -> None:
    text = BASE + "".join(part for part in PARTS if part in parts)
    found, other = (World.from_toml(text, {"p.prg": PROGRAM}) for _ in range(2))
    found.run(until=moment / SECOND)
    snapshot = found.snapshot()
    found.run(until=END_S)
    other.restore(snapshot)
    other.run(until=END_S)
    assert other.trace.digest() == found.trace.digest()
    found.restore(snapshot)
    found.run(until=END_S)
    assert other.trace.digest() == found.trace.digest()


def test_every_element_is_among_them() -> None:
    there = {table for text in (BASE, *PARTS) for table in re.findall(r"^\[\[([a-z]+)\]\]", text, re.MULTILINE)}
    assert set(ELEMENTS) <= there


@pytest.mark.parametrize("number", range(len(PARTS)))
def test_each_can_be_restored(number: int) -> None:
    text = BASE + PARTS[number]
    found, other = (World.from_toml(text, {"p.prg": PROGRAM}) for _ in range(2))
    for moment in (0.71, 1.503):
        found.run(until=moment)
        snapshot = found.snapshot()
        found.run(until=moment + 0.2)
        other.restore(snapshot)
        other.run(until=moment + 0.2)
        assert other.trace.digest() == found.trace.digest()
