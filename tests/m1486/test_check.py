"""The checker. Its findings in wrong programs stand in golden/*.golden (`golden_findings`).

Regenerate with ``make golden ARGS=tests/m1486/test_check.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from golden_findings import shown
from hypothesis import assume, given
from hypothesis import strategies as st

from steptwin.diagnostics import SourceText
from steptwin.m1486 import findings
from steptwin.m1486.check import check
from steptwin.m1486.lines import DUAL_DAC, STEP_DIRECTION, TWO_DACS, interface
from steptwin.m1486.syntax import format_program
from steptwin.m1486.variants import VARIANTS, Variant, variant

if TYPE_CHECKING:
    from m1486_programs import Programs

GOLDEN = Path(__file__).parent / "golden"
HEADER = "# make golden ARGS=tests/m1486/test_check.py"
PROGRAM, FINDINGS = "--- program ---\n", "--- findings ---\n"
A, B, E1 = variant("A"), variant("B"), variant("E1")


def read(file: Path) -> tuple[str, str, str]:
    """Options, program and findings of a golden file."""
    head, _, rest = file.read_text().partition(PROGRAM)
    program, _, found = rest.partition(FINDINGS)
    return head.removeprefix(HEADER + "\n").strip(), program, found


def findings_of(options: str, program: str) -> str:
    name, _, driver = options.removeprefix("# ").partition(" ")
    checked = check(program, variant(name), interface(driver))
    return shown(SourceText("program", program), checked.diagnostics) + "\n"


@pytest.mark.parametrize("file", sorted(GOLDEN.glob("*.golden")), ids=lambda file: file.stem)
def test_golden(file: Path) -> None:
    options, program, expected = read(file)
    assert findings_of(options, program) == expected


def test_golden_files_show_every_finding() -> None:
    everything = "".join(read(file)[2] for file in GOLDEN.glob("*.golden"))
    assert [f.code for f in findings.TABLE if f" {f.severity.value} {f.code} «" not in everything] == []


def codes(text: str, v: Variant = A, driver: str = "sd") -> list[str]:
    return [d.code for d in check(text, v, interface(driver)).diagnostics]


SUITABLE = [
    (1, "A", "sd"), (1, "B", "two"), (1, "C", "dual"),
    *((n, v.name, i) for n in (2, 3, 4) for v in VARIANTS for i in ("sd", "dual", "two")),
    (5, "A", "sd"), (5, "E2", "dual"),
    (6, "A", "sd"), (6, "B2x", "two"),
]  # fmt: skip


@pytest.mark.parametrize(("number", "name", "driver"), SUITABLE)
def test_examples_of_the_manual_are_clean(manual_examples: dict[int, str], number: int, name: str, driver: str) -> None:
    assert codes(manual_examples[number], variant(name), driver) == []


def test_examples_are_refused_where_the_manual_says_so(manual_examples: dict[int, str]) -> None:
    assert codes("\\", E1) == codes("\\\n\\", E1) == []
    assert "M134" in codes(manual_examples[1], E1)  # reset cannot be sent together with other commands
    assert "M113" in codes(manual_examples[5], A, "two")  # B8 is there with Step & Direction and Dual DAC only
    assert "M110" in codes(manual_examples[6], E1)  # E types have no address 0


# The other programs of chapter VII, enclosed in [ ] where the manual encloses them.
MANUAL = {
    "if": "[\n@1\nw3000\ni7h3\nb64000\nr\nj1\n@3\nf6400\nr\nj1\n]",
    "subroutine": "[\n@1\ni1l6\nf12800\n'3\nz3\nj1\n@6\nb25600\n'3\nz4\nj1\n@3\nr\nw2000\nd\nr\n.\n]",
    "backward": "B640\nR",
    "direction": "B640\nR\nD\nR",
    "forward": "F640\nR",
    "carry": "[\n@5\n?14\n-10\ni87H5\nr\n]",
    "divide 1": "*200\nF",
    "divide 2": "[\n?14\n*10\nt46\n+184\na\n]",
    "units": "F64",
    "functions": "T51\nC43",
    "flags": "T85\nC85",
}


@pytest.mark.parametrize("text", MANUAL.values(), ids=MANUAL)
@pytest.mark.parametrize("v", [B, variant("C2x")], ids=lambda v: v.name)
def test_programs_of_chapter_7_are_clean(text: str, v: Variant) -> None:
    assert codes(text, v) == []


def test_registers_of_chapter_7_are_clean_where_they_do_not_share_the_memory() -> None:
    text = "T58\n+5\nC58\n*2\n<3"
    assert codes(text, B) == []
    assert codes(text, A) == ["M216"]
    assert codes("\\\n" + text, A) == []


def test_registers_on_a_are_safe_after_a_reset_up_to_736_bits() -> None:
    fill = "D\n" * 90  # 8 bits each
    assert codes("\\\n" + fill + ">1", A) == []  # 736 bits
    assert codes("\\\n" + fill + "D\n>1", A) == ["M216"]
    assert codes(">9\n<10", A) == []


def test_a_command_that_is_reached_in_several_ways_is_found_once() -> None:
    """With two velocities, and with the variable unknown or 1."""
    assert codes("T40\nI2H1\nV300\n@1\nC1", B).count("M215") == 1
    assert codes("[\nT40\n:1\nI2H1\n?12\n@1\n!12\nJ1\n]", B).count("M215") == 1


# ---------------------------------------------------------------------- memory


def test_memory_counts_what_the_manual_counts() -> None:
    (chip,) = check("[\n@1\nL5\nA1000\nW500\nI1H1\nF64\nR\nE\n]", B).memory
    assert [c.bits for c in chip.commands] == [0, 0, 16, 24, 32, 32, 32, 8, 8, 0]
    assert (chip.address, chip.total, chip.files, chip.limit) == (None, 152, (152,), 2032)


@pytest.mark.parametrize("v", VARIANTS, ids=lambda v: v.name)
def test_a_file_may_fill_the_memory_to_the_last_bit(v: Variant) -> None:
    full = "[\n" + "R\n" * (v.memory_bits // 8) + "]"
    assert codes(full, v) == []
    assert "M135" in codes(full.replace("]", "R\n]"), v)


def test_each_chip_of_a_chain_has_its_own_memory(manual_examples: dict[int, str]) -> None:
    chips = check(manual_examples[6], A).memory
    assert [(c.address, c.total, c.files) for c in chips] == [(0, 176, (128,)), (7, 128, (128,))]


def test_commands_for_all_chips_count_for_each() -> None:
    chips = check("X1\nF64\nXG\nR\nX2\nD\nD", A).memory
    assert [[str(c.command) for c in chip.commands] for chip in chips] == [["F64", "R"], ["R", "D", "D"]]


def test_what_acts_when_received_is_not_stored() -> None:
    (chip,) = check("[\nR\nK\nC75\n]", B).memory
    assert chip.files == (8,)


def test_m_12_a_label_that_has_left_the_ring_is_out_of_reach() -> None:
    back = "@1\n" + "R\n" * 106
    assert codes(back + "J1", A) == []  # 106 * 8 + 16 = 864 bits
    assert codes(back + "R\nJ1", A) == ["M122"]
    assert codes("L3\n" + "R\n" * 106 + "E", A) == ["M122"]


def test_m_12_a_file_may_have_overwritten_a_label_before_it_unless_it_does_not_fit_at_all() -> None:
    before = "@1\n" + "R\n" * 100
    assert codes(before + "[\n" + "R\n" * 6 + "J1\n]", A) == []  # 106 * 8 + 16 = 864 bits
    assert codes(before + "[\n" + "R\n" * 7 + "J1\n]", A) == ["M122"]
    assert codes("[\n@1\n" + "R\n" * 107 + "J1\n]", A) == codes("[\n" + "R\n" * 109 + "]", A)


# ---------------------------------------------------------------------- assumptions


def test_m_4_a_large_acceleration_is_doubtful_only_at_a_move() -> None:
    assert codes("A13000\nR") == []
    assert codes("A13001\nR") == ["M213"]
    assert codes("A13001\nS201\nR") == []
    assert codes("S70\nA1000\nR") == []


def test_m_5_four_levels_of_loop() -> None:
    def nest(levels: int) -> str:
        return "L2\n" * levels + "R\n" + "E\n" * levels

    assert codes(nest(1)) == []
    assert codes(nest(4)) == ["M203"] * 3
    assert codes(nest(5)) == ["M203"] * 3 + ["M125"]


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("[\nL2\nR\nI1H1\nE\n@1\nR\n]", "I1H1 leads out of a loop", "the loop stays unfinished"),
        ("[\nI1H1\nL2\n@1\nR\nE\n]", "I1H1 leads into a loop from outside", "its E would find no L"),
    ],
)
def test_jumps_that_cross_a_loop(text: str, message: str, hint: str) -> None:
    (found,) = (d for d in check(text, A, interface("sd")).diagnostics if d.code == "M204")
    assert (found.message, found.hint) == (message, hint)


def test_m_8_no_ramp_where_the_speed_is_not_above_start_stop() -> None:
    assert codes("V201\nR") == []
    assert codes("V200\nR") == ["M210"]
    assert codes("V200\nF64\nS100\nR") == []


def test_m_11_pairs_of_m_and_q_are_judged_at_the_move() -> None:
    assert codes("M64\nQ4\nR\nM4\nQ2\nQ1\nR") == []
    assert codes("M2\n)1") == ["M112"]


@pytest.mark.parametrize(("m", "q"), [(m, q) for m in (1, 2, 4, 8, 16, 32, 64) for q in (1, 2, 4)])
def test_m_11_every_pair(m: int, q: int) -> None:
    allowed = {1: [1], 2: [2], 4: [1, 4], 8: [1, 2], 16: [4], 32: [1, 2, 4], 64: [1, 2, 4]}
    assert ("M112" in codes(f"M{m}\nQ{q}\nV300\nR")) == (q not in allowed[m])


def test_m_11_multiples_of_the_microstep_in_force() -> None:
    assert codes("F64") == codes("M64\nF1") == codes("F16", A, "two") == []
    assert codes("F32") == codes("M4\nF8") == codes("B8", A, "dual") == ["M111"]
    assert codes("G100\n=100") == ["M111", "M111"]
    assert codes("M4\nF16\nM1\nR") == ["M111"]  # right when given, wrong when run


@pytest.mark.parametrize(("speed", "found"), [(6000, []), (6001, ["M211"])])
def test_the_highest_speed_is_that_of_q_or_the_end_of_the_low_range(speed: int, found: list[str]) -> None:
    assert codes(f"M2\nQ2\nV{speed}\nR") == found
    # The forbidden pair has a low range that is faster than its Q.
    assert codes(f"M2\nQ4\nV{speed}\nR") == ["M112", *found]


@pytest.mark.parametrize("unknown", ["?16\nQ\nM4", "?16\nM\nQ4", "?16\nV\nM4\nQ4"])
def test_a_setting_that_is_unknown_is_not_judged(unknown: str) -> None:
    assert codes(f"V300\n{unknown}\nR", B) == []


def test_g_counts_from_a_counter_below_0_only_where_the_position_is_known() -> None:
    assert codes("B64\nR\nG640") == ["M221"]
    assert codes("B64\nR\n)1\nG640") == []
    assert codes("B64\nR\n=640\nG640") == []
    assert codes("B64\nR\nC100\nG640") == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        # Back from a subroutine below 0.
        ("[\n'1\ng640\nr\nj2\n@1\nb64\nr\n.\n@2\n]", ["M221"]),
        # Two positions below 0 at one G.
        ("[\nb64\nr\ni1h2\nr\n@2\ng640\nr\n]", ["M221"]),
        # There and back: each turn of the loop begins with its D.
        ("L2\nd\nr\nE\ng640", []),
        ("L3\nd\nr\nE\ng640", ["M221"]),
        # Six turns of a loop in a loop, each of which begins with its D.
        ("L2\nL3\nd\nr\nE\nE\ng640", ["M203"]),
        ("L3\nL3\nd\nr\nE\nE\ng640", ["M203", "M221"]),
    ],
)
def test_g_counts_from_what_all_paths_lead_to(text: str, found: list[str]) -> None:
    assert codes(text, B) == found


def test_commands_that_do_not_concern_the_position_are_not_counted_as_followed() -> None:
    assert codes("L200\n" + "W1\n" * 30 + "E\nB64\nR\nG640")[-1:] == ["M221"]


def test_register_9_is_the_position_counter() -> None:
    assert codes("b640\nr\nh", B)[-1:] == ["M221"]
    assert "M221" not in codes("b640\nr\n:64\n>9\nh", B)


def test_h_leads_to_0_of_what_the_counter_shows() -> None:
    """The counter shows 2^24 - 64, and the way to 0 is as long: after it G begins one round of 24 bits lower."""
    found = check("=64\nb128\nr\nh\nr\ng64", B).diagnostics
    assert [(d.code, d.message, d.hint.partition(";")[0]) for d in found if d.hint is not None] == [
        ("M221", "at position -64 the counter shows 16 777 152", "the move would be -16 777 152"),
        ("M221", "at position -16 777 216 the counter shows 0", "the move would be 64"),
    ]


@pytest.mark.parametrize("function", ["t40\n?16\nc\nc1", "t46\n?16\nc\n+5", "t58\n?16\nc\n+9"])
def test_a_function_that_may_have_been_switched_off_is_not_judged(function: str) -> None:
    assert codes(function, B) == []
    assert codes(function.replace("?16\nc\n", ""), B) != []


def test_what_follows_a_lone_dot_is_looked_at() -> None:
    assert codes(".\nm2\nr", B) == ["M127", "M112"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (":5\n<3\nf", []),  # what a register holds is not known
        (":5\nf", ["M111"]),
        ("b64\nr\n\\\ng64", []),  # a reset zeroes the counter
        ("b64\nr\n=16000064\ng64", ["M110", "M221"]),  # what is refused does not
        ("p8000\nv8000\nr", ["M212"]),
        ("p8001\nv8000\nr", []),
        ("p7000\nv8000\nr", []),
        ("j1\n\\\n@1", ["M120", "M206"]),  # a reset forgets what comes later, too
    ],
)
def test_what_commands_leave_behind(text: str, found: list[str]) -> None:
    assert codes(text, B) == found


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("?10", "? 10 is out of range", "no line: the count in 10 is 0; "),
        ("?221", "? 221 is out of range", "221 is line 22; "),
        ("!203", "! 203 is out of range", "203 is lines 20 to 22; "),
    ],
)
def test_a_number_that_names_no_lines_is_explained(text: str, message: str, hint: str) -> None:
    first, *_ = check(text, B).diagnostics
    assert (first.code, first.message) == ("M110", message)
    assert first.hint is not None
    assert first.hint.startswith(hint)


def test_m_14_both_operand_functions() -> None:
    assert codes("T46\nT58\n+14", B) == ["M217"]


def test_m_17_jumps_to_labels_that_are_not_there() -> None:
    assert codes("J1") == ["M120"]
    assert codes("J1\n@1") == ["M121", "M206"]
    assert codes("[\nJ1\n@1\n]") == []
    assert codes("@1\nI1H1\nR\nJ1") == []
    assert codes("[\n@1\nR\n]\nJ1") == ["M223"]
    assert codes("@1\n\\\nJ1") == ["M206", "M120"]  # a reset forgets labels


def test_m_20_ends_without_a_beginning() -> None:
    assert codes("R\nE") == ["M124"]
    assert codes("R\n.") == ["M127"]
    assert codes("L2\n[\nR\nE\n]") == []  # a loop may span the bracket


def test_m_21_lines_of_the_driver_interface() -> None:
    assert codes("C8\nT10\n!102", A, "sd") == []
    assert codes("C8\nT10\n!102", A, "dual") == ["M113", "M113"]
    assert codes("C8\nT10\n!102", A, "two") == ["M113", "M113", "M113"]
    assert codes("O8\nZ9\n)10\n(11", A, "two") == ["M113", "M113", "M113", "M113"]
    assert codes("[\nI8H1\n?78\n@1\n]", A, "two") == ["M214", "M214"]
    assert codes("C7\nC18\nT50\nT80", A, "two") == []


# ---------------------------------------------------------------------- paths


def test_variable_jumps_go_where_the_variable_can_lead() -> None:
    text = "[\n?12\n+1\nJ\n@1\nR\n@2\nR\n@3\nR\n@4\nR\n{}]"
    assert codes(text.format("")) == []
    assert codes(text.format("@5\nR\n")) == ["M206"]
    assert codes(text.format("").replace("@4\n", "")) == ["M201"]
    assert codes("[\n:9\nJ\n@1\n]") == ["M120", "M206"]


def test_an_unknown_variable_can_lead_to_every_label() -> None:
    assert codes("[\n<1\nJ\n@1\nR\n@2\nR\n]", B) == []


def test_a_subroutine_keeps_the_settings_of_each_call_apart() -> None:
    text = "[\nM64\n'1\nF1\nM1\n'1\nF64\nJ2\n@1\nW1\n.\n@2\n]"
    assert codes(text) == []
    assert codes(text.replace("F1\n", "F1\nM4\n").replace("F64", "F8")) == ["M111"]


def test_one_wrong_path_is_a_warning_and_all_wrong_paths_an_error() -> None:
    fork = "[\nI1H1\nM{}\n@1\nF1\n]"
    assert codes("M64\n" + fork.format(32)) == ["M201"]
    assert codes("M4\n" + fork.format(32)) == ["M111"]


def test_a_loop_that_counts_is_followed_to_an_end() -> None:
    assert codes("[\n:0\n@1\n+1\nI1H2\nJ1\n@2\nF\n]") == []  # too many values to tell
    assert codes("[\n:0\n@1\n+64\nI1H2\nJ1\n@2\nF\nR\n]") == []


def test_dividends_above_65000() -> None:
    assert codes(":65000\n/3") == codes(":65001\n/4") == []
    assert codes(":65001\n/3") == ["M114"]


def test_dead_code_is_one_finding_per_section() -> None:
    text = "[\n@1\nR\nJ1\nW1\nW2\n@2\nW3\n]"
    found = check(text, A).diagnostics
    assert [(d.code, text[d.span.start : d.span.end]) for d in found] == [("M207", "W1\nW2\n@2\nW3"), ("M206", "@2")]


def test_kill_and_reset_are_reached_whatever_runs() -> None:
    assert codes("[\n@1\nR\nJ1\n]\nK\n\\\nR") == []


def test_default_variant_and_interface() -> None:
    assert codes("@15\nC17\nJ15") == [d.code for d in check("@15\nC17\nJ15").diagnostics] == []
    assert not check("@16\nJ16").is_sound
    assert check("U7").is_sound  # a warning


# ---------------------------------------------------------------------- any program


@pytest.mark.parametrize("v", [variant("A"), variant("E2")], ids=lambda v: v.name)
@given(data=st.data())
def test_commands_that_the_variant_takes_are_never_out_of_range(
    v: Variant, permitted_programs: Programs, data: st.DataObject
) -> None:
    program = data.draw(permitted_programs(v, numbered=True))
    operands_from_elsewhere = any(c.key == "T" and c.number in (46, 58) for c in program.commands)
    found = check(format_program(program), v, data.draw(st.sampled_from([STEP_DIRECTION, DUAL_DAC, TWO_DACS])))
    assert operands_from_elsewhere or "M110" not in {d.code for d in found.diagnostics}
    assert found.program == program


@given(st.text("@CEFIJKLMQRTX?+.'[]\\0123459H\n", max_size=120), st.sampled_from(VARIANTS))
def test_any_text_can_be_checked(text: str, v: Variant) -> None:
    checked = check(text, v)
    assert all(0 <= d.span.start <= d.span.end <= len(text) for d in checked.diagnostics)
    assert all(sum(c.bits for c in chip.commands) == chip.total for chip in checked.memory)


if __name__ == "__main__":
    for golden in sorted(GOLDEN.glob("*.golden")):
        chosen, source, _ = read(golden)
        golden.write_text(f"{HEADER}\n{chosen}\n{PROGRAM}{source}{FINDINGS}{findings_of(chosen, source)}")


moves = st.one_of(
    st.tuples(st.sampled_from(["F", "B", "G", "="]), st.integers(1, 5).map(lambda n: 640 * n)),
    st.tuples(st.sampled_from(["D", "R", "R", "H", "C100", "G+", "T3"]), st.none()),
)
bodies = st.recursive(
    st.lists(moves, max_size=5),
    lambda body: st.lists(st.one_of(moves, st.tuples(st.integers(1, 3), body)), max_size=5),
    max_leaves=12,
)


class Walk:
    """Loops unrolled, by recursion: where the counter is, and where G and H find it below 0."""

    def __init__(self, body: list[Any]) -> None:
        self.lines: list[str] = []
        self.position: int | None = 0
        self.distance: int | None = 64_000
        self.passed: set[int] = set()
        self.write(body)
        self.do(body, 1)

    def write(self, body: list[Any]) -> None:
        for what, argument in body:
            if isinstance(what, int):
                self.lines.append(f"L{what}")
                self.write(argument)
                self.lines.append("E")
            else:
                self.lines.append(f"{what}{'' if argument is None else argument}")

    def do(self, body: list[Any], line: int) -> int:
        """From this line on; returns the line behind."""
        for what, argument in body:
            begin, line = line, line + 1
            if isinstance(what, int):
                for _ in range(what):
                    line = self.do(argument, begin + 1)
                line += 1
                continue
            if what in ("G", "H"):
                if self.position is not None and self.position < 0:
                    self.passed.add(begin)
                self.distance = None if self.position is None else (argument or 0) - self.position % 2**24
            elif what in ("F", "B"):
                self.distance = argument if what == "F" else -argument
            elif what == "D":
                self.distance = None if self.distance is None else -self.distance
            elif what == "G+":
                self.distance = None
            elif what == "R":
                self.position = None if None in (self.position, self.distance) else self.position + self.distance  # type: ignore[operator]
            elif what in ("=", "C100"):
                self.position = argument or 0
        return line


@given(bodies)
def test_where_the_counter_passes_0_is_found_through_all_loops(body: list[Any]) -> None:
    """Loops stand inside one another up to four levels (M-5); the walk knows no levels."""
    walk = Walk(body)
    depth = most = 0
    for line in walk.lines:
        depth += line.startswith("L") - (line == "E")
        most = max(most, depth)
    assume(most <= 4)
    text = "".join(f"{line}\n" for line in walk.lines)
    source = SourceText("", text)
    passed = {source.position(one.span.start)[0] for one in check(text, B, DUAL_DAC).diagnostics if one.code == "M221"}
    assert passed == walk.passed


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[\nw1\nj6\n@5\nf6400\nr\nw100\n@6\n]\nj5", ["M223"]),
        ("[\nw1\nj6\n@5\nf6400\nr\nj5\n@6\n]\nj5", []),
        ("[\nj6\n@5\nf6400\nr\ni1l6\nj5\n@6\n]\nj5", ["M223"]),
        ("@5\nf6400\nr\nj5", []),
    ],
)
def test_a_j_behind_a_file_that_comes_to_its_end_starts_it_again_and_again(text: str, expected: list[str]) -> None:
    assert codes(text) == expected


@pytest.mark.parametrize(
    ("line", "fixed"),
    [("F\xa0640", "F 640"), ("F640\xa0", "F640 "), ("\u202fF\xa06\u202f400", " F 6 400"), ("R\xa0 ; x", "R  ; x")],
)
def test_blanks_of_a_text_system_are_named_and_replaced(line: str, fixed: str) -> None:
    """As copies of the manual's own text have them."""
    (found,) = check(line).diagnostics
    assert found.code == "M101"
    assert found.fix is not None
    assert ("no-break space (U+" in found.message, "which is not a blank to the chip" in found.message) == (True, True)
    start, end = found.fix.span.start, found.fix.span.end
    assert line[:start] + found.fix.text + line[end:] == fixed
    assert "M101" not in codes(fixed)
