"""What descriptions of worlds may have, and the values that their keys take."""

from __future__ import annotations

import pytest

from steptwin.files.world import World
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.kinds.mic488.table import Mic488Spec
from steptwin.simulation.toml.keypaths import LONGEST_SCALAR
from steptwin.simulation.toml.reader import TomlText, WorldError

TABLE = '[[mic488]]\nname = "table"\n'
AXIS = TABLE + '[[axis]]\nname = "x"\ndrive = "table.M1"\n'

CHIP = '[[m1486]]\nname = "chip"\n'


def described(text: str) -> Mic488Spec:
    (spec,) = read_world("w", text).controllers
    assert isinstance(spec, Mic488Spec)
    return spec


MOTOR = "[axis.motor]\ntorque = [[0, 1.0]]\n"


def wrong(text: str) -> str:
    with pytest.raises(WorldError) as caught:
        World.from_toml(text, name="w.toml")
    return str(caught.value)


def test_keys_of_nested_tables_have_their_lines() -> None:
    text = TomlText("t", "[[a]]\nx = 1\n[[a]]\ny = 2\n[[a.b]]\nz = 3\n[[a.b]]\nz = 4\n[a.c]\nq.r = 5\n")
    paths = {("a", 0, "x"): 2, ("a", 1, "y"): 4, ("a", 1, "b", 0, "z"): 6, ("a", 1, "b", 1, "z"): 8, ("a", 1, "c", "q", "r"): 10}
    assert {path: text.line(path) for path in paths} == paths
    assert text.line(("a", 1, "b", 1, "no", "such")) == 7
    assert text.line(("nothing",)) == 1


@pytest.mark.parametrize(
    ("written", "number"), [('"IN1"', 0), ('"in20"', 19), ('"none"', 20), ('"NONE"', 20), ("0", 0), ("20", 20)]
)
def test_switches_are_inputs_by_name_or_none(written: str, number: int) -> None:
    assert described(f"{TABLE}[mic488.M1]\nin_kl = {written}\nin_kr = {written}\n").axes == {
        1: {"in_kl": number, "in_kr": number}
    }


def test_the_configuration_of_a_controller_takes_words_and_numbers() -> None:
    spec = described(
        TABLE + '[mic488.M2]\nunit = "mm"\ngear = 100.0\nin_kl = "IN3"\nlimit_mode = "KL+KR"\n[mic488.IN3]\nlevel = 1\n'
    )
    assert all(isinstance(value, int) for value in described(TABLE + "[mic488.M1]\nunit = 3.0\nin_kl = 4.0\n").axes[1].values())
    assert spec.axes == {2: {"unit": 3, "gear": 100.0, "in_kl": 2, "limit_mode": 3}}
    assert spec.inputs == {3: {"level": 1}}


@pytest.mark.parametrize(
    ("written", "firmware"), [("1.7", "1.70"), ('"1.7"', "1.70"), ('"1.70"', "1.70"), ("1.4", "1.40"), ("1.23", "1.23")]
)
def test_a_firmware_is_a_text_or_a_number(written: str, firmware: str) -> None:
    assert described(f"{TABLE}firmware = {written}\n").firmware == firmware


@pytest.mark.parametrize(("keys", "keeps"), [("", 0), ("trigger_keeps = true\n", 1), ("trigger_keeps = false\n", 0)])
def test_mic_8_and_mic_16_in_a_description(keys: str, keeps: int) -> None:
    world = World.from_toml(TABLE + keys + "[mic488.M2]\nen_wired = 0\n")
    config = world.mic488["table"].device.config
    assert [axis.en_wired for axis in config.axes] == [1, 0, 1, 1]
    assert config.trigger_keeps == keeps


def test_mic_15_strict_timing_is_for_modbus() -> None:
    strict = '[[line]]\nname = "bus"\ntiming = "strict"\n'
    World.from_toml(strict + TABLE + 'line = "bus"\n')
    told = wrong(strict + 'kind = "m1486"\n' + CHIP + 'line = "bus"\n')
    assert "timing = 'strict' is for lines of kind modbus: an M1486 has no time-out between characters" in told


@pytest.mark.parametrize(("number", "fits"), [(2**63 - 1, True), (-(2**63), True), (2**63, False), (-(2**63) - 1, False)])
def test_whole_numbers_have_64_bits(number: int, fits: bool) -> None:
    told = wrong(f"[world]\nseed = {number}\nsize = 1\n")
    assert ("a whole number of more than 64 bits" in told) is not fits


@pytest.mark.parametrize("number", [1, 8, 20])
def test_every_input_of_a_controller_has_a_table(number: int) -> None:
    """Of keys as of axes: what is wrong in it is told."""
    assert f"IN{number}" in wrong(TABLE + f"[mic488.IN{number}]\nnothing = 1\n")


def test_values_are_at_most_so_long() -> None:
    digits = LONGEST_SCALAR - 2
    assert f"a value of {LONGEST_SCALAR} characters" not in wrong(f"{TABLE}unit = 1.{'0' * digits}\n")
    assert f"a value of {LONGEST_SCALAR + 1} characters that is not text" in wrong(f"{TABLE}unit = 1.{'0' * (digits + 1)}\n")


def test_a_motor_without_masses_needs_no_length() -> None:
    assert World.from_toml(AXIS + MOTOR + "inertia = 0.001\n", name="w.toml").axis["x"].position == 0.0


def test_addresses_for_records_of_vision_systems() -> None:
    text = '[[mic488]]\nname = "a"\nvision = "127.0.0.1:7001"\n[[m1486]]\nname = "c"\n[[mic488]]\nname = "b"\n'
    assert list(read_world("w", text).vision_addresses()) == [("a", "127.0.0.1:7001")]
