"""The description of a campaign: what it means, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest
from campaigns import CAMPAIGN, campaign_file

from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.reading import TABLES, load_campaign, read_campaign
from steptwin.campaign.variation import Between, Choice, Normal
from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.world.check import diagnose

HEAD = '[campaign]\nworld = "world.toml"\nend = "2 s"\nruns = 5\n'


def load(folder: Path, text: str) -> CampaignDescription:
    return load_campaign(campaign_file(folder, text))


def wrong(folder: Path, text: str) -> str:
    with pytest.raises(Misuse) as error:
        load(folder, text)
    return str(error.value)


def test_all_keys_of_a_campaign(tmp_path: Path) -> None:
    found = load(
        tmp_path,
        '[campaign]\nname = "n"\nworld = "world.toml"\nruns = 5\ntime = "10 min"\nuntil_failure = true\nseed = 3\n'
        'design = "sobol"\nend = "2 s"\nuntil = "x.position > 39"\nstart = "100 ms"\ndatabase = "postgresql://h/n"\n'
        "expectations = false\n"
        '[[fault]]\ndo = "stall machine=table axis=1"\nchance = 0.5\n[[step]]\nat = "1 s"\ndo = { note = "n" }\n'
        '[[measure]]\nname = "m"\nvalue = "x.position"\n',
    )
    assert (found.name, found.runs, found.time_ns, found.until_failure) == ("n", 5, 600 * SECOND, True)
    assert (found.seed, found.design, found.end_ns, found.until) == (3, "sobol", 2 * SECOND, "x.position > 39")
    assert (found.start_ns, found.database, found.expectations) == (SECOND // 10, "postgresql://h/n", False)
    assert (found.faults[0].at, found.faults[0].chance) == (SECOND // 10, 0.5)  # where runs begin to vary
    assert (found.steps[0].at, found.steps[0].do) == (SECOND, '{"note": "n"}')
    assert (found.measures[0].value, found.measures[0].when) == ("x.position", None)


@pytest.mark.parametrize(
    ("keys", "spread"),
    [
        ("between = [1, 2.5]", Between(1.0, 2.5)),
        ('between = ["10 ms", "1 s"]', Between(0.01, 1.0, is_time=True)),
        ("between = [1, 100]\nlog = true", Between(1.0, 100.0, is_log=True)),
        ("between = [1, 9]\nwhole = true", Between(1.0, 9.0, is_whole=True)),
        ("between = [1, 9]\nlevels = 3", Between(1.0, 9.0, steps=3)),
        ("normal = { mean = 2, deviation = 0.5 }", Normal(2.0, 0.5)),
        ("normal = { mean = 2, deviation = 0.5 }\nbetween = [1, 3]", Normal(2.0, 0.5, 1.0, 3.0)),
        ('normal = { mean = "1 s", deviation = "1 ms" }', Normal(1.0, 0.001, 0.0, None, is_time=True)),
        ('choose = ["a", 1, true]', Choice(("a", 1, True))),
        ("grid = [1, 2]", Choice((1, 2), is_grid=True)),
    ],
)
def test_what_varies(tmp_path: Path, keys: str, spread: object) -> None:
    (found,) = load(tmp_path, f'{HEAD}[[vary]]\nname = "a"\n{keys}\n').vary
    assert (found.name, found.is_path, found.spread) == ("a", False, spread)


def test_a_path_is_of_the_world(tmp_path: Path) -> None:
    (found,) = load(tmp_path, f'{HEAD}[[vary]]\npath = "x.start"\nbetween = [0, 5]\n').vary
    assert (found.name, found.is_path) == ("x.start", True)


@pytest.mark.parametrize(
    ("keys", "name", "text"),
    [
        ('holds = "x.position > 0 for 2 s"', "x.position > 0 for 2 s", "x.position > 0 for 2 s"),
        ('name = "p"\nalways = "x.position > 0"', "p", "always x.position > 0"),
        ('never = "x.position < 0"', "never x.position < 0", "never x.position < 0"),
        ('name = "p"\neventually = "within 1 s x.position > 20"', "p", "eventually within 1 s x.position > 20"),
        ('name = "p"\nafter = "table.IN1 within 1 s x.position > 20"', "p", "after table.IN1 within 1 s x.position > 20"),
    ],
)
def test_what_must_hold(tmp_path: Path, keys: str, name: str, text: str) -> None:
    (found,) = load(tmp_path, f"{HEAD}[[property]]\n{keys}\n").properties
    assert (found.name, found.text) == (name, text)


def test_files_that_vary_are_read(tmp_path: Path) -> None:
    for name in ("one.prg", "two.prg"):
        (tmp_path / name).write_text("LOOP:\nDELAY 0.1\nJUMP LOOP\n")
    world = '[[mic488]]\nname = "table"\nprogram = "one.prg"\n'
    text = f'{HEAD}[[vary]]\npath = "table.program"\nchoose = ["one.prg", "two.prg"]\n'
    assert set(load_campaign(campaign_file(tmp_path, text, world)).files) == {"one.prg", "two.prg"}
    (tmp_path / "two.prg").unlink()
    with pytest.raises(Misuse, match=r"doors.toml:5:1: error D009: cannot read .*two.prg: no such file or directory"):
        load_campaign(campaign_file(tmp_path, text, world))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[campaign]\nend = "1 s"\nruns = 1\n', "D005: [campaign]: world is missing"),
        ('[campaign]\nworld = "world.toml"\nruns = 1\n', "D005: [campaign]: end is missing"),
        (HEAD + "[[varry]]\n", "5:1: error D004: the file has no [varry] (did you mean 'vary'?)"),
        (HEAD + "[vary]\n", "D002: [vary] is a single table"),
        (HEAD + "[[vary]]\nbetween = [1, 2]\n", "D007: [[vary]] needs one of path and name"),
        (HEAD + '[[vary]]\nname = "a"\n', "D007: [[vary]] needs one of between, normal, choose and grid"),
        (HEAD + '[[vary]]\nname = "a"\nchoose = [1]\ngrid = [1]\n', "D007: choose and grid exclude each other"),
        (HEAD + '[[vary]]\nname = "a"\nchoose = [1]\nlog = true\n', "D007: log means nothing without between"),
        (HEAD + '[[vary]]\nname = "a"\nbetween = [2, 1]\n', "the first must be below the second"),
        (HEAD + '[[vary]]\nname = "a"\nbetween = [1, "2 s"]\n', "expected two numbers or two times"),
        (HEAD + '[[vary]]\nname = "a"\nbetween = [0, 1]\nlog = true\n', "log needs numbers above 0"),
        (HEAD + '[[vary]]\nname = "a"\nbetween = [0, 1.5]\nwhole = true\n', "whole needs whole numbers"),
        (HEAD + '[[vary]]\nname = "a"\nbetween = [0.5, 2]\nwhole = true\n', "whole needs whole numbers"),
        (HEAD + '[[vary]]\nname = "a"\nnormal = { mean = 1, deviation = 0 }\n', "deviation = 0: must be more than 0"),
        (HEAD + '[[vary]]\nname = "a"\nnormal = { mean = 1 }\n', "expected { mean = NUMBER, deviation = NUMBER }"),
        (HEAD + '[[vary]]\nname = "a"\nchoose = []\n', "expected a list of numbers, texts or truth values"),
        (HEAD + '[[vary]]\nname = "a"\ngrid = [1]\n[[vary]]\nname = "a"\ngrid = [1]\n', "D006: 'a' varies already"),
        (
            HEAD + '[[vary]]\npath = "x.start"\ngrid = [1]\n[[vary]]\npath = "axis.0.start"\ngrid = [1]\n',
            "9:1: error D006: 'axis.0.start' is the same as 'x.start', which varies already",
        ),
        (HEAD + '[[vary]]\nname = "a"\nchoose = [1, nan]\n', "nan: expected a number"),
        (HEAD + '[[vary]]\nname = "a"\ngrid = [inf]\n', "inf: permitted are numbers from -1e+300 to 1e+300"),
        (
            HEAD + '[[vary]]\nname = "a"\nnormal = { mean = 0, deviation = 1 }\nbetween = [10, 11]\n',
            "between = [10.0, 11.0]: next to nothing of this distribution, 0, is there",
        ),
        (HEAD + '[[fault]]\ndo = "stall axis=1"\nat = "3 s"\n', "7:1: error D007: this is after end"),
        (
            HEAD + '[[vary]]\nname = "a"\nchoose = [3, 4]\n[[step]]\ndo = { note = "n" }\nat = "a"\n',
            "D007: 'a' is at least 3 s: this is after end",
        ),
        (
            HEAD + '[[vary]]\nname = "a"\nbetween = [0, 1e300]\n[[step]]\ndo = { note = "n" }\nat = "a"\n',
            "D007: 'a' varies, but is not a time: 1e+300 is",
        ),
        (
            HEAD + '[[vary]]\nname = "a"\nnormal = { mean = 1, deviation = 1 }\n[[step]]\ndo = { note = "n" }\nat = "a"\n',
            "D007: 'a' is not a time, because it may be below 0",
        ),
        (HEAD + '[[vary]]\npath = "x.strat"\nchoose = [1]\n', "'x.strat': [axis] has no 'strat' (did you mean 'start'?)"),
        (HEAD + '[[vary]]\npath = "y.start"\nchoose = [1]\n', "override 'y.start': there is no 'y'"),
        (HEAD + '[[fault]]\ndo = "stal machine=table"\n', "fault: kind = 'stal'"),
        (HEAD + '[[fault]]\ndo = "stall machine=tabel axis=1"\n', "machine = 'tabel': there are table"),
        (HEAD + '[[fault]]\ndo = "stall axis={n}"\n', "D009: {n}: no [[vary]] has this name"),
        (HEAD + '[[fault]]\ndo = "stall axis=1"\nchance = 0\n', "permitted are numbers above 0 to 1"),
        (HEAD + '[[fault]]\ndo = "stall axis=1"\nat = "now"\n', "D009: 'now' is not a time, and no [[vary]] has this name"),
        (HEAD + '[[step]]\ndo = "press start"\n', "expected a step of a script, such as { press = 'start' }"),
        (HEAD + '[[step]]\ndo = { pres = "start" }\n', "has 'pres' (did you mean 'press'?)"),
        (HEAD + '[[step]]\ndo = { press = "start" }\n', "no button is called 'start'"),
        (HEAD + '[[property]]\nname = "p"\n', "D007: [[property]] needs one of holds, always, never, eventually, after"),
        (HEAD + '[[property]]\nalways = "x.position >"\n', "6:1: error D009"),
        (HEAD + '[[property]]\nalways = "x.positoin > 1"\n', "6:1: error D009: property 'always x.positoin > 1'"),
        (HEAD + '[[property]]\nholds = "no-collison"\n', "(did you mean 'no-collision'?)"),
        (HEAD + '[[property]]\nalways = "idle"\nnever = "idle"\n', "D007: always and never exclude each other"),
        (
            HEAD + '[[property]]\nnever = "idle"\n[[property]]\nnever = "idle"\n',
            "D006: there is a [[property]] named 'never idle'",
        ),
        (HEAD + '[[measure]]\nname = "m"\n', "D007: [[measure]] needs one of value and when"),
        (HEAD + '[[measure]]\nname = "m"\nvalue = "y.position"\n', "7:1: error D009"),
        (HEAD + '[[measure]]\nname = "m"\nwhen = "x.position >"\n', "D003: [measure]: when"),
        (HEAD + 'until = "x.positoin > 1"\n', "5:1: error D009: no signal 'x.positoin'"),
        (HEAD + 'start = "2 s"\n', "D007: start must be before end"),
        (HEAD + 'start = "1 s"\n[[fault]]\ndo = "stall axis=1"\nat = "500 ms"\n', "D007: this is before start"),
        (
            HEAD + 'start = "1 s"\n[[vary]]\nname = "t"\nbetween = ["0 s", "2 s"]\n[[step]]\nat = "t"\ndo = { note = "n" }\n',
            "D007: 't' may be 0 s, before start",
        ),
        (
            HEAD + '[[vary]]\nname = "t"\nchoose = ["soon"]\n[[step]]\nat = "t"\ndo = { note = "n" }\n',
            "D007: 't' varies, but is not a time",
        ),
        (HEAD + 'start = "1 s"\n[[vary]]\npath = "x.start"\nchoose = [1]\n', "'x.start' is of the world, which is the same"),
        (HEAD + 'design = "grid"\n[[vary]]\nname = "a"\nbetween = [0, 1]\n', "'a' has no few values, as a grid needs"),
        (HEAD + 'design = "soboll"\n', "'soboll' (did you mean 'sobol'?)"),
        ("[campaign\n", "D001: this is not TOML"),
        ('[campaign]\nworld = "no.toml"\nend = "1 s"\nruns = 1\n', "no.toml: no such file or directory"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    assert message in wrong(tmp_path, text)


@pytest.mark.parametrize(("table", "key"), [(table, key.name) for table, spec in TABLES.items() for key in spec.rows.keys])
def test_each_key_refuses_what_it_cannot_be(tmp_path: Path, table: str, key: str) -> None:
    """No key takes a table of tables, and what is wrong is shown at the key."""
    lines = {
        "campaign": '[campaign]\nworld = "world.toml"\nend = "2 s"\nruns = 5\n',
        "vary": HEAD + '[[vary]]\nname = "a"\nbetween = [0, 1]\n',
        "fault": HEAD + '[[fault]]\ndo = "stall axis=1"\n',
        "step": HEAD + '[[step]]\ndo = { note = "n" }\n',
        "measure": HEAD + '[[measure]]\nname = "m"\nvalue = "x.position"\n',
        "matrix": HEAD + "[matrix]\n",
        "property": HEAD + '[[property]]\nalways = "x.position > 0"\n',
    }[table]
    kept = [line for line in lines.splitlines() if not line.startswith(f"{key} =")]
    if table == "property" and key not in {"name", "always"}:
        kept.pop()
    text = "\n".join([*kept, f"{key} = [[[]]]", ""])
    found = wrong(tmp_path, text)
    assert f"{text.splitlines().index(f'{key} = [[[]]]') + 1}:1: error D003: [{table}]: {key}:" in found


def test_errors_of_the_world_are_those_of_the_world(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=r"world.toml:2:1: error D004: \[mic488\] has no 'nam'"):
        load_campaign(campaign_file(tmp_path, HEAD, '[[mic488]]\nnam = "table"\n'))


def test_the_digest_is_that_of_what_results_depend_on(tmp_path: Path) -> None:
    digest = load(tmp_path, CAMPAIGN).digest
    for same in (CAMPAIGN.replace("runs = 40", "runs = 50"), "# a comment\n" + CAMPAIGN, CAMPAIGN + "\n"):
        assert load(tmp_path, same).digest == digest
    for other in (
        CAMPAIGN.replace("seed = 7", "seed = 8"),
        CAMPAIGN.replace("500 ms", "501 ms"),
        CAMPAIGN.replace('"1500 ms"\n\n', '"2 s"\n\n'),
    ):
        assert load(tmp_path, other).digest != digest
    path = campaign_file(tmp_path, CAMPAIGN)
    (tmp_path / "world.toml").write_text((tmp_path / "world.toml").read_text() + "# changed\n")
    assert load_campaign(path).digest != digest


def test_a_text_needs_no_file_of_its_own(tmp_path: Path) -> None:
    campaign_file(tmp_path)
    assert read_campaign("a.toml", CAMPAIGN, tmp_path).name == "a"


def test_a_world_is_no_campaign_and_a_campaign_no_world(tmp_path: Path) -> None:
    with pytest.raises(WorldError, match=r"^a.toml:1:1: error D004: this is a world, not a campaign\n") as refused:
        read_campaign("a.toml", '[[mic488]]\nname = "a"\n[[axis]]\nname = "x"\n', tmp_path)
    assert len(refused.value.findings) == 1
    found = diagnose("a.toml", CAMPAIGN, no_files).findings
    assert [one.message for one in found] == ["this is a campaign, not a world"]
