"""The pytest plugin as its users meet it: each test runs pytest on a small file."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin import testing  # else every run imports it anew, for pytester forgets what a run has imported

ROOT = Path(__file__).parents[2]
WORLD = ROOT / "examples" / "worlds" / "feeder.toml"


Run = Callable[..., pytest.RunResult]


# ---------------------------------------------------------------------- time


def test_rigs_can_be_named_in_annotations() -> None:
    assert {name for name in testing.__all__ if not hasattr(testing, name)} == set()


def test_in_virtual_time_a_driver_in_the_tests_thread_moves_the_twin(run: Run) -> None:
    run("""
        import threading
        import pytest

        @pytest.mark.mic488(time="virtual")
        def test_it(mic488):
            threads = threading.active_count()
            axis = mic488.driver.axis(1)
            axis.enable()
            axis.move_to(200.0)
            assert axis.wait().ok
            assert mic488.axis(1).position == 200.0
            assert mic488.axis(1).position_p == 20_000
            # 200 mm at 25 mm/s and 50 mm/s²: 8.5 s.
            assert 8.5 <= mic488.time < 8.7
            assert threading.active_count() == threads
            mic488.sleep(3600)
            assert mic488.time > 3600
    """).assert_outcomes(passed=1)


def test_virtual_time_gives_the_same_each_time(run: Run) -> None:
    run("""
        import pytest

        stories = []

        @pytest.mark.mic488(time="virtual", link="rtu", faults=["no-answer probability=0.2"], seed=5)
        @pytest.mark.parametrize("time", [1, 2])
        def test_it(mic488, time):
            axis = mic488.driver.axis(2)
            axis.enable()
            axis.home(-10.0)
            axis.wait()
            stories.append((mic488.time, mic488.log(), mic488.faults))
            assert mic488.faults[0].happened > 0
            assert stories[0] == stories[-1]
    """).assert_outcomes(passed=2)


@pytest.mark.parametrize("link", ["tcp", "rtu", "pty"])
def test_in_real_time_programs_find_the_twin_at_its_address(run: Run, link: str) -> None:
    run(f"""
        import pytest
        from steptwin.drivers import Mic488

        @pytest.mark.mic488(link={link!r}, unit=3, firmware="1.23")
        def test_it(mic488):
            with Mic488(mic488.address, 3) as driver:
                assert driver.firmware == "1.23"
                mic488.set_pin("IN20", 1)
                mic488.until(lambda: driver.inputs()[19])
            assert mic488.device_address == mic488.address + ",unit=3"
    """).assert_outcomes(passed=1)


def test_time_can_be_virtual_for_all_tests(run: Run, pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nsteptwin_time = virtual\n")
    run("""
        def test_it(mic488):
            mic488.sleep(1000)
            assert mic488.time == 1000
    """).assert_outcomes(passed=1)


def test_a_condition_that_does_not_come_fails_with_its_name_and_the_last_frames(run: Run) -> None:
    result = run("""
        import pytest

        @pytest.mark.mic488(time="virtual")
        def test_it(mic488):
            mic488.driver.enable(1)
            mic488.until(lambda: mic488.axis(1).position > 5, within_s=3, what="the axis beyond 5 mm")
    """)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*Failed: after 3 s not yet: the axis beyond 5 mm", "*mic488: what happened last*"])
    result.stdout.fnmatch_lines(["*→ write M_ENABLE = M1 (1)", "*← wrote M_ENABLE = M1 (1)"])


def test_until_sees_what_lasts_a_moment_only(run: Run) -> None:
    run("""
        import pytest

        @pytest.mark.mic488(time="virtual")
        def test_it(mic488):
            mic488.later(1.0, lambda: mic488.set_pin("IN9", 1))
            mic488.later(1.000001, lambda: mic488.set_pin("IN9", 0))
            mic488.until(lambda: mic488.pins["IN9"])
            assert mic488.time == 1.0
    """).assert_outcomes(passed=1)


# ---------------------------------------------------------------------- hands at the machine


def test_sensors_encoders_power_and_events(run: Run) -> None:
    run("""
        import pytest

        @pytest.mark.mic488(time="virtual")
        def test_it(mic488):
            axis = mic488.driver.axis(1)
            axis.enable()
            mic488.later(1.0, lambda: mic488.set_pin("in5", 1))
            axis.move_to(200.0)
            end = axis.wait(check=False)
            assert end.reason.name == "LIMIT_R"
            mic488.set_pin("AIN1", 4.5)
            assert mic488.pins["AIN1"] == 4.5
            mic488.turn_encoder(2, 40)
            assert mic488.driver.axis(2).encoder() == 40 == mic488.axis(2).encoder
            mic488.power_cycle()
            assert not mic488.axis(1).enabled
            assert mic488.events[-1].code == "power-on"
            assert mic488.call(lambda device, now: device.firmware.name) == "1.70"
    """).assert_outcomes(passed=1)


def test_a_switch_that_is_stuck_stays_stuck_under_a_hand(run: Run) -> None:
    run("""
        def test_it(mic488):
            mic488.fault("stuck pin=IN9 value=0 name=kl")
            mic488.set_pin("IN9", 1)
            assert not mic488.driver.inputs()[8]
            mic488.clear_faults("kl")
            assert mic488.faults == []
            mic488.until(lambda: mic488.driver.inputs()[8])
    """).assert_outcomes(passed=1)


def test_with_a_configuration_and_a_program_the_twin_is_that_machine(run: Run, pytester: pytest.Pytester) -> None:
    for name in ("slave.cfg", "slave.prg"):
        shutil.copy(ROOT / "examples" / "mic488" / name, pytester.path)
    run("""
        import pytest

        @pytest.mark.mic488(time="virtual", config="slave.cfg", program="slave.prg")
        def test_it(mic488):
            mic488.driver.program.start()
            mic488.until(lambda: mic488.call(lambda device, now: device.program.state.name) == "RUNNING")
    """).assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("foo=1", "no option 'foo': there are firmware, config,"),
        ("time='fast'", "time = 'fast': permitted are 'real', 'virtual'"),
        ("link='usb'", "link = 'usb': permitted are 'tcp', 'rtu', 'pty'"),
        ("unit=300", "unit = 300: permitted are 1 to 247"),
        ("speed=0", "speed = 0: permitted are 0.001 to 1000"),
        ("firmware='9'", "1.23, 1.40, 1.70"),
        ("config='no.cfg'", "cannot read "),
        ("faults=['crc nth=3']", "fault crc happens on Modbus RTU: line 'bus' carries Modbus TCP"),
        ("faults=['nonsense']", "nonsense"),
        ("3", "3 needs a name"),
    ],
)
def test_wrong_options_are_told_in_a_line(run: Run, options: str, message: str) -> None:
    result = run(f"""
        import pytest

        @pytest.mark.mic488({options})
        def test_it(mic488):
            pass
    """)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"fixture mic488: *{message.replace('[', '[[]')}*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_the_nearest_marker_has_the_last_word(run: Run) -> None:
    run("""
        import pytest

        pytestmark = pytest.mark.mic488(time="virtual", firmware="1.23")

        @pytest.mark.mic488(firmware="1.40")
        def test_it(mic488):
            assert mic488.driver.firmware == "1.40"
            mic488.sleep(100)

        def test_other(mic488):
            assert mic488.driver.firmware == "1.23"
    """).assert_outcomes(passed=2)


def test_a_twin_in_virtual_time_has_no_address(run: Run) -> None:
    result = run("""
        import pytest

        @pytest.mark.mic488(time="virtual")
        def test_it(mic488):
            mic488.address
    """)
    result.stdout.fnmatch_lines(["*a twin in virtual time has no address*use time='real'*"])


# ---------------------------------------------------------------------- M1486 and worlds


@pytest.mark.parametrize("how", ["time='virtual'", "link='tcp'", "link='pty'"])
def test_an_m1486(run: Run, how: str) -> None:
    run(f"""
        import pytest

        @pytest.mark.m1486({how}, variant="B", address=3)
        def test_it(m1486):
            m1486.send("x3", "F1280", "R", "U20")
            assert m1486.receive(within_s=20) == b"B"
            assert m1486.position == 1280
            assert not m1486.is_moving
            m1486.set_pin("B5", 0)
            assert m1486.pins["B5"] == 0
            assert m1486.state.pins["B5"] == 0
            assert m1486.state.details["address"] == "3"
            m1486.power_cycle()
            assert m1486.call(lambda chip, now: chip.drive.counter_u(now)) == 0
    """).assert_outcomes(passed=1)


@pytest.mark.parametrize("how", ["time='virtual'", "speed=10"])
def test_an_m1486_with_its_driver(run: Run, how: str) -> None:
    run(f"""
        import pytest

        @pytest.mark.m1486({how}, variant="B", address=3)
        def test_it(m1486):
            m1486.driver.move_by(200)
            assert str(m1486.driver.wait()).startswith("chip 3: came to rest at 200 step, target 200 step")
            assert m1486.driver.variant.name == "B"
            assert m1486.position == 200 * 64
    """).assert_outcomes(passed=1)


def test_characters_that_do_not_come_fail_the_test(run: Run) -> None:
    result = run("""
        import pytest

        @pytest.mark.m1486(time="virtual")
        def test_it(m1486):
            m1486.send("U20")
            m1486.receive(3)
    """)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*after 1 s only 1 of 3 characters: 41"])


@pytest.mark.parametrize("time", ["virtual", "real"])
def test_a_world(run: Run, pytester: pytest.Pytester, time: str) -> None:
    shutil.copy(WORLD, pytester.path)
    run(f"""
        import pytest
        from steptwin.subject.commands import ListFaults

        @pytest.mark.steptwin_world("feeder.toml", time={time!r}, speed=50.0)
        def test_it(steptwin_world):
            world = steptwin_world
            world.until(lambda: world.value("table.M1.status") == 4, within_s=60, what="home")
            driver = world.driver("table")
            assert driver.axis(1).unit == "mm"
            world.until(lambda: world.axis("x").position > 100, within_s=60)
            world.set_pin("table.IN9", 1)
            world.until(lambda: driver.inputs()[8])
            world.press("start", 0.2)
            world.fault("no-answer lost=answer count=1")
            assert world.driver("table").inputs()[8]
            assert world.axis("x").lost == 0
            assert world.do(ListFaults())[0]["fault"] == "no-answer lost=answer count=1"
            world.channel("chips").write(b"x3\\rU20\\r")
            received = []
            world.until(lambda: received.append(world.channel("chips").read(0.0)) or b"B" in received, within_s=20)
    """).assert_outcomes(passed=1)


def test_a_world_needs_its_file(run: Run) -> None:
    result = run("""
        def test_it(steptwin_world):
            pass
    """)
    result.stdout.fnmatch_lines(['fixture steptwin_world: no world is given: @pytest.mark.steptwin_world("machine.toml")'])


# ---------------------------------------------------------------------- nothing is left


def test_no_threads_or_sockets_are_left_even_where_programs_stay_connected(run: Run) -> None:
    threads = threading.active_count()
    run("""
        import socket

        def test_it(mic488, m1486, request):
            host, port = mic488.address.removeprefix("tcp://").split(":")
            connected = socket.create_connection((host, int(port)))
            request.config.add_cleanup(connected.close)
            m1486.channel.write(b"U1")
    """).assert_outcomes(passed=1)
    assert threading.active_count() == threads


def test_a_twin_that_fails_by_itself_is_told_after_the_test(run: Run) -> None:
    result = run("""
        def test_it(mic488):
            def fail():
                raise ValueError("no such thing")
            mic488.later(0.0, fail)
            mic488.sleep(0.2)
    """)
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["fixture mic488, after the test: the MIC488 failed: no such thing"])


def test_it_works_in_processes_of_xdist(run: Run) -> None:
    run(
        """
        import pytest

        def test_it(mic488):
            assert mic488.driver.axis(1).position() == 0.0
        """,
        "-p",
        "xdist",
        "-n1",
    ).assert_outcomes(passed=1)


# ---------------------------------------------------------------------- coverage

COVERED = """
    import pytest
    from steptwin.files.world import World

    pytestmark = [pytest.mark.mic488(program="p.prg", time="virtual"), pytest.mark.steptwin_world("w.toml", time="virtual")]

    def test_a_controller(mic488):
        mic488.driver.program.start()
        mic488.sleep(1.0)

    def test_a_world(steptwin_world):
        steptwin_world.set_pin("m.IN1", 1)
        steptwin_world.sleep(1.0)

    def test_a_world_of_its_own(steptwin_coverage):
        world = World.load("w.toml")
        steptwin_coverage(world)
        world.run_to(1_000_000_000)
"""
"""Three runs of a program; in the second IN1 is high."""


@pytest.fixture
def covered(run: Run, pytester: pytest.Pytester) -> Run:
    (pytester.path / "p.prg").write_text("IF IN1 = 1\nOUT1 = ON\nELSE\nDELAY 0.1\nENDIF\nDELAY 0.05\nIF IN1 = 1\nEND\nENDIF\n")
    world = '[world]\nname = "w"\n[[mic488]]\nname = "m"\nprogram = "p.prg"\nstart = true\n'
    (pytester.path / "w.toml").write_text(world)
    return run


@pytest.mark.parametrize("processes", [(), ("-p", "xdist", "-n2")])
def test_coverage_adds_up_over_all_tests(covered: Run, pytester: pytest.Pytester, processes: tuple[str, ...]) -> None:
    """The input is seen after the first condition, so its other way is never gone."""
    done = covered(COVERED, "--steptwin-coverage=-", "--steptwin-coverage=c.json", *processes)
    done.assert_outcomes(passed=3)
    done.stdout.fnmatch_lines(["*coverage of motion programs*", "p.prg *6 *1 *4 *1 *80.0 % *2, 1->2", "wrote c.json"])
    (file,) = json.loads((pytester.path / "c.json").read_text())["files"]
    assert {one["line"]: one["count"] for one in file["statements"]} == {1: 3, 2: 0, 4: 3, 6: 3, 7: 3, 8: 1}


def test_without_the_option_nothing_is_reported(covered: Run) -> None:
    done = covered(COVERED)
    done.assert_outcomes(passed=3)
    assert "coverage of motion programs" not in done.stdout.str()


def test_a_coverage_file_that_cannot_be_written_is_refused_before_the_tests(covered: Run) -> None:
    done = covered(COVERED, "--steptwin-coverage=c.xml")
    done.stderr.fnmatch_lines(["*coverage in c.xml: the name must end with .info, .html, .json; - prints a table"])


# ---------------------------------------------------------------------- others' test runs


def test_the_plugin_brings_nothing_along_until_it_is_used(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("""
        import sys

        def test_it():
            mine = {name for name in sys.modules if name.startswith("steptwin")}
            assert mine == {"steptwin", "steptwin.errors", "steptwin.pytest_plugin"}
    """)
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
