"""Random machines that one fault stops: what the standing program waits for leads to that fault."""

from __future__ import annotations

from random import Random
from typing import NamedTuple

from steptwin.files.world import World
from steptwin.why.answer import ALL_LINKS

WORLDS = 60
HEAD = '[world]\nname = "w"\n[[mic488]]\nname = "c"\nprogram = "p.prg"\nstart = true\n'


class Station(NamedTuple):
    """A part of a machine with ``{n}`` for its number: what the program does there, and the faults that stop it."""

    tables: str
    program: str
    faults: tuple[str, ...]


STATIONS = (
    Station(
        '[[cylinder]]\nname = "rod{n}"\nextend = "c.OUT{n}"\nextend_time = "{ms} ms"\nretract_time = "{ms} ms"\n'
        '[[wire]]\nfrom = "rod{n}.extended"\nto = "c.IN{n}"\n',
        "OUT{n} = ON\nWAIT IN{n} = ON\nOUT{n} = OFF\n",
        (
            "jam element=rod{n}", "no-air element=rod{n}", "stuck-output element=rod{n} output=extended",
            "stuck-input element=rod{n} input=extend", "stuck machine=c pin=OUT{n} value=0", "stuck machine=c pin=IN{n} value=0",
        ),
    ),
    Station(
        '[[relay]]\nname = "k{n}"\ncoil = "c.OUT{n}"\npull_in = "{ms} ms"\n[[timer]]\nname = "t{n}"\ninput = "k{n}.no"\n'
        'kind = "on-delay"\ntime = "{ms} ms"\n[[wire]]\nfrom = "t{n}.out"\nto = "c.IN{n}"\n',
        "OUT{n} = ON\nWAIT IN{n} = ON\nOUT{n} = OFF\nWAIT IN{n} = OFF\n",
        (
            "open-coil element=k{n}", "welded-contact element=k{n}", "stuck-input element=t{n} input=in",
            "stuck machine=c pin=IN{n} value=0",
        ),
    ),
    Station(
        '[[conveyor]]\nname = "belt{n}"\nlength = 300\nspeed = 200\nrun = "c.OUT{n}"\nfeed_every = "{ms} ms"\n'
        '[[conveyor.sensor]]\nat = 100\nto = "c.IN{n}"\n',
        "OUT{n} = ON\nWAIT IN{n} = ON\nWAIT IN{n} = OFF\nOUT{n} = OFF\n",
        ("belt-stop element=belt{n}", "empty-feeder element=belt{n}", "stuck machine=c pin=OUT{n} value=0"),
    ),
    Station(
        '[[axis]]\nname = "x{n}"\ndrive = "c.M{n}"\npitch = 5.0\npulses_per_rev = 3200\ntravel = [-50.0, 300.0]\n'
        '[[axis.switch]]\nabove = 0.5\nto = "c.IN{n}"\n',
        "M{n} = ON\nPABS M{n} 640\nWAIT IN{n} = ON\nWAITPOS\n",
        ("stall machine=c axis={n} for_s=100", "stuck machine=c pin=IN{n} value=0"),
    ),
    Station(
        '[[axis]]\nname = "x{n}"\ndrive = "c.M{n}"\npitch = 5.0\npulses_per_rev = 3200\ntravel = [-50.0, 300.0]\n'
        '[[shaft]]\nname = "s{n}"\naxis = "x{n}"\nratio = 0.2\n[[shaft.cam]]\nfrom = 10\nuntil = 60\nto = "c.IN{n}"\n',
        "M{n} = ON\nPABS M{n} 640\nWAIT IN{n} = ON\nWAITPOS\n",
        ("slipping-coupling element=s{n}", "stall machine=c axis={n} for_s=100"),
    ),
)  # fmt: skip


class Stopped(NamedTuple):
    text: str
    program: str
    fault: str
    at: float


def machine(chance: Random) -> Stopped:
    """Two to four stations, one after the other, and a fault of one of them, set before or while it runs."""
    stations = [chance.choice(STATIONS) for _ in range(chance.randrange(2, 5))]
    tables, program, faults = HEAD, "DELAY 0.05\n", list[str]()
    for n, station in enumerate(stations, start=1):
        ms = chance.randrange(60, 400)
        tables += station.tables.format(n=n, ms=ms)
        program += station.program.format(n=n)
        faults += [fault.format(n=n) for fault in station.faults]
    text = program + "OUT8 = ON\nWAIT IN20 = ON\n"
    return Stopped(tables, text, chance.choice(faults), chance.choice((0.0, 0.02, chance.random())))


def run(stopped: Stopped, *, fails: bool) -> World:
    world = World.from_toml(stopped.text, {"p.prg": stopped.program.encode()})
    world.run(stopped.at)
    if fails:
        world.fault(f"{stopped.fault} name=planted")
    world.run(7.0)
    return world


def test_the_fault_that_stops_a_program_is_in_the_answer() -> None:
    chance, unknown, found = Random(7), list[str](), 0
    while found < WORLDS:
        stopped = machine(chance)
        world = run(stopped, fails=True)
        if world.read("c.OUT8") or not run(stopped, fails=False).read("c.OUT8"):
            continue  # it came too late or changes nothing, or the machine stands without it
        found += 1
        answer = world.past.ask("c")
        if not any("planted" in link.text for link in answer.links):
            unknown.append(f"{stopped.fault} at {stopped.at}\n{answer.text()}")
    assert not unknown, "\n\n".join(unknown)


def test_the_rules_of_a_chain_hold_in_random_machines() -> None:
    """A cause is not later than its effect, nothing is named twice, and each root is proved, or does not decide alone."""
    chance = Random(11)
    for _ in range(12):
        stopped = machine(chance)
        world = run(stopped, fails=chance.random() < 0.5)
        past = world.past
        for question in ("c", "c.OUT1", "c.OUT8", "c.IN1", "c.IN2"):
            answer = past.ask(question, try_without=True)
            chain = [link for link in answer.links if link.time < answer.at]
            assert [link.time for link in chain] == sorted((link.time for link in chain), reverse=True), answer.text()
            assert len(set(answer.links)) == len(answer.links) < ALL_LINKS, answer.text()
            assert not answer.broken, answer.text()
            assert all(trial.effect.value in ("otherwise", "other time", "same") for trial in answer.trials), answer.text()
