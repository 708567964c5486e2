"""Worlds that are composed by chance: elements, what joins them, programs, requests, and who looks on when.

A composition is run as it is, and in the general way: without what saves work because nothing seems to need it.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from random import Random
from typing import NamedTuple
from unittest.mock import patch

from random_worlds import shown

from steptwin.campaign.properties import read_property
from steptwin.controller import SECOND, Nanos
from steptwin.debug.debugger import Debugger
from steptwin.debug.lookahead import Goal
from steptwin.files.world import World
from steptwin.simulation.components.workpieces import Workpieces
from steptwin.simulation.kinds.mic488.build import _loaded
from steptwin.simulation.mechanics.trajectory import Trajectory
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.wire.crc import with_crc

BASE = """
[[line]]
name = "bus"
[[mic488]]
name = "c"
line = "bus"
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
    (
        "[[cylinder]]\nname = 'rod'\nextend = 'c.OUT1'\nstroke = 50\non = 'x'\nalong = '-z'\n"
        "[[body]]\nname = 'hb'\non = 'rod'\ndiameter = 20\nheight = 30\n"
        "[[body]]\nname = 'hw'\non = 'y'\nat = [30, 3, -25]\nsize = [20, 10, 20]\n"
        "[[collision]]\nname = 'hc'\nbetween = ['hb', 'hw']\neffect = 'jam'\nreset = 'c.OUT2'\n"
    ),
    "[[load]]\nname = 'jo'\naxis = 'x'\ninertia = 0.0004\nwhen = 'not c.OUT1'\n",  # a ramp needs 0.8 of the torque at once
    "[[fault]]\nkind = 'stuck'\nmachine = 'c'\npin = 'OUT1'\nvalue = 1\nfrom_s = 0.6\nuntil_s = 1.1\n",
    (
        "[[cylinder]]\nname = 'dip'\nextend = 'c.OUT1'\nstroke = 20\nextend_time = '60 ms'\non = 'x'\nalong = '-z'\n"
        "[[vacuum]]\nname = 'cu'\nejector = 'c.OUT1'\non = 'dip'\nat = [0, 0, 40]\ndiameter = 2\nreach = 8\nbuild_up = '9 ms'\n"
        "[[nest]]\nname = 'ne'\non = 'y'\ncells = [3, 1]\npitch = [30, 30]\nworkpiece = [24, 24, 18]\nfilled = 3\n"
        "[[conveyor]]\nname = 'sp'\nlength = 120\nspeed = 90\nfeed_every = '400 ms'\nworkpiece = [20, 12]\nat = [-40, 0, 6]\n"
        "[[beam]]\nname = 'bm'\nat = [10, -40, 10]\nalong = '+y'\nlength = 80\n"
        "[[event]]\nwhen = 'bm.seen'\nsteps = [{ note = 'seen' }]\n"
    ),
    (
        "[[conveyor]]\nname = 'pm'\nlength = 160\nspeed = 380\nfeed_every = '130 ms'\nworkpiece = [20, 16, 12]\nrun = 'c.OUT1'\n"
        "at = [0, 200, 6]\nwidth = 30\n[[conveyor]]\nname = 'pn'\nlength = 160\nspeed = 50\nat = [0, 230, 6]\nwidth = 30\n"
        "[[cylinder]]\nname = 'pr'\nstroke = 46\nextend_time = '70 ms'\nretract_time = '40 ms'\nat = [60, 170, 8]\nalong = '+y'\n"
        "[[body]]\nname = 'pb'\non = 'pr'\nsize = [30, 8, 10]\npushes = true\n[[button]]\nname = 'pp'\nto = 'pr.extend'\n"
        "[[event]]\nevery = '140 ms'\nsteps = [{ press = 'pp', for = '90 ms' }]\n"
    ),
    "[[transducer]]\nname = 'v'\nof = 'x.position + 3 * c.OUT1'\nto = 'c.AIN1'\npoints = [[0, 0], [80, 8]]\nresolution = 0.1\n",
    (
        "[[supply]]\nname = 'p'\nfeeds = 'c'\nrise = '20 ms'\n"
        "[[fault]]\nkind = 'brown-out'\nelement = 'p'\nfrom_s = 0.9\nuntil_s = 1.0\n"
    ),
    (
        "[[conveyor]]\nname = 'w'\nlength = 200\naxis = 'y'\nfeed_every = '300 ms'\n[[conveyor.sensor]]\nat = 60\nto = 'c.IN4'\n"
        "[[conveyor.stop]]\nat = 66\nhold = 'c.OUT1'\n"
        "[[fault]]\nkind = 'empty-feeder'\nelement = 'w'\nfrom_s = 0.5\nuntil_s = 1.3\n"
    ),
    (
        "[[conveyor]]\nname = 'kv'\nlength = 120\nspeed = 180\nrun = 'c.OUT1'\nramp_up = '170 ms'\nramp_down = '90 ms'\n"
        "feed_every = '350 ms'\n[[conveyor.sensor]]\nat = 40\nto = 'c.IN13'\n"
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
    (
        "[[axis]]\nname = 'l'\ndrive = 'c.M4'\npitch = 5.0\npulses_per_rev = 3200\npower = 'kp.no'\nbacklash = 0.3\n"
        "[axis.encoder]\nfollows = 'lc'\ncounts_per_unit = 20\n"
        "[axis.motor]\ntorque = [[0, 0.5], [600, 0.4], [900, 0.1]]\ninertia = 0.00004\nload = 0.2\nfriction = 0.03\n"
        "when_off = 'free'\n"
        "[[conveyor]]\nname = 'lc'\nlength = 60\nspeed = 70\nrun = 'c.OUT1'\nramp_down = '120 ms'\n"
        "[[relay]]\nname = 'kp'\ncoil = 'c.OUT1'\npull_in = '6 ms'\ndrop_out = '4 ms'\n"
        "[[event]]\nat = '20 ms'\nsteps = [{ write = { 'c.M4_EN' = 1, 'c.M4_ACC' = 90000.0, 'c.M4_VEL_ABS' = 30000.0 } }, "
        "{ write = { 'c.M4_POS_ABS' = 20000.0 } }]\n"
        "[[event]]\nat = '700 ms'\nsteps = [{ write = { \"c.M4_POS_ABS\" = -20000.0 } }]\n"
    ),
    (
        "[[dcmotor]]\nname = 'dm'\nspeed = 300\nrun = 'c.OUT1'\nrun_up = '90 ms'\ncoast = '210 ms'\n"
        "[[cylinder]]\nname = 'va'\nextend = 'c.OUT1'\nstroke = 10\nextend_time = '130 ms'\nretract_time = '60 ms'\n"
        "[[integrator]]\nname = 'ig'\nlow = 0\nhigh = 12\nstart = 3\nreset = 'c.OUT2'\nalong = '+z'\n"
        "rate = 'dm.speed * 0.2 - 40 * (c.OUT1 < 1) - 6 * va.position'\n"
        "[[integrator.switch]]\nabove = 6\nhysteresis = 1\nto = 'c.IN20'\n"
        "[[integrator]]\nname = 'ih'\nunit = 'l'\nrate = 'ig.rate - 3 * ig.at_high'\n"
        "[[body]]\nname = 'fl'\non = 'ig'\nsize = [5, 5, 5]\n"
        "[[body]]\nname = 'ar'\non = 'dm'\nsize = [40, 5, 5]\nat = [20, 0, 8]\n"
        "[[collision]]\nname = 'ic'\nbetween = ['fl', 'ar']\n"
        "[[fault]]\nkind = 'other-rate'\nelement = 'ig'\nfactor = 3\nfrom_s = 0.7\nuntil_s = 0.9\n"
        "[[fault]]\nkind = 'dead-motor'\nelement = 'dm'\nfrom_s = 0.5\nuntil_s = 0.6\n"
    ),
)
"""Every element of the product is in one of them, or in the base."""


OUTPUTS = {
    "r": ("no", "nc"), "ga": ("out",), "la": ("out",), "ti": ("out",), "d": ("out",), "n": ("out",),
    "z": ("extended", "retracted"), "kp": ("no", "nc"),
    "u": ("held",), "ja": ("opened", "closed", "held"), "b": ("released",), "g": ("skewed",), "k": ("hit",), "p": ("good",),
}  # fmt: skip
"""Terminals of elements that give a level, by the names of `PARTS`."""
SIGNALS = {
    "x": ("position", "lost", "reserve"), "y": ("position", "torque"), "h": ("position", "speed"),
    "z": ("position",), "w": ("count", "fed"),
    "q": ("count", "fed"),
    "u": ("pressure",), "f": ("position",), "t": ("position", "settled"), "tl": ("x", "y"), "g": ("position",), "s": ("angle",),
    "ig": ("value", "rate"), "ih": ("value",), "dm": ("speed", "angle"),
    "pb": ("pushed", "jammed"), "ja": ("position",), "n": ("count",), "o": ("mass",), "m": ("share",),
    "l": ("position", "lost", "power", "speed", "torque", "reserve", "force"),
}  # fmt: skip
JOINTS = {
    "transducer": '[[transducer]]\nname = "{}"\nof = "{signal}"\nto = "c.{analog}"\npoints = [[0, 0], [90, 9]]\n',
    "relay": '[[relay]]\nname = "{}"\ncoil = "{output}"\npull_in = "{ms} ms"\n',
    "timer": '[[timer]]\nname = "{}"\ninput = "{output}"\nkind = "on-delay"\ntime = "{ms} ms"\n',
    "counter": '[[counter]]\nname = "{}"\nup = "{output}"\npreset = 2\n',
    "gate": '[[gate]]\nname = "{}"\nkind = "xor"\ninputs = ["{output}", "{another}"]\n',
    "latch": '[[latch]]\nname = "{}"\nset = "{output}"\nreset = "{another}"\n',
    "cylinder": '[[cylinder]]\nname = "{}"\nextend = "{output}"\nextend_time = "{ms} ms"\n',
    "lamp": '[[lamp]]\nname = "{}"\nfrom = "{output}"\nwarms = "{ms} ms"\n',
    "conveyor": '[[conveyor]]\nname = "{}"\nlength = 200\nspeed = 150\nrun = "{output}"\nfeed_every = "{ms} ms"\n',
    "ramped conveyor": '[[conveyor]]\nname = "{}"\nlength = 200\nspeed = 150\nrun = "{output}"\nfeed_every = "{ms} ms"\n'
    'ramp_up = "{ms} ms"\nramp_down = "90 ms"\n[[conveyor.stop]]\nat = 80\nhold = "{another}"\n',
    "feeder": '[[conveyor]]\nname = "{}"\nlength = 200\nspeed = 150\nfeed_every = "{ms} ms"\n'
    '[[conveyor.sensor]]\nat = 90\nto = "c.{input}"\n',
    "button": '[[button]]\nname = "{}"\nto = "c.{input}"\nbounce = "{ms} ms"\n',
    "wire": '[[wire]]\nfrom = "{output}"\nto = "c.{input}"\n',
    "late wire": '[[wire]]\nfrom = "{output}"\nto = "c.{input}"\ndelay = "{ms} ms"\n',
    "event": '[[event]]\nwhen = "{signal} > {ms}"\nsteps = [{{ note = "{}" }}, {{ set = {{ "c.IN16" = 1 }} }}]\n',
    "repeated": '[[event]]\nevery = "{ms} ms"\nsteps = [{{ set = {{ "c.IN15" = 1 }} }}, {{ wait = "3 ms" }}]\n',
}
"""What joins the others: gaps are filled with what is there."""
GIVES = {
    "relay": ("no", "nc"), "timer": ("out",), "counter": ("out",), "gate": ("out",), "latch": ("out",), "cylinder": ("extended",),
}  # fmt: skip
LINES = (
    "n = n + 1", "m = n * 3", "m = m - n", "$D0 = n", "$R4 = m", "OUT2 = ON", "OUT2 = OFF", "OUT3 = ON", "OUT3 = OFF",
    "PULSE(OUT4, 0.03)", "DELAY 0.02", "DELAY 0.11", "PREL M3 40", "VABS M3 30", "STOP M3", "WAIT PosM1 > 2",
    "WAIT n > 3", "JUMP BELOW",
    "IF IN1 = ON\nn = 0\nENDIF", "IF IN16 = ON\nOUT5 = ON\nENDIF", "IF AIN1 > 0.4\nOUT6 = ON\nENDIF", "CFGINT_IN4 = 3",
)  # fmt: skip
HEAD = "M1 = ON\nM2 = ON\nM3 = ON\nn = 0\nm = 0\nAGAIN:\nPABS M1 80\nPABS M2 80\nOUT1 = ON\n"
TAIL = "DELAY 0.05\nPABS M2 0\nOUT1 = OFF\nPABS M1 0\nDELAY 0.06\nJUMP AGAIN\n"
TAIL += "BELOW:\nm = m + 1\nRETURN\nINT_IN4:\nOUT7 = ON\nRETURN\n"
REQUESTS = tuple(
    with_crc(bytes.fromhex(text))
    for text in (
        "01 03 27 24 00 0a",
        "01 05 17 71 ff 00",
        "01 05 17 71 00 00",
        "01 06 00 00 00 05",
        "01 02 13 88 00 10",
        "01 06 27 13 00 01",
    )
)
"""Reads of positions and inputs, OUT2, user register 0, a start."""
UNTIL: Nanos = 1_100_000_000


class Composition(NamedTuple):
    """A description with its program, and what happens from outside and who looks on, by moment."""

    text: str
    program: bytes
    acts: tuple[tuple[Nanos, int, tuple[str, ...]], ...]
    """Moment, the number of the request, and the observers that come or go."""
    copied: int
    """The number of the act after which it is copied."""

    def world(self) -> World:
        return World.from_toml(self.text, {"p.prg": self.program})


def composed(seed: int) -> Composition:
    """The composition of a seed."""
    chance = Random(seed)
    share, most = chance.choice(((0.08, 14), (0.35, 7)))
    parts = [part for part in PARTS if chance.random() < share]
    named = {name for name in (*OUTPUTS, *SIGNALS) if name in "xy" or any(f"name = '{name}'" in part for part in parts)}
    outputs = [f"c.OUT{number}" for number in range(1, 8)]
    outputs += [f"{name}.{pin}" for name, pins in OUTPUTS.items() if name in named for pin in pins]
    signals = [f"{name}.{one}" for name, of in SIGNALS.items() if name in named for one in of]
    free = [f"IN{number}" for number in (11, 13, 15, 16)]
    program = HEAD + "".join(f"{chance.choice(LINES)}\n" for _ in range(chance.randrange(9))) + TAIL
    files = {"p.prg": program.encode()}
    # Where nothing moves for a while, what is due by itself alone wakes an element.
    base = chance.choice((BASE, BASE.replace("start = true", "start = false")))
    tables = [base, *parts]
    for number in range(chance.randrange(most)):
        kind, name = chance.choice(sorted(JOINTS)), f"j{number}"
        table = JOINTS[kind].format(
            name,
            output=chance.choice(outputs),
            another=chance.choice(outputs),
            signal=chance.choice(signals),
            analog=chance.choice(("AIN1", "AIN2")),
            input=chance.choice(free),
            ms=chance.randrange(2, 400),
        )
        # Some cannot be: an input that is driven already, an element that is built later.
        with suppress(WorldError):
            World.from_toml("".join((*tables, table)), files)
            tables.append(table)
            outputs += [f"{name}.{pin}" for pin in GIVES.get(kind, ())]
    rest = tables[1:]
    chance.shuffle(rest)
    moments = sorted(chance.randrange(UNTIL) for _ in range(5))
    acts = tuple(
        (moment, chance.randrange(len(REQUESTS)), tuple(name for name in OBSERVERS if chance.random() < 0.3))
        for moment in moments
    )
    return Composition(base + "".join(rest), program.encode(), acts, chance.randrange(len(acts)))


# ---------------------------------------------------------------------- who looks on


def _debugger(world: World) -> Callable[[], None]:
    debugger = Debugger(world)
    debugger.stand()
    debugger.look_ahead(min(world.now + SECOND // 10, UNTIL), Goal(), world.now)
    return debugger.close


def _recorder(world: World) -> Callable[[], None]:
    snapshots, seen = SnapshotLog(world), list[TraceRecord]()
    world.trace.subscribers.append(seen.append)

    def leave() -> None:
        snapshots.take()
        snapshots.close()
        world.trace.subscribers.remove(seen.append)

    return leave


def _sampler(world: World) -> Callable[[], None]:
    def look() -> None:
        shown(world)

    look()
    return look


def _property(world: World) -> Callable[[], None]:
    watch = read_property("never c.M1.position > 60 or c.USER_REGISTER[0] > 4").watch(world)
    return watch.close


def _condition(world: World) -> Callable[[], None]:
    condition = world.condition("x.position > 20 and c.USER_REGISTER[0] < 3")
    world.holds(condition)
    return lambda: None


OBSERVERS: dict[str, Callable[[World], Callable[[], None]]] = {
    "debugger": _debugger,
    "recorder": _recorder,
    "sampler": _sampler,
    "property": _property,
    "condition": _condition,
}
"""Who may look on: each joins, and returns how it leaves."""


# ---------------------------------------------------------------------- runs


class Outcome(NamedTuple):
    """All that can be seen of a run at its end."""

    digest: str
    shown: tuple[str, ...]


def finish(world: World, composition: Composition, first: int = 0, observed: Callable[[int], None] = lambda _: None) -> Outcome:
    """Run on to the end from the act ``first`` on; ``observed`` is called with the number of each after it."""
    for number, (moment, request, _) in tuple(enumerate(composition.acts))[first:]:
        world.run(until=moment / SECOND)
        world.line["bus"].send(REQUESTS[request])
        observed(number)
    world.run(until=UNTIL / SECOND)
    return Outcome(world.trace.digest(), tuple(shown(world)))


def as_it_is(composition: Composition) -> Outcome:
    return finish(composition.world(), composition)


def looked_on(composition: Composition) -> Outcome:
    """Observers come and go."""
    world, there = composition.world(), dict[str, Callable[[], None]]()

    def observed(number: int) -> None:
        for name in composition.acts[number][2]:
            leave = there.pop(name, None)
            if leave is None:
                there[name] = OBSERVERS[name](world)
            else:
                leave()

    return finish(world, composition, observed=observed)


def copies(composition: Composition) -> Iterator[Outcome]:
    """A world into which its state was put, a branch, one that was pickled, and itself after it has gone back."""
    world, found = composition.world(), list[World]()

    def copy(number: int) -> None:
        if number == composition.copied:
            snapshot = world.snapshot()
            restored = composition.world()
            restored.restore(snapshot)
            found.extend((restored, world.branch(snapshot), pickle.loads(pickle.dumps(world))))

    finish(world, composition, observed=copy)
    for one in found:
        yield finish(one, composition, composition.copied + 1)


@contextmanager
def general_way() -> Generator[Callable[[World], World]]:
    """Nothing saves work: everything is looked at after each change, every statement is executed by itself, and each trajectory
    is laid in pieces. What is given makes a world general that was made meanwhile."""

    def general(world: World) -> World:
        for scheduler in world.schedulers:
            scheduler._join()
            scheduler.is_step_exact = True
            notify = partial(Scheduler.notify, scheduler)
            scheduler.notify = lambda name=None, notify=notify: notify()  # type: ignore[method-assign]
            for controller in scheduler.controllers.values():
                controller.changed = notify
        for programs in world.programs.values():
            programs.execute_all(True, world.now)
        return world

    with ExitStack() as stack:
        stack.enter_context(patch.object(Trajectory, "_keeps_distance", lambda trajectory, profile: False))
        stack.enter_context(patch("steptwin.wbc.compile.straight_of", lambda codes, steps, cell: [None] * len(steps)))
        stack.enter_context(patch("steptwin.simulation.kinds.mic488.build._loaded", _loaded.__wrapped__))
        stack.enter_context(patch("steptwin.simulation.components.bodycontact.meet", lambda one, other: True))
        stack.enter_context(patch.object(Workpieces, "near", lambda workpieces, its: list(workpieces.bodies())))
        yield general


def generally(composition: Composition) -> Outcome:
    with general_way() as general:
        return finish(general(composition.world()), composition)
