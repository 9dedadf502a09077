"""Mutants of a module: every small mistake that somebody could make in it, one at a time.

What is no code, or code that says nothing but a sentence, stays: annotations, docstrings, strings.
"""

import ast
import copy
import warnings
from collections import Counter
from collections.abc import Iterator
from types import EllipsisType
from typing import Any

_COMPARES: dict[type, tuple[type, ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
_OPERATORS: dict[type, tuple[type, ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.BitOr: (ast.BitAnd,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
_SWAPPED = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "all": "any",
    "any": "all",
}


def _changed_names(node: ast.expr) -> Iterator[ast.expr]:
    """Swap min and max, all and any."""
    if isinstance(node, ast.Name) and node.id in _SWAPPED:
        yield ast.Name(_SWAPPED[node.id], ast.Load())
    if isinstance(node, ast.Name) and node.id == "inf":
        yield ast.Constant(0.0)
    if isinstance(node, ast.Attribute) and node.attr in _SWAPPED:
        yield ast.Attribute(node.value, _SWAPPED[node.attr], ast.Load())


def _changed_calls(node: ast.expr) -> Iterator[ast.expr]:
    """Drop a limit: a call becomes each of its arguments, where it had numbers or arrays."""
    if isinstance(node, ast.Call):
        yield from node.args


def _changed_constants(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        larger = 2.0 * node.value if isinstance(node.value, float) else node.value + 1
        yield ast.Constant(larger or 1.0)
        if node.value:
            yield ast.Constant(-node.value)


def _changed_logic(node: ast.expr) -> Iterator[ast.expr]:
    """Turn comparisons and operators, remove and add `not`, drop an operand."""
    if isinstance(node, ast.Compare):
        for index, operator in enumerate(node.ops):
            for other in _COMPARES.get(type(operator), ()):
                turned = copy.deepcopy(node)
                turned.ops[index] = other()
                yield turned
    if isinstance(node, ast.BoolOp):
        yield ast.BoolOp(_OPERATORS[type(node.op)][0](), node.values)
        yield from node.values
    if isinstance(node, ast.BinOp):
        for other in _OPERATORS.get(type(node.op), ()):
            yield ast.BinOp(node.left, other(), node.right)
        yield node.left
        yield node.right
    if isinstance(node, ast.UnaryOp):
        yield node.operand
    if isinstance(node, ast.IfExp):
        yield node.body
        yield node.orelse


def _expressions(node: ast.expr) -> Iterator[ast.expr]:
    for change in (_changed_names, _changed_calls, _changed_constants, _changed_logic):
        yield from change(node)


def _statements(node: ast.stmt) -> Iterator[ast.stmt]:
    """Delete a statement, negate a condition, weaken `|=`."""
    if isinstance(node, ast.If):
        yield ast.If(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)
        yield ast.If(ast.Constant(True), node.body, node.orelse)
    if isinstance(node, ast.AugAssign):
        for other in _OPERATORS.get(type(node.op), ()):
            yield ast.AugAssign(node.target, other(), node.value)
        yield ast.Assign([_stored(node.target)], node.value)
    if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom):
        yield ast.Pass()


def _stored(target: Any) -> Any:
    stored = copy.deepcopy(target)
    stored.ctx = ast.Store()
    return stored


def _places(tree: ast.Module) -> Iterator[tuple[str, ast.AST, str, int | None]]:
    """Every place of code: its function, the node above, the field, the index in a list."""

    def walk(node: ast.AST, inside: str) -> Iterator[tuple[str, ast.AST, str, int | None]]:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inside = f"{inside}.{node.name}".lstrip(".")
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns"):
                continue
            for index, child in enumerate(value if isinstance(value, list) else [value]):
                if not isinstance(child, ast.AST) or _is_text(child):
                    continue
                yield inside, node, field, index if isinstance(value, list) else None
                yield from walk(child, inside)

    yield from walk(tree, "")


def _is_text(node: ast.AST) -> bool:
    """Whether a node is a docstring, a sentence with numbers in it, or a protocol's ``...``."""
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str | EllipsisType)
    )


def mutants(source: str) -> Iterator[tuple[str, str]]:
    """Name and source of every mutant that still compiles; no two have the same of either."""
    tree = ast.parse(source)
    seen = {ast.unparse(tree)}
    names: Counter[str] = Counter()
    for inside, parent, field, index in _places(tree):
        value = getattr(parent, field)
        node = value if index is None else value[index]
        changes = _expressions if isinstance(node, ast.expr) else _statements
        if not isinstance(node, ast.expr | ast.stmt):
            continue
        for other in changes(node):  # type: ignore[arg-type]
            text = _with(tree, parent, field, index, node, other)
            if text not in seen and _compiles(text):
                seen.add(text)
                before, after = (ast.unparse(ast.fix_missing_locations(n)) for n in (node, other))
                name = f"{inside}: {_short(before)} -> {_short(after)}".removeprefix(": ")
                names[name] += 1
                yield name if names[name] == 1 else f"{name} ({names[name]})", text


def _compiles(text: str) -> bool:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)  # of what is nonsense, and will be killed
        try:
            compile(text, "<mutant>", "exec")
        except SyntaxError:
            return False
    return True


def _short(text: str) -> str:
    lines = text.splitlines()
    return lines[0] + (" ..." if len(lines) > 1 else "")


def _with(
    tree: ast.Module, parent: ast.AST, field: str, index: int | None, node: Any, other: Any
) -> str:
    """Source of the tree with one node replaced; the tree itself comes back unchanged."""
    if index is None:
        setattr(parent, field, other)
    else:
        getattr(parent, field)[index] = other
    text = ast.unparse(ast.fix_missing_locations(tree))
    if index is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[index] = node
    return text
