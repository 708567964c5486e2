"""Size of the house: code, tests, golden files, circles of modules, calls of a "Move" of the page.

Code lines are those of ``src`` without blanks, comments and docstrings. Circles are counted with imports for types. A call is one
of a function of steptwin between the text of a request and its answer, without sockets, of the second of two requests.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from pathlib import Path
from types import FrameType

import grimp

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "steptwin"
HEADLESS = re.compile(r"(Of|What) ")


def code_lines(text: str) -> int:
    """Lines with a token that is neither a comment nor part of a docstring."""
    docstrings: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        for part in _body(node):
            if isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str):
                docstrings.update(range(part.lineno, (part.end_lineno or part.lineno) + 1))
    empty = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in empty:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - docstrings)


def _body(node: ast.AST) -> list[ast.stmt]:
    found = getattr(node, "body", None)
    return found if isinstance(found, list) else []


def headless(text: str) -> int:
    """Number of docstrings that begin with a genitive or a relative clause instead of a noun or an imperative."""
    found = 0
    for node in ast.walk(ast.parse(text)):
        for part in _body(node):
            if isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str):
                found += HEADLESS.match(part.value.value.strip()) is not None
    return found


def circles() -> list[int]:
    """Sizes of the circles of modules, imports for types included, the largest first."""
    graph = grimp.build_graph("steptwin", cache_dir=None)
    imports = {module: sorted(graph.find_modules_directly_imported_by(module)) for module in sorted(graph.modules)}
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[int] = []

    def visit(module: str) -> None:  # Tarjan's strongly connected components
        number[module] = low[module] = len(number)
        stack.append(module)
        for other in imports[module]:
            if other not in number:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], number[other])
        if low[module] == number[module]:
            at = stack.index(module)
            if len(stack) - at > 1:
                found.append(len(stack) - at)
            del stack[at:]

    sys.setrecursionlimit(10_000)
    for module in imports:
        if module not in number:
            visit(module)
    return sorted(found, reverse=True)


def calls_of_a_move() -> tuple[int, int]:
    """Calls of functions of steptwin, and files that they are in, for a Move of the page."""
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    from studio_rig import Studio

    studio = Studio()
    tab = studio.open()
    tab.ok("enable", controller="table", axis=1)
    tab.ok("move", controller="table", axis=1, to=5.0)
    files: Counter[str] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(str(SOURCE)):
            files[frame.f_code.co_filename] += 1

    sys.setprofile(count)
    try:
        tab.ok("move", controller="table", axis=1, to=6.0)
    finally:
        sys.setprofile(None)
    return files.total(), len(files)


def main() -> None:
    texts = {path: path.read_text("utf-8") for path in sorted(SOURCE.rglob("*.py"))}
    rooms: Counter[str] = Counter()
    for path, text in texts.items():
        rooms[path.relative_to(SOURCE).parts[0]] += code_lines(text)
    print(f"code lines in src: {rooms.total()}")
    for room, lines in rooms.most_common(14):
        print(f"  {room:<12} {lines:>6}")
    tests = sum(path.read_text("utf-8").count("\n") for path in (ROOT / "tests").rglob("*.py"))
    golden = sum(path.read_text("utf-8").count("\n") for path in (ROOT / "tests").rglob("golden/*") if path.is_file())
    print(f"lines of tests: {tests}, of golden files: {golden}")
    print(f"docstrings without a subject: {sum(map(headless, texts.values()))}")
    sizes = circles()
    print(f"circles of modules, imports for types included: {len(sizes)}{f', the largest of {sizes[0]}' if sizes else ''}")
    calls, files = calls_of_a_move()
    print(f"calls of a Move of the page: {calls}, in {files} files")


if __name__ == "__main__":
    main()
