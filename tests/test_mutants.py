"""Mutations of source text: where they are, and that nothing else changes."""

from __future__ import annotations

import subprocess
import textwrap
from pathlib import Path

import pytest
from mutants.__main__ import sources
from mutants.faults import Fault, Lost, find_test
from mutants.mutations import compiles, mutations
from mutants.reach import CORE, FOLDERS, Reach, digest, folders, imported_files
from mutants.trial import Tree

ROOT = Path(__file__).parent.parent


def changed(source: str, kind: str) -> list[str]:
    return [mutation.apply(source) for mutation in mutations(source) if mutation.kind == kind]


@pytest.mark.parametrize(
    ("source", "kind", "expected"),
    [
        ("a < b", "comparison", ["a <= b", "a >= b"]),
        ("(a) is not None", "comparison", ["(a) is None"]),
        ("a in b in c", "comparison", ["a not in b in c", "a in b not in c"]),
        ("x = a and (b) and c", "operator", ["x = a or (b) and c", "x = a and (b) or c"]),
        ("x = -a * b", "operator", ["x = -a + b", "x = a * b"]),
        ("x = a // b", "operator", ["x = a * b"]),
        ("é = 'é' + b", "operator", ["é = 'é' - b"]),
        ("x += y", "operator", ["x -= y"]),
        ("x += y", "statement", ["pass"]),
        ("self.x = y", "statement", ["pass"]),
        ("x = y", "statement", []),
        ("f()\nx()", "statement", ["pass\nx()", "f()\npass"]),
        ("def f(): return 1", "statement", ["def f(): pass"]),
        ("f(a, b)", "argument", ["f(b, a)"]),
        ("f(a, b=b, c=c)", "argument", ["f(a,  c=c)", "f(a, b=b, )"]),
        ("f(a, a)", "argument", []),
        ("max(a, b)", "argument", []),
        ("zip(a, a, strict=True)", "argument", []),
        ("zip(a, a, strict=True)", "truth value", []),
        ("def f():\n  return None", "statement", []),
        (
            "def f():\n  if a: return None\n  return 1",
            "statement",
            ["def f():\n  if a: pass\n  return 1", "def f():\n  if a: return None\n  pass"],
        ),
        ("x = True", "truth value", ["x = False"]),
        ("x = 0x10", "number", ["x = (0x10 + 1)"]),
        ("T = TypeVar('T', covariant=True)", "truth value", []),
        ("x: Literal[1] = y", "number", []),
        ("@cache(1)\nclass A: pass", "number", []),
        ("x = f'{a:3}'", "number", []),
    ],
)
def test_each_mutation_changes_one_thing(source: str, kind: str, expected: list[str]) -> None:
    assert sorted(changed(source, kind)) == sorted(expected)


def test_a_mutation_tells_its_line_before_and_after() -> None:
    source = "x = 1\nif a:\n    b(c <\n      d)\n"
    (first, *_) = (mutation for mutation in mutations(source) if mutation.kind == "comparison")
    assert first.line(source) == 3
    assert first.lines(source) == ("b(c <", "b(c <=")


def test_nearly_all_mutations_of_a_module_compile() -> None:
    source = (ROOT / "src/steptwin/wire/rtu.py").read_text()
    found = [compiles(mutation.apply(source)) for mutation in mutations(source)]
    assert len(found) > 10
    assert found.count(False) < len(found) / 20


def test_all_packages_of_the_core_and_all_folders_of_tests_are_there() -> None:
    assert [name for name in CORE if not (ROOT / "src/steptwin" / name).is_dir()] == []
    assert [folder for folder in FOLDERS if not (ROOT / folder).exists()] == []


def test_what_is_mutated_is_a_package_a_folder_of_one_or_a_module() -> None:
    assert sources(ROOT, ["wire/rtu.py", "wire/rtu.py"]) == [ROOT / "src/steptwin/wire/rtu.py"]
    assert ROOT / "src/steptwin/wire/rtu.py" in sources(ROOT, ["wire"])
    inside = sources(ROOT, ["drivers/m1486"])
    assert inside
    assert {path.parent for path in inside} == {ROOT / "src/steptwin/drivers/m1486"}
    assert sources(ROOT, ["wire/nothing.py"]) == []


FILES = {
    "pyproject.toml": "",
    "src/steptwin/__init__.py": "",
    "src/steptwin/pytest_plugin.py": "",
    "src/steptwin/wire/__init__.py": "",
    "src/steptwin/wire/sums.py": """
        LIMIT = 3
        def total(a, b):
            if a > LIMIT:
                return never(
                    a
                )
            return (
                a + b
            )
    """,
    "src/steptwin/simulation/use.py": "def use():\n    from steptwin.wire.sums import total\n    return total(1, 2)\n",
    "tests/conftest.py": "",
    "tests/wire/test_sums.py": """
        from steptwin.wire.sums import total
        def test_nothing(): pass
        def test_total(): assert total(1, 2) == 3
    """,
    "tests/test_state.py": "from steptwin.wire.sums import total\ndef test_state(): assert total(2, 2) == 4\n",
    "tests/simulation/test_use.py": "from steptwin.simulation.use import use\ndef test_use(): assert use() == 3\n",
}
SUMS = Path("src/steptwin/wire/sums.py")
IN_WIRE, IN_WORLD = "tests/wire/test_sums.py::test_total", "tests/simulation/test_use.py::test_use"
IN_STATE = "tests/test_state.py::test_state"


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    project = tmp_path / "project"
    for name, text in FILES.items():
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text(textwrap.dedent(text).lstrip())
    for name in ("__init__", "trial", "record", "choice", "forks"):
        (project / "mutants").mkdir(exist_ok=True)
        (project / f"mutants/{name}.py").write_text((ROOT / f"mutants/{name}.py").read_text())
    subprocess.run(["git", "init", "-q"], cwd=project, check=True)
    return Tree(project, tmp_path / "copy")


def test_tests_that_execute_a_line_are_run_for_it(tree: Tree, tmp_path: Path) -> None:
    records = {folder: tmp_path / f"{Path(folder).name}.json" for folder in folders(tree.path, ["wire"])}
    assert list(records) == ["tests/wire", "tests/simulation", "tests/test_state.py"]
    assert [tree.record(folder, file) for folder, file in records.items()] == [True, True, True]
    reach = Reach(tree.path, records)

    def stages(line: int) -> list[tuple[str, list[str]]]:
        return [(name, sorted(seconds)) for name, seconds in reach.stages(SUMS, line, line)]

    everything = [("folder", ["tests/wire/test_sums.py::test_nothing", IN_WIRE]), ("others", [IN_WORLD, IN_STATE])]
    assert stages(1) == everything, "executed on import"
    assert stages(2) == everything, "executed on import"
    assert stages(4) == stages(5) == stages(6) == [], "executed by no test"
    assert stages(3) == everything, "by few tests"
    assert stages(9) == everything, "a bracket is executed with its statement"

    with tree.changed(SUMS, (tree.path / SUMS).read_text().replace("a + b", "a - b")):
        assert not tree.passes({IN_WIRE: 0.1})
        assert not tree.passes({IN_WORLD: 0.1})
    assert tree.passes({IN_WIRE: 0.1, IN_WORLD: 0.1})


def test_functions_are_mutated_in_a_process_that_has_collected_the_tests(tree: Tree) -> None:
    source = (tree.path / SUMS).read_text()
    both = {IN_WIRE: 0.1, IN_WORLD: 0.1}

    def passes(before: str, after: str, tests: dict[str, float]) -> bool | None:
        return tree.passes_forked(SUMS, source, source.replace(before, after), tests)

    tree.fork(["tests/wire", "tests/simulation"])
    try:
        for _ in range(2):
            assert passes("a + b", "a - b", {IN_WIRE: 0.1}) is False
            assert passes("a + b", "a - b", {IN_WORLD: 0.1}) is False
            assert passes("a > LIMIT", "a >= LIMIT", both) is True
        assert passes("LIMIT = 3", "LIMIT = 4", both) is None, "nothing in a function"
        (tree.path / SUMS).write_text("")
        assert passes("return (", "while 1: (", {IN_WIRE: -3.9}) is False, "it never ends"
    finally:
        tree.end()


def test_a_record_is_valid_until_something_changes_that_its_tests_import(tree: Tree) -> None:
    before = [digest(tree.path, folder) for folder in ("tests/wire", "tests/simulation")]
    (tree.path / "src/steptwin/simulation/use.py").write_text("def use():\n    return 3\n")
    imported_files.cache_clear()
    after = [digest(tree.path, folder) for folder in ("tests/wire", "tests/simulation")]
    assert [before[0] == after[0], before[1] == after[1]] == [True, False]


def fault(function: str, old: str, new: str) -> Fault:
    return Fault(1, "it adds wrongly", "wire/sums.py", function, old, new, {"plain": [IN_WIRE]})


def test_a_recorded_fault_is_found_where_its_function_is_now(tree: Tree) -> None:
    one = fault("total", "( a + b )", "(a - b)")
    assert one.put_into(tree.path)[0] == SUMS
    assert "return (a - b)" in one.put_into(tree.path)[1]
    (tree.path / "src/steptwin/simulation/sums.py").write_text((tree.path / SUMS).read_text())
    assert one.put_into(tree.path)[0] == SUMS, "where it was first"
    (tree.path / SUMS).write_text("")
    assert one.put_into(tree.path)[0] == Path("src/steptwin/simulation/sums.py")
    (tree.path / "src/steptwin/simulation/other.py").write_text((tree.path / "src/steptwin/simulation/sums.py").read_text())
    for lost in (one, fault("total", "a", "b"), fault("sum", "a + b", "a - b"), fault("use", "3", "(")):
        with pytest.raises(Lost):
            lost.put_into(tree.path)


def test_a_test_is_found_where_it_is_now(tree: Tree) -> None:
    assert find_test(tree.path, IN_WIRE) == IN_WIRE
    (tree.path / "tests/wire/test_sums.py").rename(tree.path / "tests/simulation/test_sums.py")
    assert find_test(tree.path, IN_WIRE) == "tests/simulation/test_sums.py::test_total"
    (tree.path / "tests/simulation/test_sums.py").rename(tree.path / "tests/simulation/test_added.py")
    assert find_test(tree.path, IN_WIRE) == "tests/simulation/test_added.py::test_total"
    (tree.path / "tests/simulation/test_added.py").unlink()
    with pytest.raises(Lost):
        find_test(tree.path, IN_WIRE)
