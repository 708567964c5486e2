"""The machine in space: the drawing, what is selected in it, three dimensions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from pymodbus.client import ModbusTcpClient
from studio_page import PICTURES, Studio, button, serious
from tests.conftest import Served, until
from tests.peers.conftest import Master
from tests.studio.conftest import Process, StudioWorld
from tests.support.models import glb, png

WORLD = """
[world]
name = "hall"
[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
[mic488.M1]
unit = "mm"
gear = 100.0
acc = 400.0
dec = 400.0
vel = 100.0
[[axis]]
name = "x"
drive = "table.M1"
unit = "mm"
pulses_per_unit = 100
travel = [-10.0, 200.0]
at = [0, 0, 300]
[[axis.switch]]
above = 100.0
to = "table.IN5"
[[cylinder]]
name = "lift"
extend = "table.OUT1"
stroke = 60.0
on = "x"
at = [0, -60, 0]
along = "-z"
[[conveyor]]
name = "belt"
length = 400.0
speed = 200.0
run = "table.OUT2"
feed_every = "500 ms"
at = [-100, -60, 100]
[[button]]
name = "door"
to = "table.IN7"
[[body]]
name = "hand"
at = [0, -200, 0]
size = [80, 80, 200]
when = "door.pressed == 1"
[[body]]
name = "sign"
at = [-250, 0, 0]
size = [200, 10, 200]
model = "sign.glb"
[[collision]]
name = "crash"
when = "x.position > 150"
[[gate]]
name = "both"
kind = "and"
inputs = ["table.OUT1", "table.OUT2"]
"""


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, {"sign.glb": glb(image=png(16, 16))})


def part(element: str, material: str) -> str:
    return f'svg .solid.{material}[data-element="{element}"]'


def _lefts(page: Page) -> list[float]:
    found = page.locator("svg .solid.piece").filter(visible=True).all()
    return [box["x"] for piece in found if (box := piece.bounding_box()) is not None]


def left(page: Page, element: str, material: str) -> float:
    box = page.locator(part(element, material)).first.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2


def pixels_of_a_mm(page: Page) -> float:
    ruler = page.locator(".ruler").bounding_box()
    assert ruler is not None
    return ruler["width"] / float(page.locator(".ruler").inner_text().split()[0])


def test_the_machine_in_space_is_what_one_sees_first(studio: Studio) -> None:
    """With its axes beside it and curves below; what is drawn is no strip too, and what has no place is one."""
    page = studio.page(panel=None)
    for panel in ("Machine", "Axes", "Scope"):
        expect(page.get_by_role("region", name=panel, exact=True).last).to_be_visible()
    expect(page.get_by_role("img", name="Picture of the machine")).to_be_visible()
    elements = page.get_by_role("group", name="Elements")
    expect(elements.get_by_role("region", name="both, gate")).to_be_visible()
    expect(elements.get_by_role("region", name="belt, conveyor")).to_have_count(0)
    expect(page.get_by_role("region", name="x, moved by table M1")).to_have_count(0)
    phone = studio.page(panel=None, viewport={"width": 390, "height": 844})
    expect(phone.get_by_role("img", name="Picture of the machine")).to_be_visible()
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390


def test_what_moves_is_drawn_where_it_is(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    button(page, "Front").click()
    before, hanging = left(page, "x", "moving"), left(page, "lift", "moving")
    studio.master.enable(1)
    studio.master.move(1, 120.0)
    until(lambda: studio.at(1) == 120.0, "the axis has moved")
    lamp = page.locator(part("x", "lamp"))
    expect(lamp).to_have_class(re.compile(r"\bon\b"))
    scale = pixels_of_a_mm(page)
    assert left(page, "x", "moving") - before == pytest.approx(120.0 * scale, abs=2.0)
    assert left(page, "lift", "moving") - hanging == pytest.approx(120.0 * scale, abs=2.0)
    hand, pieces = page.locator(part("hand", "frame")), page.locator("svg .solid.piece")
    expect(hand).to_be_hidden()
    expect(pieces.first).to_be_visible()  # it waits where it was fed
    waits = pieces.first.bounding_box()
    studio.master.coil(6001, True)
    assert waits is not None
    until(lambda: max(_lefts(page)) > waits["x"] + 30 * scale, "it goes on")
    studio.master.coil(6001, False)
    button(page, "Press door").hover()
    page.mouse.down()
    expect(hand).to_be_visible()
    page.mouse.up()
    expect(hand).to_be_hidden()


def test_travel_is_shown_of_all_axes_or_of_the_selected_one(studio: Studio) -> None:
    """Also where the soft limits are, by the count of the controller."""
    studio.master.reals(10128, 150.0)  # M1_POSLIM_R
    page = studio.page(panel="Machine")
    button(page, "Front").click()
    travel = page.locator(part("x", "travel")).filter(visible=True)
    expect(page.locator(part("x", "moving"))).to_be_visible()
    expect(travel).to_have_count(0)
    button(page, "Travel").click()
    expect(travel).to_have_count(6)  # the bar and its ends, the pointer, and two plates, one of them out of the picture

    def places() -> list[float]:
        boxes = [box for one in travel.all() if (box := one.bounding_box()) is not None]
        return [(box["x"] + box["width"] / 2 - left(page, "x", "moving")) / pixels_of_a_mm(page) for box in boxes]

    until(lambda: all(any(abs(at - end) < 2.0 for at in places()) for end in (-10.0, 0.0, 150.0, 200.0)), "ends and the limit")
    button(page, "Travel").click()
    expect(travel).to_have_count(0)
    page.get_by_label("Selected").select_option("x")
    expect(travel).to_have_count(6)


def test_a_collision_is_said(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    studio.master.enable(1)
    studio.master.move(1, 160.0)
    expect(page.get_by_text("crash: collision")).to_be_visible()
    studio.master.move(1, 100.0)
    expect(page.get_by_text("crash: collision")).to_have_count(0)


def test_a_thing_is_selected_in_the_picture_or_in_the_list(studio: Studio) -> None:
    page = studio.page(panel="Machine", bypass_csp=True)
    button(page, "Labels").click()
    page.locator(part("lift", "rail")).click()
    card = page.get_by_role("region", name="lift, cylinder")
    expect(card).to_be_visible()
    expect(page.get_by_role("list", name="Wiring of lift")).to_contain_text("table.OUT1 → lift.extend")
    page.get_by_text("Set a fault", exact=True).click()
    page.get_by_label("Kind of fault").select_option("jam")
    button(page, "Set fault").click()
    expect(page.get_by_label("Faults of lift")).to_contain_text("jam element=lift")
    page.get_by_label("Faults of lift").get_by_role("button").click()
    expect(page.get_by_label("Faults of lift")).to_have_count(0)
    button(page, "x").click()  # which carries it
    expect(page.get_by_label("x place")).to_have_text("0.00")
    expect(card).to_have_count(0)
    assert serious(page) == []
    page.get_by_label("Selected").select_option("belt")
    button(page, "Remove belt.1").click()
    expect(button(page, "Remove belt.2")).to_be_visible()  # which was fed into its place
    expect(button(page, "Remove belt.1")).to_have_count(0)
    button(page, "Put a workpiece").click()
    expect(page.get_by_text(re.compile("room"))).to_be_visible()
    page.get_by_label("Selected").select_option("")
    expect(page.get_by_label("x place")).to_have_count(0)


def test_a_device_moves_the_machine_and_what_is_not_known_is_grey(
    start_studio: Callable[..., Process], serve: Callable[..., Served], browser: Browser, tmp_path: Path
) -> None:
    """The device is a twin that is served; it has no cylinder."""
    (tmp_path / "table.cfg").write_text("[Axis0]\nUnit=1\nGear=100\nAcc=400\nDec=400\nVel=100\n")
    twin = serve("--config", str(tmp_path / "table.cfg"))
    device = f"tcp://127.0.0.1:{twin.tcp_port}"
    client = ModbusTcpClient("127.0.0.1", port=twin.tcp_port)
    assert client.connect()
    master = Master(client)
    page = browser.new_page(locale="en-US")
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)

    page.goto(start_studio("--device", f"table={device}").url)
    expect(page.get_by_text("What M1 counts in is not known: connect it with config=FILE.")).to_be_visible()
    expect(page.locator(part("x", "moving"))).to_have_class(re.compile("unknown"))

    page.goto(start_studio("--device", f"table={device},config={tmp_path / 'table.cfg'}").url)
    button(page, "Front").click()
    carriage, rod = page.locator(part("x", "moving")), page.locator(part("lift", "rod"))
    expect(carriage).not_to_have_class(re.compile("unknown"))
    before = left(page, "x", "moving")
    master.enable(1)
    master.move(1, 120.0)
    until(lambda: left(page, "x", "moving") - before == pytest.approx(120.0 * pixels_of_a_mm(page), abs=2.0), "it is there")
    expect(rod).to_have_class(re.compile("unknown"))
    expect(page.get_by_text("there may be workpieces")).to_be_visible()
    expect(page.get_by_text("not known: connect")).to_have_count(0)
    expect(page.locator("svg .solid.piece")).to_have_count(0)
    page.close()
    client.close()
    assert complaints == []


@pytest.fixture
def graphics(browser: Browser, chromium: str) -> Iterator[Browser]:
    """A browser that draws WebGL without a graphics processor."""
    arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    started = browser.browser_type.launch(executable_path=chromium, args=arguments)
    yield started
    started.close()


MANY = 200


def greens(png: bytes) -> int:
    """Pixels of the color of `glb`, however it is lit."""
    with Image.open(BytesIO(png)) as image:
        pixels = image.convert("RGB").tobytes()
    return sum(2 * red < green > 1.5 * blue for red, green, blue in zip(*[iter(pixels)] * 3, strict=True))


HAS_CONTEXT = """() => {
  const canvas = document.querySelector("canvas[data-engine]");
  const gl = canvas.getContext("webgl2");
  return gl !== null && !gl.isContextLost();
}"""


def test_three_dimensions_come_back_after_the_context_was_lost(start_studio: Callable[..., Process], graphics: Browser) -> None:
    studio = Studio(start_studio(), graphics)
    page = studio.page(panel="Machine")
    button(page, "3D").click()
    expect(button(page, "Follow")).to_be_visible()
    canvas = page.locator("canvas[data-engine]")
    expect(canvas).to_be_visible()
    PICTURES.mkdir(parents=True, exist_ok=True)
    until(lambda: greens(canvas.screenshot()) > MANY, "the image of the model has come")
    whole = canvas.screenshot(path=PICTURES / "space.png")
    page.evaluate("""() => {
      const gl = document.querySelector("canvas[data-engine]").getContext("webgl2");
      window.lose = gl.getExtension("WEBGL_lose_context");
      window.lose.loseContext();
    }""")
    until(lambda: not page.evaluate(HAS_CONTEXT), "the context is lost")
    page.wait_for_timeout(200)
    page.evaluate("window.lose.restoreContext()")
    until(lambda: page.evaluate(HAS_CONTEXT), "the context is back")
    until(lambda: len(canvas.screenshot()) > 0.8 * len(whole), "it is drawn again")
    assert greens(canvas.screenshot()) > MANY
    button(page, "3D").click()
    expect(canvas).to_have_count(0)
    expect(page.locator(part("x", "moving"))).to_be_visible()
    studio.close()


def test_without_webgl_the_drawing_stays(studio: Studio) -> None:
    page = studio.page(panel="Machine", init_script="HTMLCanvasElement.prototype.getContext = () => null")
    button(page, "3D").click()
    expect(page.get_by_role("alert").last).to_contain_text("no WebGL 2: the drawing stays")
    expect(page.locator(part("x", "moving"))).to_be_visible()
    expect(button(page, "3D")).to_have_attribute("aria-pressed", "false")
    studio.complaints.clear()  # three.js has said it on the console, too
