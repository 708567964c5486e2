"""Plans of Bluesky with a RunEngine, on drivers of served twins, and on the EPICS motor record."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from bluesky.preprocessors import run_decorator, stage_decorator
from bluesky.protocols import Flyable
from bluesky.run_engine import call_in_bluesky_event_loop
from bluesky.utils import FailedStatus, MsgGenerator
from gateway_rig import served
from ophyd_async.core import FlyMotorInfo, NotConnectedError, init_devices, observe_value
from tests.conftest import Served
from tests.gateways.epics.test_clients import client

from steptwin.bluesky import AnalogInput, M1486Controller, Mic488Controller
from steptwin.drivers import AsyncMic488, ProgramState
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.errors import Misuse


class Documents:
    """What a run tells."""

    def __init__(self) -> None:
        self.found: list[tuple[str, dict[str, Any]]] = []

    def __call__(self, name: str, document: dict[str, Any]) -> None:
        self.found.append((name, document))

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [document for name, document in self.found if name == kind]

    def column(self, name: str, of: str = "data") -> list[Any]:
        pages = [page[of][name] for page in self.of("event_page") if name in page[of]]
        return [event[of][name] for event in self.of("event") if name in event[of]] + [one for page in pages for one in page]


@pytest.fixture(scope="module")
def engine() -> Iterator[RunEngine]:
    found = RunEngine(context_managers=[])
    yield found
    found.loop.call_soon_threadsafe(found.loop.stop)
    found._th.join(10)
    found.loop.close()


@pytest.fixture
def told(engine: RunEngine) -> Iterator[Documents]:
    documents = Documents()
    token = engine.subscribe(documents)
    yield documents
    engine.unsubscribe(token)


def of_driver(awaitable: Any) -> Any:
    return call_in_bluesky_event_loop(awaitable, 30.0)


@pytest.fixture(scope="module")
def table(engine: RunEngine, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mic488Controller]:
    program = tmp_path_factory.mktemp("program") / "short.prg"
    program.write_text("OUT5 = ON\nDELAY 0.5\n")
    twin = Served(tmp_path_factory.mktemp("table"), "--demo", "--program", str(program))
    twin.wait_until_ready()
    with init_devices():
        table = Mic488Controller(AsyncMic488(f"tcp://127.0.0.1:{twin.tcp_port}"), points=["OUT3", "USER_REGISTER[5]"])
    of_driver(table.driver.enable(1))
    yield table
    of_driver(table.close())
    twin.end()
    twin.close()


def test_a_scan(table: Mic488Controller, engine: RunEngine, told: Documents) -> None:
    of_driver(table.driver.set_output(3, True))
    of_driver(table.driver.set("USER_REGISTER[5]", 42))
    engine(bp.scan([table.readings], table.m1, 0.0, 4.0, 3))
    assert told.column("table-m1") == [0.0, 2.0, 4.0]
    assert told.column("table-readings-OUT3") == [1.0, 1.0, 1.0]
    assert told.column("table-readings-USER_REGISTER[5]") == [42.0, 42.0, 42.0]
    (described,) = told.of("descriptor")
    assert described["data_keys"]["table-m1"]["units"] == table.driver.axis(1).unit
    assert described["data_keys"]["table-m1"]["source"].startswith("steptwin://tcp://127.0.0.1:")
    assert described["hints"]["table-readings"] == {"fields": ["table-readings-OUT3", "table-readings-USER_REGISTER[5]"]}


def failure(error: pytest.ExceptionInfo[FailedStatus]) -> str:
    return repr(error.value.args[0].exception())


def test_motions_that_fail(table: Mic488Controller, engine: RunEngine) -> None:
    """Refused by the controller, outside limits, ended by another master."""
    with pytest.raises(FailedStatus) as refused:
        engine(bps.mv(table.m2, 5.0))
    assert "NotReady" in failure(refused)
    engine(bps.mv(table.m1.high_limit, 10.0))
    before = of_driver(table.driver.axis(1).position())
    with pytest.raises(FailedStatus) as outside:
        engine(bps.mv(table.m1, 11.0))
    assert "table-m1: 11" in failure(outside)
    assert "permitted are any to 10" in failure(outside)
    assert of_driver(table.driver.axis(1).position()) == before
    engine(bps.mv(table.m1.high_limit, math.inf))

    def interrupted() -> MsgGenerator:
        yield from bps.abs_set(table.m1, 200.0, group="move")
        yield from bps.sleep(0.3)
        yield from bps.wait_for([lambda: table.driver.set("M1_STOP", 1)])
        yield from bps.wait(group="move")

    with pytest.raises(FailedStatus) as stopped:
        engine(interrupted())
    assert "MoveFailed" in failure(stopped)
    assert "stopped by a command" in failure(stopped)

    def redirected() -> MsgGenerator:
        yield from bps.abs_set(table.m1, 200.0, group="move")
        yield from bps.sleep(0.2)
        yield from bps.wait_for([lambda: table.driver.set("M1_POS_ABS", 6)])
        yield from bps.wait(group="move")

    with pytest.raises(FailedStatus) as elsewhere:  # the driver knows no pulses per unit
        engine(redirected())
    assert "redirected by another command" in failure(elsewhere)


@pytest.mark.parametrize("success", [True, False])
def test_a_stop(table: Mic488Controller, engine: RunEngine, *, success: bool) -> None:
    """A plan that stops a motor learns nothing, or that it was stopped; the motion is not begun again."""

    def stopped() -> MsgGenerator:
        yield from bps.mv(table.m1, 0.0)
        yield from bps.abs_set(table.m1, 200.0, group="move")
        yield from bps.sleep(0.3)
        yield from bps.wait_for([lambda: table.m1.stop(success=success)])
        yield from bps.wait(group="move")

    if success:
        engine(stopped())
    else:
        with pytest.raises(FailedStatus) as error:
            engine(stopped())
        assert "table-m1 was stopped" in failure(error)
    there = of_driver(table.driver.axis(1).position())
    assert 0.0 < there < 200.0
    assert of_driver(table.driver.axis(1).position()) == there


def test_a_motion_does_not_go_on_without_a_plan(table: Mic488Controller, engine: RunEngine) -> None:
    """Whoever sets it no longer waits: the time-out of a status ends the motion, too."""

    def impatient() -> MsgGenerator:
        yield from bps.mv(table.m1, 0.0)
        yield from bps.abs_set(table.m1, 200.0, timeout=0.3, group="move")
        yield from bps.wait(group="move")

    with pytest.raises(FailedStatus) as late:
        engine(impatient())
    assert "TimeoutError" in failure(late)
    there = of_driver(table.driver.axis(1).position())
    assert 0.0 < there < 200.0
    assert of_driver(table.driver.axis(1).status()) not in (2, 3)


def test_a_pass_at_constant_velocity(table: Mic488Controller, engine: RunEngine, told: Documents) -> None:
    (before,) = of_driver(table.driver.get("M1_VMAX")).values()

    @stage_decorator([table.m1])
    @run_decorator()
    def fly() -> MsgGenerator:
        yield from bps.prepare(table.m1, FlyMotorInfo(start_position=10.0, end_position=30.0, time_for_move=2.0), wait=True)
        yield from bps.declare_stream(table.m1, name="pass", collect=True)
        yield from bps.kickoff(table.m1, wait=True)
        yield from bps.complete(table.m1, wait=True)
        yield from bps.collect(table.m1, name="pass")

    engine(fly())
    positions = told.column("table-m1")
    assert len(positions) >= 3
    assert positions == sorted(positions)
    assert 10.0 <= positions[0] < positions[-1] <= 30.0
    times = told.column("table-m1", "timestamps")
    velocity = (positions[-1] - positions[0]) / (times[-1] - times[0])
    assert velocity == pytest.approx(10.0, rel=0.3)
    assert of_driver(table.driver.axis(1).position()) > 30.0
    assert of_driver(table.driver.get("M1_VMAX")) == {"M1_VMAX": before}


def test_a_pass_that_is_stopped(table: Mic488Controller, engine: RunEngine) -> None:
    """The plan that waits for its end fails, and VMAX is what it was."""
    (before,) = of_driver(table.driver.get("M1_VMAX")).values()

    @run_decorator()
    def fly() -> MsgGenerator:
        yield from bps.prepare(table.m1, FlyMotorInfo(start_position=10.0, end_position=60.0, time_for_move=5.0), wait=True)
        yield from bps.kickoff(table.m1, wait=True)
        yield from bps.complete(table.m1, group="pass")
        yield from bps.wait_for([table.m1.stop])
        yield from bps.wait(group="pass")

    with pytest.raises(FailedStatus) as error:
        engine(fly())
    assert "table-m1 was stopped" in failure(error)
    assert 10.0 < of_driver(table.driver.axis(1).position()) < 60.0
    assert of_driver(table.driver.get("M1_VMAX")) == {"M1_VMAX": before}


@run_decorator()
def kicked_off_twice(program: Flyable) -> MsgGenerator:
    yield from bps.kickoff(program, wait=True)
    yield from bps.kickoff(program, wait=True)


def test_a_program(table: Mic488Controller, engine: RunEngine) -> None:
    """It is awaited to its end; one that runs is not begun again; who stops it says whether that is an error."""
    program = table.program
    engine(bps.trigger(program, wait=True))
    assert of_driver(table.driver.program.state()) is ProgramState.STOPPED

    with pytest.raises(FailedStatus) as again:
        engine(kicked_off_twice(program))
    assert "the program is running" in failure(again)

    def stopped(*, success: bool) -> MsgGenerator:
        yield from bps.wait_for([table.driver.program.stop])
        yield from bps.trigger(program, group="program")
        yield from bps.sleep(0.2)
        yield from bps.wait_for([lambda: program.stop(success=success)])
        yield from bps.wait(group="program")

    engine(stopped(success=True))
    assert of_driver(table.driver.program.state()) is ProgramState.PAUSED, "its end would switch drives off"
    with pytest.raises(FailedStatus) as ended:
        engine(stopped(success=False))
    assert "table-program was stopped" in failure(ended)


def test_an_m1486(serve_m1486: Callable[..., Served], engine: RunEngine, told: Documents) -> None:
    twin = serve_m1486("--variant", "B")
    with init_devices():
        drum = M1486Controller(AsyncM1486(f"tcp://127.0.0.1:{twin.tcp_port}", steps_per_unit=40.0, unit="mm"))
    settings = {"start_stop": 200, "acceleration": 5000, "velocity": 2000, "profile": 25000, "microstep": 1, "qualification": 1}
    of_driver(drum.driver.configure(**settings))
    engine(bp.scan([drum.readings], drum.motor, 0.0, 10.0, 3))
    assert told.column("drum-motor") == [0.0, 5.0, 10.0]
    assert told.column("drum-readings-COUNTER") == [0.0, 12800.0, 25600.0]
    with pytest.raises(FailedStatus) as outside:
        engine(bps.mv(drum.motor, -1.0))
    assert "permitted are 0 to" in failure(outside)

    def stopped() -> MsgGenerator:
        yield from bps.abs_set(drum.motor, 1000.0, group="move")
        yield from bps.sleep(0.3)
        yield from bps.wait_for([lambda: drum.motor.stop(success=True)])
        yield from bps.wait(group="move")

    engine(stopped())
    with pytest.raises(FailedStatus) as unknown:
        engine(bps.mv(drum.motor, 0.0))
    assert "PositionUnknown" in failure(unknown)
    of_driver(drum.close())


def test_the_program_of_an_m1486(serve_m1486: Callable[..., Served], engine: RunEngine) -> None:
    """It runs from a label that a plan sets until it is completed or stopped, and is not begun while it runs."""
    twin = serve_m1486("--variant", "B")
    with init_devices():
        drum = M1486Controller(AsyncM1486(f"tcp://127.0.0.1:{twin.tcp_port}"), label=1)
    of_driver(drum.driver.download("[\nj3\n@1\n:11\nw20\nj1\n@2\n:22\nw20\nj2\n@3\n]\n"))
    of_driver(drum.driver.wait())
    program = drum.program

    @run_decorator()
    def run(label: int) -> MsgGenerator:
        yield from bps.mv(program.label, label)
        yield from bps.kickoff(program, wait=True)
        yield from bps.sleep(0.1)
        yield from bps.complete(program, wait=True)

    for label in (1, 2):
        engine(run(label))
        assert of_driver(drum.driver.variable()) == 11 * label
    assert of_driver(program.read_configuration())["drum-program-label"]["value"] == 2
    with pytest.raises(FailedStatus) as wrong:
        engine(run(81))
    assert "the label = 81" in failure(wrong)
    with pytest.raises(FailedStatus) as ended:
        engine(bps.complete(program, wait=True))
    assert "the program was not started here" in failure(ended)

    @run_decorator()
    def stopped(*, success: bool) -> MsgGenerator:
        yield from bps.mv(program.label, 1)
        yield from bps.kickoff(program, wait=True)
        yield from bps.wait_for([lambda: program.stop(success=success)])
        yield from bps.complete(program, wait=True)

    with pytest.raises(FailedStatus) as failed:
        engine(stopped(success=False))
    assert "drum-program was stopped" in failure(failed)

    with pytest.raises(FailedStatus) as again:
        engine(kicked_off_twice(program))
    assert "Busy" in failure(again)
    assert of_driver(drum.driver.is_busy())
    of_driver(program.stop())
    assert not of_driver(drum.driver.is_busy())
    of_driver(drum.close())


def test_analog_inputs(tmp_path: Path, serve: Callable[..., Served], engine: RunEngine, told: Documents) -> None:
    """Each is a signal with the unit of its scale, by the register into which the program copies it."""
    (tmp_path / "copy.prg").write_text("AGAIN:\n$R100 = AIN1\n$I102 = AIN2\nDELAY 0.01\nJUMP AGAIN\n")
    (tmp_path / "table.cfg").write_text("[AIN0]\nLoVal=-1\nHiVal=9\n[AIN1]\nLoVal=0\nHiVal=200\n")
    twin = serve("--config", str(tmp_path / "table.cfg"), "--program", str(tmp_path / "copy.prg"))
    driver = AsyncMic488(f"tcp://127.0.0.1:{twin.tcp_port}")
    inputs = {"pressure": AnalogInput("USER_REGISTER[100]:real", "bar"), "level": AnalogInput("USER_REGISTER[102]:int", "%")}
    with init_devices():
        press = Mic488Controller(driver, analog=inputs)
    of_driver(driver.program.start())
    assert twin.command("pin", "AIN1=2.5", "AIN2=5").returncode == 0
    engine(bps.sleep(0.1))
    engine(bp.count([press.analog]))
    engine(bp.count([press.analog.pressure]))
    assert told.column("press-analog-pressure") == [1.5, 1.5]
    assert told.column("press-analog-level") == [100.0]
    both, single = told.of("descriptor")
    assert both["data_keys"]["press-analog-pressure"]["units"] == "bar"
    assert both["data_keys"]["press-analog-level"]["units"] == "%"
    assert set(both["hints"]["press-analog"]["fields"]) == {"press-analog-pressure", "press-analog-level"}
    assert single["data_keys"]["press-analog-pressure"]["source"].endswith("/1/USER_REGISTER[100]:real")
    changes = observe_value(press.analog.pressure, done_timeout=30.0)
    assert of_driver(anext(changes)) == 1.5
    assert twin.command("pin", "AIN1=10").returncode == 0

    async def until_full() -> None:
        async for value in changes:
            if value == 9.0:
                return

    of_driver(until_full())
    of_driver(changes.aclose())
    of_driver(press.close())


@pytest.mark.parametrize("name", ["name", "two words", "class", "_hidden"])
def test_names_that_an_analog_input_cannot_have(name: str) -> None:
    with pytest.raises(Misuse, match=f"analog input '{name}'"):
        Mic488Controller(AsyncMic488("tcp://127.0.0.1:1"), analog={name: AnalogInput("USER_REGISTER[0]", "V")})


def test_a_point_that_no_register_shows() -> None:
    with pytest.raises(Misuse, match=r"no register shows AIN1; a program that has \$R100 = AIN1 copies it"):
        Mic488Controller(AsyncMic488("tcp://127.0.0.1:1"), points=["IN3", "AIN1"])


def test_the_motor_record_of_a_twin(tmp_path: Path) -> None:
    """The same plan through the EPICS gateway, with ophyd-async's own motor; in a process of its own, because the library of
    Channel Access reads its environment once."""
    table = '[[mic488]]\nname = "table"\n[gateway.epics]\nprefix = "ST:"\nlisten = "127.0.0.1:0"\n'
    with served(table, tmp_path) as points:
        assert client("bluesky_scan.py", points["epics"]["port"], "ST:table:") == {
            "positions": [0.0, 20.0, 40.0],
            "velocities": [0.0, 0.0, 0.0],
            "unit": "imp",
            "exit": "success",
        }


def test_a_device_that_is_not_there(engine: RunEngine) -> None:
    with pytest.raises(NotConnectedError, match=r"127\.0\.0\.1:1"), init_devices():
        nowhere = Mic488Controller(AsyncMic488("tcp://127.0.0.1:1"))  # noqa: F841  named after the variable
