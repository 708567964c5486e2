"""The worlds that `steptwin serve` makes of its options."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from steptwin.cli.serve_m1486 import ChipLineOptions, ChipOptions, describe_m1486
from steptwin.cli.serve_mic488 import Mic488Options, ModbusOptions, describe_mic488, serve_mic488
from steptwin.cli.serving import Served, TwinOptions
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.live.options import LiveOptions
from steptwin.simulation.script import steps as do

CONFIG = "[Axis0]\nUnit=3\nGear=50\n[AIN0]\nID=9\n"


@pytest.mark.parametrize(
    ("line", "controllers", "message"),
    [
        ({"baud": 38401}, {}, r"--baud 38401: permitted are 9600, 19200, 38400, 57600, 115200 bit/s"),
        ({}, {"demo": True, "config": Path("m.cfg")}, r"--demo and --config m\.cfg: the demo has a configuration of its own"),
        ({}, {"units": "1,x"}, r"--units 1,x: 'x' is not a slave address; permitted are 1 to 247"),
        ({}, {"units": "1,1"}, r"--units 1,1: 1 is given twice"),
        ({}, {"units": "1,2", "vision": "127.0.0.1:0"}, r"--vision is for a single unit"),
        ({"gap": 0.0}, {}, r"--gap 0: permitted are more than 0 and at most 10000 ms"),
        ({"line_timing": "fast"}, {}, r"--line-timing fast: permitted are 'real', 'strict' and 'off'"),
        ({}, {"program": ("9=a.prg",)}, r"--program 9=a\.prg: permitted are banks 0 to 5"),
        ({"tcp": "0.0.0.0:0"}, {}, r"0\.0\.0\.0 is not a loopback address: .* --listen-any permits it"),
        ({}, {"config": Path("nowhere.cfg")}, r"cannot read nowhere\.cfg"),
    ],
)
def test_options_that_cannot_be_meant(line: dict[str, Any], controllers: dict[str, Any], message: str) -> None:
    with pytest.raises(Misuse, match=message):
        serve_mic488(Served(kind="mic488", line=ModbusOptions(**line)), Mic488Options(**controllers))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (ModbusOptions(tcp="127.0.0.1:0"), r"--listen-any .* \(addresses: 127\.0\.0\.1:0\); 0\.0\.0\.0:PORT"),
        (ModbusOptions(pty=Path("p")), r"--listen-any .* there is none \(addresses: none\)"),
    ],
)
def test_a_permission_that_nothing_uses_is_refused(line: ModbusOptions, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        serve_mic488(Served(kind="mic488", line=line, live=LiveOptions(listen_any=True)), Mic488Options())


def test_every_option_is_a_key_of_the_description() -> None:
    served = Served(
        kind="mic488",
        live=LiveOptions(name="cell"),
        line=ModbusOptions(
            tcp="127.0.0.1:0",
            rtu_tcp="127.0.0.1:1",
            rfc2217="127.0.0.1:2",
            pty=Path("line"),
            serial="/dev/ttyS9",
            baud=9600,
            line_timing="strict",
            gap=2.5,
        ),
        twin=TwinOptions(state=Path("memory"), fault=("crc nth=3", "busy address=10020-10027"), seed=5),
    )
    controllers = Mic488Options(
        firmware="1.40",
        units="2,7",
        config=Path("a b.cfg"),
        program=("main.prg", "3=other.prg"),
        positions=("1=p.csv",),
        statement_time="1500us",
        lenient=True,
    )
    text = describe_mic488(served, controllers)
    data = tomllib.loads(text)
    assert data["world"] == {"name": "cell", "seed": 5, "state": "memory"}
    assert data["line"] == [
        {
            "name": "bus",
            "kind": "modbus",
            "pty": "line",
            "tcp": "127.0.0.1:0",
            "rtu_tcp": "127.0.0.1:1",
            "rfc2217": "127.0.0.1:2",
            "serial": "/dev/ttyS9",
            "baud": 9600,
            "gap": "2500 us",
            "timing": "strict",
        }
    ]
    own = {
        "line": "bus",
        "firmware": "1.40",
        "config": "a b.cfg",
        "programs": {"0": "main.prg", "3": "other.prg"},
        "positions": {"1": "p.csv"},
        "statement_time": "1500 us",
        "lenient": True,
    }
    assert data["mic488"] == [{"name": "mic488-2", "unit": 2, **own}, {"name": "mic488-7", "unit": 7, **own}]
    assert data["fault"] == [{"kind": "crc", "nth": 3}, {"kind": "busy", "address": "10020-10027"}]


def test_chips_and_the_wires_between_them() -> None:
    served = Served(kind="m1486", line=ChipLineOptions(baud=4800))
    with pytest.raises(Misuse, match="address 0: M1486E1 takes 1 to F"):
        describe_m1486(served, ChipOptions(chain="0,A", wire=("0.B1=A.B3",), variant="e1"))
    data = tomllib.loads(describe_m1486(served, ChipOptions(chain="0,A", wire=("0.B1=A.B3",), variant="b")))
    assert [(chip["name"], chip["address"], chip["variant"]) for chip in data["m1486"]] == [("chip0", 0, "B"), ("chipA", 10, "B")]
    assert data["wire"] == [{"from": "chip0.B1", "to": "chipA.B3"}]
    assert data["line"][0]["baud"] == 4800


def test_the_demo_is_a_world_with_switches_at_both_ends() -> None:
    with World.from_toml(
        describe_mic488(Served(kind="mic488", line=ModbusOptions()), Mic488Options(units="1,2", demo=True))
    ) as world:
        assert list(world.axis) == ["x-1", "y-1", "z-1", "u-1", "x-2", "y-2", "z-2", "u-2"]
        for registers in ((("mic488-2", "M1_EN", 1.0),), (("mic488-2", "M1_VEL_ABS", -25.0),)):
            world.apply_input(do.Write(registers))
        assert world.run(until="mic488-2.IN1 == 1", for_="2 s") is not None
        assert world.axis["x-2"].position == pytest.approx(-10.0, abs=0.3)
        assert world.read("mic488-1.IN1") == 0


def test_a_saved_description_has_the_files_it_names_beside_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    config = tmp_path / "here" / "machine.cfg"
    config.write_text(CONFIG)
    target = tmp_path / "there" / "machine.toml"
    served = Served(kind="mic488", line=ModbusOptions(tcp="127.0.0.1:0"), twin=TwinOptions(save_world=target))
    serve_mic488(served, Mic488Options(config=config))
    assert capsys.readouterr().out == f"wrote {tmp_path / 'there' / 'machine.cfg'}\nwrote {target}\n"
    with World.load(target) as world:
        assert world.mic488["mic488"].device.axes[0].config.gear == 50.0
        assert world.objects.line_of["mic488"][1] == 9  # the address of the configuration
    (tmp_path / "there" / "machine.cfg").write_text("[Axis0]\nGear=3\n")
    with pytest.raises(Misuse, match="is another file than"):
        serve_mic488(served, Mic488Options(config=config))


def test_a_printed_description_tells_of_files_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "machine.cfg").write_text(CONFIG)
    monkeypatch.chdir(tmp_path / "folder")
    served = Served(kind="mic488", line=ModbusOptions(tcp="127.0.0.1:0"), twin=TwinOptions(print_world=True))
    serve_mic488(served, Mic488Options(config=Path("../machine.cfg")))
    shown = capsys.readouterr()
    assert tomllib.loads(shown.out)["mic488"][0]["config"] == "../machine.cfg"
    assert shown.err.startswith("../machine.cfg is outside this folder: --save-world FILE copies it")
