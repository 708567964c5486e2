"""Cases by number."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import pytest
from campaigns import campaign_file

from steptwin.campaign.case import FaultAt
from steptwin.campaign.cases import Cases, filled, filled_step, names_in
from steptwin.campaign.reading import load_campaign
from steptwin.errors import Misuse

HEAD = '[campaign]\nworld = "world.toml"\nend = "2 s"\n'
TWO = '[[vary]]\nname = "a"\nbetween = [0, 1]\n[[vary]]\nname = "b"\nbetween = [0, 1]\n'


def cases(folder: Path, text: str) -> Cases:
    return Cases(load_campaign(campaign_file(folder, HEAD + text)))


def test_cases_do_not_depend_on_who_asks_and_when(tmp_path: Path) -> None:
    one, other = cases(tmp_path, "runs = 9\nseed = 3\n" + TWO), cases(tmp_path, "runs = 9\nseed = 3\n" + TWO)
    assert [one[n] for n in range(9)] == [other[n] for n in reversed(range(9))][::-1]
    assert cases(tmp_path, "runs = 9\nseed = 4\n" + TWO)[0].values != one[0].values
    assert len({one[n].seed for n in range(9)}) == 9


def test_more_runs_leave_the_cases_as_they_are(tmp_path: Path) -> None:
    assert cases(tmp_path, "runs = 5\n" + TWO)[4] == cases(tmp_path, "runs = 500\n" + TWO)[4]


def test_what_is_added_leaves_the_values_of_others_as_they_are(tmp_path: Path) -> None:
    more = cases(tmp_path, 'runs = 5\n[[vary]]\nname = "c"\nbetween = [0, 1]\n' + TWO)
    assert {**more[2].values, **cases(tmp_path, "runs = 5\n" + TWO)[2].values} == more[2].values


def test_a_grid_has_each_value_with_each_other_once(tmp_path: Path) -> None:
    found = cases(tmp_path, '[[vary]]\nname = "a"\ngrid = [1, 2, 3]\n[[vary]]\nname = "b"\ngrid = ["x", "y"]\n')
    assert found.count == 6
    assert [(found[n].values["a"], found[n].values["b"]) for n in range(6)] == list(product([1, 2, 3], ["x", "y"]))


def test_the_design_grid_has_levels_and_faults_that_may_be_missing(tmp_path: Path) -> None:
    text = 'design = "grid"\n[[vary]]\nname = "a"\nbetween = [0.0, 1.0]\nlevels = 3\n'
    found = cases(tmp_path, text + '[[fault]]\ndo = "stall machine=table axis=1"\nchance = 0.1\n')
    assert found.count == 6
    assert {(found[n].values["a"], len(found[n].faults)) for n in range(6)} == set(product([0.0, 0.5, 1.0], [0, 1]))


@pytest.mark.parametrize("design", ["latin-hypercube", "sobol"])
def test_designs_fill_the_square_evenly(tmp_path: Path, design: str) -> None:
    found = cases(tmp_path, f'runs = 64\ndesign = "{design}"\n' + TWO)
    for name in ("a", "b"):
        strata = sorted(int(float(found[n].values[name]) * 64) for n in range(64))
        assert strata == list(range(64))
    quarters = [(float(found[n].values["a"]) > 0.5, float(found[n].values["b"]) > 0.5) for n in range(64)]
    if design == "sobol":
        assert {quarters.count(one) for one in quarters} == {16}


def test_a_sobol_sequence_goes_on_across_its_blocks(tmp_path: Path) -> None:
    text = 'runs = 3000\ndesign = "sobol"\n' + TWO
    forward, jumping = cases(tmp_path, text), cases(tmp_path, text)
    far = jumping[2050].values
    assert [forward[n].values for n in range(2051)][2050] == far
    assert sorted(int(float(forward[n].values["a"]) * 2048.0) for n in range(2048)) == list(range(2048))


def test_a_latin_hypercube_needs_a_number_of_runs(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="a Latin hypercube needs the number of its points: give runs"):
        cases(tmp_path, 'time = "1 s"\ndesign = "latin-hypercube"\n' + TWO)[0]


def test_a_fault_is_there_as_often_as_its_chance_says(tmp_path: Path) -> None:
    found = cases(tmp_path, 'runs = 400\n[[fault]]\ndo = "stall machine=table axis=1"\nat = "1 s"\nchance = 0.25\n')
    there = [found[n].faults for n in range(400)]
    assert 70 <= sum(map(bool, there)) <= 130
    assert {one for one in there if one} == {(FaultAt(1_000_000_000, "stall machine=table axis=1", 0),)}


def test_names_stand_for_values(tmp_path: Path) -> None:
    text = 'runs = 3\n[[vary]]\nname = "level"\nchoose = [1]\n[[vary]]\nname = "t"\nbetween = ["100 ms", "200 ms"]\n'
    found = cases(tmp_path, text + '[[step]]\nat = "t"\ndo = { set = { "table.IN1" = "{level}" } }\n')[1]
    (step,) = found.steps
    assert step.step == '{"set": {"table.IN1": 1}}'
    assert step.at_ns == round(float(found.values["t"]) * 1e9)
    assert filled("a={x} {y}", {"x": True}) == "a=true {y}"
    assert names_in("{a} and {b_2} {}") == ["a", "b_2"]


def test_faults_after_a_common_beginning_have_names_of_their_own(tmp_path: Path) -> None:
    found = cases(tmp_path, 'runs = 3\nstart = "1 s"\n[[fault]]\ndo = "stall machine=table axis=1"\n')
    names = {found[n].faults[0].fault.split("name=")[1] for n in range(3)}
    assert names == {f"stall-1-{found[n].seed:x}" for n in range(3)}


def test_a_case_can_be_made_of_values_and_faults(tmp_path: Path) -> None:
    found = cases(tmp_path, 'runs = 3\n[[vary]]\nname = "t"\nbetween = ["0 s", "1 s"]\n[[step]]\nat = "t"\ndo = { note = "n" }\n')
    made = found.made(0, found[0].seed, {"t": 0.5}, [], None)
    assert made.steps[0].at_ns == 500_000_000
    assert found.made(0, 1, {"t": 0.5}, [], []).steps == ()


def test_values_in_steps_are_data_whatever_they_contain() -> None:
    step = '{"note": "say {a}", "set": {"{pin}": "{b}"}, "steps": [{"wait": "{t}"}]}'
    values = {"a": 'a"b\\ {pin}', "pin": "x.IN1", "b": True, "t": 0.5}
    assert json.loads(filled_step(step, values)) == {
        "note": 'say a"b\\ {pin}',
        "set": {"x.IN1": True},
        "steps": [{"wait": 0.5}],
    }


def test_a_number_can_be_part_of_a_key() -> None:
    assert filled_step('{"set": {"x.IN{n}": 1}}', {"n": 3}) == '{"set": {"x.IN3": 1}}'
