"""``must_hold`` of the fixtures, as users meet it: each test runs pytest on a small file."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from slides import GUARD, slide

Run = Callable[..., pytest.RunResult]
WORLD = (
    slide()
    + GUARD
    + """
[[script]]
name = "go"
steps = [{ write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 100.0 } }]
"""
)


def test_a_world_that_violates_a_property_fails_its_test(run: Run, pytester: pytest.Pytester) -> None:
    pytester.path.joinpath("slide.toml").write_text(WORLD, encoding="utf-8")
    result = run("""
        import pytest

        pytestmark = pytest.mark.steptwin_world("slide.toml", time="virtual")

        def test_violated(steptwin_world):
            steptwin_world.must_hold("never-moves-while guard.pressed", "closed guard")
            steptwin_world.sleep(0.5)
            steptwin_world.press("guard")
            steptwin_world.sleep(3.0)

        def test_held(steptwin_world):
            near = steptwin_world.must_hold("always x.position < 120")
            steptwin_world.sleep(3.0)
            assert near().holds
            assert near().robustness == pytest.approx(0.1)

        def test_from_now_on(steptwin_world):
            steptwin_world.sleep(3.0)
            steptwin_world.must_hold("never table.M1.moving")
            steptwin_world.sleep(1.0)
    """)
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["property violated: closed guard: table.M1.moving is not 0 at 0.5 s"])


@pytest.mark.parametrize("time", ["virtual", "real"])
def test_a_controller_alone(run: Run, time: str) -> None:
    result = run(
        f"""
        import pytest

        pytestmark = pytest.mark.mic488(time={time!r}, speed=20.0)

        def test_it(mic488):
            mic488.must_hold("never mic488.M1.position > 3")
            axis = mic488.driver.axis(1)
            axis.enable()
            axis.move_to(5.0)
            assert axis.wait().ok
    """.replace(", speed=20.0", "" if time == "virtual" else ", speed=20.0")
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["property violated: never mic488.M1.position > 3: *"])


def test_a_wrong_text_is_told(run: Run) -> None:
    result = run("""
        import pytest

        @pytest.mark.m1486(time="virtual")
        def test_it(m1486):
            with pytest.raises(Exception, match="did you mean 'always'"):
                m1486.must_hold("allways m1486.moving")
    """)
    result.assert_outcomes(passed=1)
