"""Faults as values: the table, what is read from files and lines, and what is refused."""

from __future__ import annotations

import pickle
import tomllib
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.simulation.faults import KINDS, ActiveFault, Fault, FaultKind, Layer, Occasion, Parameter, parse, read, schema
from steptwin.simulation.faults.active import FaultReporter, addresses
from steptwin.simulation.faults.effects import ByteEffect, Run, checked
from steptwin.simulation.faults.stream import spoil
from steptwin.simulation.faults.table import LARGEST_WHOLE, ParameterForm, check
from steptwin.tables import IncompleteTable


@pytest.mark.parametrize(
    ("pdu", "touched"),
    [
        ("01 00 64 00 03", range(100, 103)),  # Modbus Application Protocol 6.1 to 6.4: first address and quantity
        ("04 00 64 00 01", range(100, 101)),
        ("05 00 64 FF 00", range(100, 101)),  # 6.5, 6.6: address and value
        ("06 00 64 00 09", range(100, 101)),
        ("10 00 64 00 02 04 00 00 00 00", range(100, 102)),  # 6.12
        ("07", None),
        ("08 00 00 00 00", None),
        ("00 00 64 00 01", None),
        ("03 00 64 00", None),
        ("", None),
    ],
)
def test_the_addresses_that_a_request_touches(pdu: str, touched: range | None) -> None:
    assert addresses(bytes.fromhex(pdu)) == touched


def values(parameter: Parameter) -> st.SearchStrategy[object]:
    least, most = parameter.least, parameter.most
    match parameter.form:
        case ParameterForm.WHOLE:
            return st.integers(
                1 - LARGEST_WHOLE if least is None else int(least), LARGEST_WHOLE - 1 if most is None else int(most)
            )
        case ParameterForm.NUMBER:
            return st.floats(least, most, allow_nan=False, allow_infinity=False)
        case ParameterForm.SPAN:
            return st.tuples(st.integers(0, 65535), st.integers(0, 65535)).map(lambda pair: (min(pair), max(pair)))
        case ParameterForm.WORD:
            return st.sampled_from(parameter.words)
        case ParameterForm.TEXT:
            return st.text("abcXYZ019-_.", min_size=1)


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    kind = draw(st.sampled_from(list(KINDS.values())))
    given_ = {p.name: draw(values(p)) for p in kind.parameters if p.is_required or draw(st.booleans())}
    if "nth" in given_:
        given_.pop("every", None)
    for begin in ("from_s", "at_s"):
        if begin in given_ and "until_s" in given_:
            given_[begin], given_["until_s"] = sorted((given_[begin], given_["until_s"]))  # type: ignore[type-var]
    return parse({"kind": kind.name, "name": draw(st.text("abc1-", max_size=5)), **given_})


@given(faults())
def test_a_fault_written_as_a_line_reads_as_the_same_fault(fault: Fault) -> None:
    assert read(str(fault)) == fault


def test_the_same_fault_from_a_file_and_from_a_line() -> None:
    text = '[[fault]]\nkind = "exception"\ncode = 6\nunit = 1\naddress = "10020-10035"\nfrom_s = 2\nprobability = 0.25\n'
    (table,) = tomllib.loads(text)["fault"]
    fault = parse(table)
    assert fault == read("exception code=6 unit=1 address=10020-10035 from_s=2 probability=0.25")
    assert str(fault) == "exception code=6 unit=1 address=10020-10035 from_s=2 probability=0.25"
    assert (fault.get("address"), fault.get("from_s"), fault.get("nth"), fault.get("every")) == ((10020, 10035), 2.0, None, 1)


def test_numbers_of_a_line_may_be_hexadecimal_where_they_are_whole() -> None:
    assert read("insert value=0xF8") == read("insert value=248")
    assert parse({"kind": "crc", "address": 5}) == read("crc address=5")


REFUSED = {
    "": "a fault is KIND [NAME=VALUE ...], such as 'crc unit=1 nth=3'; kinds are flip, ",
    "crcc": "fault: kind = 'crcc' (did you mean 'crc'?): permitted are flip, ",
    "crc nth": "fault 'crc nth': 'nth' is not NAME=VALUE",
    "crc nth=1 nth=2": "fault 'crc nth=1 nth=2': nth is given twice",
    "crc units=1": "fault (crc): there is no 'units': parameters are unit, function, address, link, line, nth,",
    "crc nth=0": "fault (crc): nth = 0: permitted are whole numbers 1 and more",
    "crc nth=x": "fault (crc): nth = 'x': permitted are whole numbers 1 and more",
    "crc nth=1.5": "fault (crc): nth = '1.5': permitted are whole numbers 1 and more",
    "crc probability=1.5": "fault (crc): probability = 1.5: permitted are numbers 0 to 1",
    "crc probability=nan": "fault (crc): probability = 'nan': permitted are numbers 0 to 1",
    "crc nth=1 every=2": "fault (crc): nth and every exclude each other",
    "crc address=9-4": "fault (crc): address = '9-4': permitted are numbers or spans N-M 0 to 65535",
    "crc address=1-2-3": "fault (crc): address = '1-2-3': permitted are numbers or spans N-M 0 to 65535",
    "crc address=70000": "fault (crc): address = '70000': permitted are",
    "crc from_s=3 until_s=2": "fault (crc): until_s = 2 is before the fault begins at 3 s",
    "flip direction=up": "fault (flip): direction = 'up': permitted are in, out",
    "stuck value=1": "fault (stuck): pin is missing: which input or output.",
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_no_fault_is_refused_with_what_is_permitted(line: str) -> None:
    with pytest.raises(Misuse) as refused:
        read(line)
    assert str(refused.value).startswith(REFUSED[line])


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({}, "[[fault]] 2: kind = None: permitted are"),
        ({"kind": 3}, "[[fault]] 2: kind = 3: permitted are"),
        ({"kind": "crc", "nth": True}, "[[fault]] 2 (crc): nth = True: permitted are whole numbers 1 and more"),
        ({"kind": "crc", "nth": "3"}, "[[fault]] 2 (crc): nth = '3': permitted are whole numbers 1 and more"),
        ({"kind": "crc", "name": "a b"}, "[[fault]] 2: name = 'a b': permitted is text that can be printed, without blanks"),
        ({"kind": "crc", "link": ""}, "[[fault]] 2 (crc): link = '': permitted are text"),
    ],
)
def test_what_a_file_says_wrongly_is_refused_with_its_place(table: dict[str, object], text: str) -> None:
    with pytest.raises(Misuse) as refused:
        parse(table, "[[fault]] 2")
    assert str(refused.value).startswith(text)


def test_the_table_checks_itself() -> None:
    crc = KINDS["crc"]
    with pytest.raises(Misuse, match="two kinds of fault are named 'crc'"):
        checked((crc, crc))
    with pytest.raises(Misuse, match="fault crc: a parameter is given twice"):
        checked((replace(crc, own=(Parameter("nth", ParameterForm.WHOLE, "", default=1),)),))
    with pytest.raises(Misuse, match="fault crc, parameter x = 9: permitted are whole numbers 0 to 5"):
        checked((replace(crc, own=(Parameter("x", ParameterForm.WHOLE, "", 0, 5, default=9),)),))
    with pytest.raises(Misuse, match="parameter x: a default, what holds otherwise, or required"):
        checked((replace(crc, own=(Parameter("x", ParameterForm.WHOLE, ""),)),))
    with pytest.raises(Misuse, match="lines belong to all faults but those of physics"):
        checked((FaultKind("x", Layer.PHYSICS, Occasion.MOMENT, "", (), crc.lines),))


_CRC, _STALL = KINDS["crc"], KINDS["stall"]


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        *(
            (replace(kind, effect=None), f"fault {kind.name} lacks its effect: {effect}")
            for kind, effect in (
                (KINDS["flip"], "ByteEffect"),
                (KINDS["split"], "InsertEffect or SplitEffect"),
                (_CRC, "AnswerEffect"),
                (KINDS["busy"], "RequestEffect"),
                (_STALL, "MomentEffect"),
                (KINDS["stuck"], "WindowEffect"),
                (KINDS["bounce"], "ChangeEffect"),
                (KINDS["wear"], "SaveEffect"),
            )
        ),
        (replace(_CRC, effect=_STALL.effect), "fault crc needs the effect AnswerEffect, not MomentEffect"),
        (replace(_CRC, occasion=Occasion.BYTE), "fault crc: nothing of layer frames waits for the occasion byte"),
        (replace(KINDS["no-answer"], effect=KINDS["busy"].effect), "fault no-answer lacks what it does to answers"),
    ],
)
def test_a_kind_without_the_effect_of_its_occasion_is_refused(kind: FaultKind, message: str) -> None:
    with pytest.raises(IncompleteTable) as caught:
        checked((kind,))
    assert str(caught.value) == message


def test_a_new_kind_is_one_row() -> None:
    def invert(active: ActiveFault, byte: int, run: Run, report: FaultReporter) -> int:
        report(active, "inverted")
        return byte ^ 0xFF

    kind = replace(KINDS["flip"], name="invert", own=(), effect=ByteEffect(invert))
    active = ActiveFault(Fault(checked((kind,))["invert"], {"nth": 2}), "", 0, 0)
    said: list[str] = []
    assert spoil(b"\x01\x02\x03", [active], 0, lambda _, text: said.append(text)) == [(0, b"\x01\xfd\x03")]
    assert said == ["byte 2 of 3: inverted"]


@pytest.mark.parametrize("kind", KINDS.values(), ids=list(KINDS))
def test_faults_can_be_pickled_with_their_kind(kind: FaultKind) -> None:
    fault = Fault(kind, {}, "it")
    assert pickle.loads(pickle.dumps(fault)) == fault


def test_the_schema_has_a_table_for_each_kind_with_all_it_takes() -> None:
    objects = {table["properties"]["kind"]["const"]: table for table in schema()["oneOf"]}  # type: ignore[index, attr-defined]
    assert set(objects) == set(KINDS)
    for name, table in objects.items():
        assert set(table["properties"]) == {"kind", "name", *(p.name for p in KINDS[name].parameters)}
        assert table["additionalProperties"] is False
        assert all("type" in one or "const" in one for one in table["properties"].values())
    assert objects["stuck"]["properties"]["pin"]["type"] == "string"
    assert objects["stuck"]["required"] == ["kind", "pin"]
    assert objects["flip"]["properties"]["direction"]["enum"] == ["in", "out"]
    words = [(name, p) for name in objects for p in KINDS[name].parameters]
    assert all(objects[name]["properties"][p.name].get("enum", []) == list(p.words) for name, p in words)
    assert objects["crc"]["properties"]["probability"] == {
        "description": "How probable it is each time.", "type": "number", "minimum": 0, "maximum": 1, "default": 1.0
    }  # fmt: skip


@given(st.sampled_from([p for kind in KINDS.values() for p in kind.parameters if p.default is not None]))
def test_every_default_is_permitted(parameter: Parameter) -> None:
    assert check(parameter, parameter.default, parameter.name) == parameter.default


def test_a_parameter_without_a_number_is_misuse_where_one_is_needed() -> None:
    fault = read("crc unit=1 from_s=2.5")
    assert (fault.number("unit"), fault.number("from_s")) == (1, 2.5)
    with pytest.raises(Misuse, match="fault crc: until_s = None is not a number"):
        fault.number("until_s")
