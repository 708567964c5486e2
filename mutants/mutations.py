"""Small mistakes in Python source: each replaces one stretch of text, all else stays as it is.

Mutated are comparisons, arithmetic and logical operators, numbers, truth values, statements (left out) and arguments (left out or
swapped), in functions as well as in tables and defaults. Not mutated: texts, annotations, decorators, imports, and what changes
nothing: the order in max() and min(), the ``strict`` of zip(), the variance of a TypeVar, ``return None`` at the end of a
function. A product becomes a sum: a quotient by a sign would be the same.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS: dict[type[ast.cmpop], tuple[str, ...]] = {
    ast.Lt: ("<=", ">="),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<="),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
ARITHMETIC: dict[type[ast.operator], str] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "+",
    ast.Div: "*",
    ast.FloorDiv: "*",
    ast.Mod: "*",
    ast.LShift: ">>",
    ast.RShift: "<<",
    ast.BitAnd: "|",
    ast.BitOr: "&",
    ast.BitXor: "&",
}


@dataclass(frozen=True, order=True)
class Mutation:
    """Replace ``source[start:end]`` (characters) by ``text``."""

    start: int
    end: int
    text: str
    kind: str
    """comparison, operator, number, truth value, statement or argument."""

    def apply(self, source: str) -> str:
        return source[: self.start] + self.text + source[self.end :]

    def line(self, source: str) -> int:
        """The number of the first changed line, from 1."""
        return source.count("\n", 0, self.start) + 1

    def lines(self, source: str) -> tuple[str, str]:
        """The changed lines before and after, without surrounding white space."""
        begin = source.rfind("\n", 0, self.start) + 1
        end = source.find("\n", self.end)
        end = len(source) if end < 0 else end
        return source[begin:end].strip(), (source[begin : self.start] + self.text + source[self.end : end]).strip()


def mutations(source: str) -> list[Mutation]:
    """All mutations of a module, in the order of the text. A few of them do not compile."""
    return sorted(set(_Finder(source).module()))


def compiles(source: str) -> bool:
    try:
        compile(source, "<mutant>", "exec", dont_inherit=True)
    except SyntaxError:
        return False
    return True


class _Finder:
    def __init__(self, source: str) -> None:
        self._source = source
        self._tree = ast.parse(source)
        self._lines = source.splitlines(keepends=True)
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line))

    def module(self) -> Iterator[Mutation]:
        yield from self._below(self._tree)

    def _below(self, node: ast.AST) -> Iterator[Mutation]:
        for child in self._children(node):
            yield from self._at(child)
            yield from self._below(child)

    def _children(self, node: ast.AST) -> Iterator[ast.AST]:
        """What is executed: no annotations, decorators, texts."""
        for name, value in ast.iter_fields(node):
            if name in {"annotation", "returns", "decorator_list", "type_params"} or getattr(node, "arg", None) == "strict":
                continue
            children = value if isinstance(value, list) else [value]
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and name == "body" and _returns_none(children[-1]):
                children = children[:-1]
            for child in children:
                match child:
                    case ast.JoinedStr() | ast.Import() | ast.ImportFrom() | ast.Call(func=ast.Name(id="TypeVar")):
                        pass
                    case ast.AST():
                        yield child

    def _at(self, node: ast.AST) -> Iterator[Mutation]:
        match node:
            case ast.Compare():
                yield from self._comparison(node)
            case ast.BoolOp():
                old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
                for left, right in zip(node.values, node.values[1:], strict=False):
                    yield from self._between(left, right, old, new, "operator")
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                yield Mutation(self._start(node), self._start(node.operand), "", "operator")
            case ast.BinOp() if type(node.op) in ARITHMETIC:
                yield from self._between(node.left, node.right, _sign(node.op), ARITHMETIC[type(node.op)], "operator")
            case ast.AugAssign() if type(node.op) in ARITHMETIC:
                yield from self._between(node.target, node.value, _sign(node.op), ARITHMETIC[type(node.op)], "operator")
                yield self._replace(node, "pass", "statement")
            case ast.Constant():
                yield from self._constant(node)
            case ast.Call():
                yield from self._arguments(node)
            case ast.Expr(value=ast.Call() | ast.Yield() | ast.YieldFrom() | ast.Await()):
                yield self._replace(node, "pass", "statement")
            case ast.Assign() | ast.AnnAssign(value=ast.expr()):
                if isinstance(node.targets[0] if isinstance(node, ast.Assign) else node.target, ast.Attribute | ast.Subscript):
                    yield self._replace(node, "pass", "statement")
            case ast.Return() | ast.Raise() | ast.Continue() | ast.Break() | ast.Delete():
                yield self._replace(node, "pass", "statement")

    def _comparison(self, node: ast.Compare) -> Iterator[Mutation]:
        operands = [node.left, *node.comparators]
        for left, right, operator in zip(operands, operands[1:], node.ops, strict=False):
            for text in COMPARISONS[type(operator)]:
                yield from self._between(left, right, _comparison_sign(operator), text, "comparison")

    def _constant(self, node: ast.Constant) -> Iterator[Mutation]:
        match node.value:
            case bool():
                yield self._replace(node, str(not node.value), "truth value")
            case int() | float():
                yield self._replace(node, f"({ast.get_source_segment(self._source, node)} + 1)", "number")

    def _arguments(self, node: ast.Call) -> Iterator[Mutation]:
        for keyword in node.keywords:
            if keyword.arg not in (None, "strict"):
                end = self._end(keyword)
                rest = self._source[end:]
                comma = len(rest) - len(rest.lstrip()) if rest.lstrip().startswith(",") else -1
                yield Mutation(self._start(keyword), end + comma + 1 if comma >= 0 else end, "", "argument")
        if isinstance(node.func, ast.Name) and node.func.id in ("max", "min"):
            return
        for left, right in zip(node.args, node.args[1:], strict=False):
            if not isinstance(left, ast.Starred) and not isinstance(right, ast.Starred):
                swapped = [self._source[self._start(side) : self._end(side)] for side in (right, left)]
                if swapped[0] != swapped[1]:
                    middle = self._source[self._end(left) : self._start(right)]
                    yield Mutation(self._start(left), self._end(right), swapped[0] + middle + swapped[1], "argument")

    def _between(self, left: ast.AST, right: ast.AST, old: str, new: str, kind: str) -> Iterator[Mutation]:
        """Replace the operator between two operands; parentheses and line ends may stand beside it."""
        begin, end = self._end(left), self._start(right)
        at = self._source[begin:end].find(old)
        if at >= 0:
            yield Mutation(begin + at, begin + at + len(old), new, kind)

    def _replace(self, node: ast.AST, text: str, kind: str) -> Mutation:
        return Mutation(self._start(node), self._end(node), text, kind)

    def _start(self, node: ast.AST) -> int:
        return self._offset(node.lineno, node.col_offset)  # type: ignore[attr-defined]

    def _end(self, node: ast.AST) -> int:
        return self._offset(node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]

    def _offset(self, line: int, column: int) -> int:
        """ast counts the bytes of UTF-8."""
        return self._starts[line - 1] + len(self._lines[line - 1].encode()[:column].decode())


def _returns_none(statement: ast.AST) -> bool:
    return isinstance(statement, ast.Return) and isinstance(statement.value, ast.Constant) and statement.value.value is None


def _comparison_sign(operator: ast.cmpop) -> str:
    return ast.unparse(ast.Compare(ast.Name("a"), [operator], [ast.Name("b")]))[2:-2]


def _sign(operator: ast.operator) -> str:
    return ast.unparse(ast.BinOp(ast.Name("a"), operator, ast.Name("b")))[2:-2]
