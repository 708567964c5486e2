"""Places agree with what `tomllib` reads: every key, table and item has one, and nothing else has."""

from __future__ import annotations

import tomllib
from pathlib import Path as FilePath
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.simulation.toml.keypaths import LONGEST_SCALAR, MOST_NESTED, Path, UnsupportedToml, find_spans

EXAMPLES = FilePath(__file__).parents[3] / "examples" / "worlds"
SINGLE, MULTI = "'''", '"""'

TEXT = f"""
# [[button]] in a comment
name = "a # no comment" # [[button]]
long = {MULTI}
[[button]]
name = "in a string" \\"{MULTI} # \\" is escaped
raw = {SINGLE}
[[button]]
\\{SINGLE}'
empty = ""
[[button]]
name = 'b'
to = "x.IN1"
  [button.inner] # comment
  when = 1979-05-27 07:32:00
  "quoted.key" . 'other key' = [1, [2, 3], {{ x = 1, y.z = "}}" }}, # comment ]
    "]", ]
[[button]]
steps = [ {{ set = {{ "a.IN1" = 1 }} }}, {{ wait = "1 s" }},
]
[[button.part]]
n = 1
[[button.part]]
n = +1.5e3
[table.'a.b'."c\\u0041"]
x = {{}}
[table.other]
"""


def paths(value: object, path: Path = ()) -> set[Path]:
    """All places in what `tomllib` gives."""
    found = {path} if path else set()
    if isinstance(value, dict):
        for name, item in value.items():
            found |= paths(item, (*path, name))
    elif isinstance(value, list):
        for number, item in enumerate(value):
            found |= paths(item, (*path, number))
    return found


def implied(data: object, spans: dict[Path, Any]) -> set[Path]:
    """Tables that a header only implies, and arrays of tables as a whole, have no place of their own."""
    return {path for path in paths(data) - set(spans) if any(other[: len(path)] == path for other in spans)}


def check(text: str) -> None:
    data, spans = tomllib.loads(text), find_spans(text)
    assert set(spans) | implied(data, spans) == paths(data)
    for path, span in spans.items():
        value: Any = data
        for part in path:
            value = value[part]
        if not isinstance(value, dict | list):
            shown = text[span.start : span.end]
            alone = tomllib.loads(shown if isinstance(path[-1], str) else f"x = {shown}")
            while isinstance(alone, dict):
                (alone,) = alone.values()
            assert alone == value, (path, shown)


def test_every_place_of_a_text_with_everything_in_it() -> None:
    check(TEXT)


@pytest.mark.parametrize("text", ["a = [1,22,'x',[3,4],{b=5,c=[6]}]", "a = {b=1,c=2}", "a = [[1],[2,]]", "a = [1 , 2]"])
def test_places_without_blanks(text: str) -> None:
    check(text)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.name)
def test_every_place_of_the_examples(path: FilePath) -> None:
    check(path.read_text())


KEYS = st.sampled_from(["a", "b", "c-1", '"a.b"', "'c d'", "a.b", "b . c"])
SCALARS = st.sampled_from(["1", "-1.5e3", "true", '"x"', "'#'", '"]"', "1979-05-27", '"""\n[[a]]\n"""', "'''a'''", '""', "inf"])
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]")
        | st.lists(inner, max_size=3).map(lambda items: "[ # c\n" + "".join(f"{item},\n" for item in items) + "]")
        | st.lists(inner, max_size=2).map(lambda items: "{ " + ", ".join(f"k{n} = {item}" for n, item in enumerate(items)) + " }")
    ),
    max_leaves=8,
)
LINES = st.one_of(
    st.tuples(KEYS, VALUES).map(lambda pair: f"{pair[0]} = {pair[1]} # comment"),
    KEYS.map(lambda key: f"[{key}]"),
    KEYS.map(lambda key: f"[[ {key} ]]"),
    st.just("# [[a]]"),
    st.just(""),
)


@given(lines=st.lists(LINES, max_size=10), end=st.sampled_from(["\n", "\r\n"]))
@example(lines=['a = "'], end="\n")
def test_every_place_of_any_text(lines: list[str], end: str) -> None:
    text = end.join(lines)
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        find_spans(text)  # it ends
        return
    check(text)


def test_what_is_before_a_key_that_cannot_be_read_has_its_places() -> None:
    assert set(find_spans('a = 1\n"\\q" = 2\nb = 3\n')) == {("a",)}
    assert set(find_spans("a = 1\nb 2\nc = 3\n")) == {("a",)}
    assert set(find_spans("a = 1\n[b\nc = 3\n")) == {("a",)}


@given(text=st.text(alphabet="a=[]{}\"'#\n.,1 \\", max_size=40))
def test_any_characters_are_gone_over_to_an_end(text: str) -> None:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        find_spans(text)
        return
    check(text)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * (MOST_NESTED + 2),
        "a = " + "{ a = " * (MOST_NESTED + 2),
        ".".join("a" * 20_000) + " = 1",
        "[" + ".".join("a" * 20_000) + "]",
        "a = " + "9" * (LONGEST_SCALAR + 1),
        "a = 0x" + "f" * 5000,
    ],
    ids=lambda text: text[:8],
)
def test_what_nobody_writes_is_refused_at_once(text: str) -> None:
    with pytest.raises(UnsupportedToml):
        find_spans(text)


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ("{a=", "}"), ("[{a=", "}]")])
def test_values_may_be_nested_so_deeply_and_no_deeper(opening: str, closing: str) -> None:
    levels = MOST_NESTED // (len(closing))

    def nested(number: int) -> str:
        return f"a = {opening * number}1{closing * number}"

    assert ("a",) in find_spans(nested(levels))
    with pytest.raises(UnsupportedToml):
        find_spans(nested(levels + 1))
