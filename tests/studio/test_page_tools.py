"""Calculator, configuration and tag lists in a real browser. What is written is seen by an independent Modbus master."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from studio_page import Studio, button, show
from tests.conftest import until

M1_ACC, M1_DEC, M1_VMAX = 10036, 10044, 10052


def registers(studio: Studio) -> tuple[float, float, float]:
    """M1_ACC, M1_DEC, M1_VMAX."""
    acc, dec, vmax = (studio.master.real(studio.master.words(address, 2)) for address in (M1_ACC, M1_DEC, M1_VMAX))
    return acc, dec, vmax


def calculated(page: Page, **fields: str) -> None:
    for name, value in fields.items():
        page.locator(f"#calc-{name}").fill(value)


def test_a_move_is_calculated_and_its_settings_are_sent(studio: Studio) -> None:
    page = studio.page(panel="Calculator")
    calculated(page, distance="100")
    expect(page.get_by_role("status", name="Total time")).to_have_text("2.6")
    expect(button(page, "Send to M1")).to_be_disabled()
    calculated(page, velocity="50", acceleration="200", deceleration="250")
    expect(page.get_by_role("status", name="Total time")).to_have_text("2.225")
    button(page, "Send to M1").click()
    until(lambda: registers(studio) == (200, 250, 50), "the registers have what was calculated")
    button(page, "↶ Undo").click()
    until(lambda: registers(studio) == (400, 400, 40), "the registers have what they had")


def test_what_a_time_determines(studio: Studio) -> None:
    page = studio.page(panel="Calculator")
    page.get_by_label("Calculate", exact=True).select_option(label="Velocity")
    calculated(page, distance="100")
    page.get_by_role("textbox", name="Total time").fill("2.6")
    expect(page.locator("#calc-velocity")).to_contain_text("40 mm/s")
    page.get_by_role("textbox", name="Total time").fill("0.1")
    expect(page.locator("form").get_by_role("alert")).to_contain_text(
        "total time = 0.1 s cannot be: with velocity above 0 up to 640 mm/s it is 1 s"
    )


def test_the_settings_of_a_chip_are_sent_as_commands(studio: Studio) -> None:
    page = studio.page(panel="Calculator")
    page.get_by_label("Axis", exact=True).select_option(label="drum")
    calculated(page, distance="64000", velocity="2000")
    button(page, "Send to drum").click()
    expect(page.get_by_role("row", name="V 2000 2000")).to_be_visible()
    show(page, "Configuration")
    page.get_by_label("Controller", exact=True).select_option("drum")
    expect(page.get_by_role("status", name="Velocity", exact=True)).to_have_text("2000")
    page.get_by_label("New value of Velocity").fill("30000")
    page.get_by_label("New value of Velocity").press("Enter")
    expect(page.get_by_text("permitted is 16 to 20000").first).to_be_visible()
    page.get_by_label("New value of Velocity").fill("900")
    page.get_by_label("New value of Velocity").press("Enter")
    expect(page.get_by_role("status", name="Velocity", exact=True)).to_have_text("900")
    button(page, "↶ Undo").click()
    expect(page.get_by_role("status", name="Velocity", exact=True)).to_have_text("2000")


def test_a_configuration_is_edited_written_and_saved(studio: Studio, tmp_path: Path) -> None:
    page = studio.page(panel="Configuration")
    expect(page.get_by_label("M1 Unit").locator("option:checked")).to_have_text("mm")
    expect(page.get_by_label("M1 EnWired").locator("option:checked")).to_have_text("wired")
    page.get_by_text("GEAR from mechanics").click()
    page.get_by_label("Travel in one revolution").fill("5")
    button(page, "GEAR M1 = 640 imp/mm").click()
    expect(page.get_by_label("M1 Gear")).to_have_value("640")
    button(page, "↶ Undo").click()
    expect(page.get_by_label("M1 Gear")).to_have_value("100.0")
    page.get_by_label("M1 Acc").fill("300,5")
    page.get_by_label("M1 Acc").press("Enter")
    expect(page.get_by_role("row", name="M1_ACC 400 300.5 mm/s²")).to_be_visible()
    assert registers(studio) == (400, 400, 40)
    button(page, "Write to table").click()
    until(lambda: registers(studio) == (300.5, 400, 40), "the register has the value of the file")
    button(page, "↶ Undo writing").click()
    until(lambda: registers(studio) == (400, 400, 40), "the register has what it had")
    with page.expect_download() as download:
        button(page, "Save file").click()
    download.value.save_as(tmp_path / "table.cfg")
    assert "Acc=300,5" in (tmp_path / "table.cfg").read_text()


def test_edits_that_overlap_are_all_kept(studio: Studio) -> None:
    page = studio.page(panel="Configuration")
    for label, value in (("M1 Acc", "200"), ("M1 Dec", "100"), ("M1 HomeMode", "2")):
        page.get_by_label(label).evaluate("(field, value) => { field.value = value }", value)
    page.evaluate(
        """() => document.querySelectorAll(":is([aria-label='M1 Acc'], [aria-label='M1 Dec'], [aria-label='M1 HomeMode'])")
        .forEach((field) => field.dispatchEvent(new Event("change", { bubbles: true })))"""
    )
    expect(page.get_by_role("row", name="M1_DEC 400 100 mm/s²")).to_be_visible()
    expect(page.get_by_role("row", name="M1_ACC 400 200 mm/s²")).to_be_visible()
    expect(page.get_by_text("• changed")).to_have_count(3)


def test_a_file_is_opened_with_what_is_wrong_in_it(studio: Studio, tmp_path: Path) -> None:
    page = studio.page(panel="Configuration")
    file = tmp_path / "mine.cfg"
    file.write_bytes("; oś\r\n[Axis0]\r\nUnit=3\r\nGear=0\r\nVel=50\r\n".encode("cp1250"))
    page.locator('input[type="file"]').set_input_files(file)
    expect(page.get_by_text("Line 4: [Axis0] Gear = 0 is not permitted")).to_be_visible()
    expect(button(page, "Write to table")).to_be_disabled()
    expect(page.get_by_label("M1 Vel")).to_have_value("50")


@pytest.mark.parametrize("panel", ["Calculator", "Configuration"])
def test_the_space_key_stops_from_these_panels_too(studio: Studio, panel: str) -> None:
    page = studio.page(panel=panel)
    studio.master.enable(1)
    studio.master.run(1, 10.0)
    until(lambda: studio.at(1) > 1, "the axis moves")
    page.locator("body").press("Space")
    until(lambda: studio.stands(1), "space has stopped it")
    assert studio.at(1) > 1, "it stands where it was stopped"


def test_a_tag_list_is_exported_and_imported(studio: Studio, tmp_path: Path) -> None:
    page = studio.page(panel="Registers")
    page.get_by_role("searchbox").fill("M1_ACC")
    with page.expect_download() as download:
        button(page, "Export tags").click()
    download.value.save_as(tmp_path / "tags.csv")
    lines = (tmp_path / "tags.csv").read_text().splitlines()
    assert lines[1].startswith("M1_ACC,REAL,RW,4x holding register,10036,10037,410037,2,low word first,")
    page.get_by_role("searchbox").fill("")
    (tmp_path / "mine.csv").write_text("tag;address_0;data_type\nSoft;10036;REAL\nLevel;12;REAL\nNowhere;9;BOOL\n")
    page.locator('input[type="file"]').set_input_files(tmp_path / "mine.csv")
    expect(page.get_by_text("not found here: Nowhere")).to_be_visible()
    expect(page.get_by_role("status", name="USER_REGISTER[12]:real")).to_have_text("0")
    expect(page.get_by_role("status", name="M1_ACC")).to_have_text("400")
    page.reload()
    page.get_by_label("Group").select_option(label="Tag list")
    expect(page.get_by_role("status", name="M1_ACC")).to_have_text("400")


def test_registers_are_read_on_demand(studio: Studio) -> None:
    page = studio.page(panel="Registers")
    page.get_by_role("searchbox").fill("M1_ACC")
    value = page.get_by_role("status", name="M1_ACC")
    expect(value).to_have_text("400")
    page.get_by_label("Cyclic read").select_option(label="on demand")
    expect(value).to_have_text("400")
    studio.master.reals(M1_ACC, 123.0)
    expect(value).to_have_text("400")
    button(page, "Read").click()
    expect(value).to_have_text("123")
    studio.master.reals(M1_ACC, 150.0)
    page.get_by_label("New value of M1_ACC").fill("77")
    button(page, "Write M1_ACC").click()
    expect(value).to_have_text("77")
    button(page, "Undo writing M1_ACC").click()
    expect(value).to_have_text("150")
    studio.master.reals(M1_ACC, 123.0)
    page.get_by_label("Cyclic read").select_option(label="every 0.5 s")
    studio.master.reals(M1_ACC, 99.0)
    expect(value).to_have_text("99")


def test_the_first_minute_is_skipped_for_good(studio: Studio) -> None:
    page = studio.page(panel="Time")
    guide = page.get_by_role("region", name="First minute")
    guide.get_by_role("button", name="Show").click()
    expect(page.get_by_role("region", name="Overview", exact=True).last).not_to_be_empty()
    guide.get_by_role("button", name="Next").click()
    expect(guide).to_contain_text("hold a jog button")
    page.reload()
    expect(guide).to_contain_text("hold a jog button")
    guide.get_by_role("button", name="Skip").click()
    expect(guide).to_have_count(0)
    page.reload()
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("live")
    expect(guide).to_have_count(0)
