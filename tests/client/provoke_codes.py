"""Every problem code that the service can answer with, read from its source.

A code is the argument of a `ShapeError` or of a `Problem`.  Where it is no plain text, what it can
be is followed through names, calls and their callers; what can't be followed is an error, so that
no code is overlooked.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

from service.mesh.formats import READERS, ZIP

ROOT = Path(__file__).parent.parent.parent
STARTS = ("service/main.py", "service/__main__.py")
"""What is not imported from here, sooner or later, answers no request."""

FORMATS = [ast.Constant(name) for name in (*READERS, ZIP)]
"""What any `format` is: files tell their own."""


@dataclass(frozen=True)
class Place:
    """An expression, and the functions and the module around it, the innermost first."""

    node: ast.expr
    around: tuple[ast.AST, ...]

    def at(self, node: ast.expr) -> Place:
        """Another expression in the same surroundings."""
        return Place(node, self.around)


class Source:
    """The modules that answer requests."""

    def __init__(self, root: Path = ROOT, starts: Sequence[str] = STARTS) -> None:
        self.modules: dict[str, ast.Module] = {}
        pending = list(starts)
        while pending:
            name = pending.pop()
            if name not in self.modules and (root / name).is_file():
                self.modules[name] = ast.parse((root / name).read_text("utf-8"))
                pending += _imported(self.modules[name])

    @cached_property
    def classes(self) -> list[tuple[ast.Module, ast.ClassDef]]:
        """Every class and its module."""
        nodes = [(tree, node) for tree in self.modules.values() for node in ast.walk(tree)]
        return [(tree, node) for tree, node in nodes if isinstance(node, ast.ClassDef)]

    @cached_property
    def takes_a_code(self) -> dict[str, int]:
        """Names of classes, and which of their arguments is the code."""
        classes = [kind for _, kind in self.classes]
        found, before = {"ShapeError": 0}, 0
        while len(found) > before:
            before = len(found)
            found |= {c.name: 0 for c in classes if found.keys() & set(map(_name, c.bases))}
        for kind in classes:
            plain = "__init__" not in [getattr(node, "name", "") for node in kind.body]
            assert plain or kind.name not in found or kind.name == "ShapeError", kind.name
        return found | {"Problem": 1}

    @cached_property
    def calls(self) -> list[tuple[str, str, Place]]:
        """Module, name of what is called, and the call."""
        return [
            (module, _name(place.node.func), place)
            for module, place in self.expressions
            if isinstance(place.node, ast.Call)
        ]

    @cached_property
    def expressions(self) -> list[tuple[str, Place]]:
        """Every expression and its module."""
        return [
            (module, place)
            for module, tree in self.modules.items()
            for place in _within(tree, (tree,))
        ]

    def codes(self) -> dict[str, set[str]]:
        """By code the modules that answer with it.

        Raises:
            LookupError: what a code can be can't be followed.
        """
        found: dict[str, set[str]] = {}
        for module, name, place in self.calls:
            if name not in self.takes_a_code:
                continue
            code = _argument(place.node, self.takes_a_code[name], "code")
            assert code is not None, f"{module}:{place.node.lineno} has no code"
            for text in self.texts(place.at(code)):
                found.setdefault(text, set()).add(module)
        return found

    def texts(self, place: Place) -> Iterator[str]:
        """What an expression can be, as texts."""
        for end in self.ends(place):
            match end.node:
                case ast.Constant(value=str(text)):
                    yield text
                case ast.JoinedStr(values=parts):
                    yield from map("".join, product(*(list(self.texts(end.at(p))) for p in parts)))
                case ast.Attribute(attr="code"):
                    pass  # of an error that was raised elsewhere
                case other:
                    raise LookupError(f"line {other.lineno}: what is {ast.unparse(other)}?")

    def ends(self, place: Place) -> Iterator[Place]:
        """What an expression can stand for, as far as it can be followed."""
        match place.node:
            case ast.FormattedValue(value=inner) | ast.NamedExpr(value=inner):
                yield from self.ends(place.at(inner))
            case ast.Await(value=inner):
                yield from self.ends(place.at(inner))
            case ast.IfExp(body=one, orelse=other):
                yield from self.ends(place.at(one))
                yield from self.ends(place.at(other))
            case ast.Name(id="format") | ast.Attribute(attr="format"):
                yield from map(place.at, FORMATS)
            case ast.Name(id=name):
                yield from self._named(name, place)
            case ast.Attribute(attr=name) if name != "code":
                yield from self._member(name, place)
            case ast.Subscript(value=whole, slice=ast.Constant(value=int(index))):
                yield from self._items(place.at(whole), index)
            case ast.Subscript(value=table):
                yield from self._values(place.at(table))
            case ast.Call():
                yield from self._results(place)
            case _:
                yield place

    def _named(self, name: str, place: Place) -> Iterator[Place]:
        for depth, scope in enumerate(place.around):
            around = place.around[depth:]
            names = _arguments(scope)
            if name in names:
                yield from self._passed(place, name, names)
                return
            bound = list(_bindings(scope, name))
            for value, path in bound:
                yield from self._unpacked(Place(value, around), path)
            if bound:
                return
        yield from self._constants(name, place)

    def _passed(self, place: Place, name: str, names: list[str]) -> Iterator[Place]:
        """What the callers of a function give for an argument."""
        function = next(f.name for f in place.around if name in _arguments(f))
        index = names.index(name) - (names[0] in ("self", "cls"))
        calls = [call for _, called, call in self.calls if called == function]
        if not calls:
            raise LookupError(f"line {place.node.lineno}: who calls {function}?")
        for call in calls:
            if (given := _argument(call.node, index, name)) is not None:
                yield from self.ends(call.at(given))

    def _member(self, name: str, place: Place) -> Iterator[Place]:
        """What classes have under a name."""
        return self._bound(name, place, self.classes)

    def _constants(self, name: str, place: Place) -> Iterator[Place]:
        return self._bound(name, place, [(tree, tree) for tree in self.modules.values()])

    def _bound(
        self, name: str, place: Place, scopes: Sequence[tuple[ast.Module, ast.AST]]
    ) -> Iterator[Place]:
        found = [(tree, value) for tree, scope in scopes for value, _ in _bindings(scope, name)]
        if not found:
            raise LookupError(f"line {place.node.lineno}: what is {name}?")
        for tree, value in found:
            yield from self.ends(Place(value, (tree,)))

    def _unpacked(self, place: Place, path: tuple[int, ...]) -> Iterator[Place]:
        """What an item of an item of an expression can be; -1 is any."""
        if not path:
            yield from self.ends(place)
            return
        for item in self._items(place, path[0]):
            yield from self._unpacked(item, path[1:])

    def _items(self, place: Place, index: int) -> Iterator[Place]:
        for end in self.ends(place):
            match end.node:
                case ast.Tuple(elts=items) | ast.List(elts=items) if index >= 0:
                    yield from self.ends(end.at(items[index]))
                case ast.Tuple(elts=items) | ast.List(elts=items):
                    for item in items:
                        yield from self.ends(end.at(item))
                case ast.ListComp(elt=item) | ast.GeneratorExp(elt=item):
                    yield from self.ends(Place(item, (end.node, *end.around)))
                case ast.Dict(keys=keys):
                    for key in keys:
                        yield from self.ends(end.at(key))
                case ast.Constant(value=None):
                    pass
                case other:
                    raise LookupError(f"line {other.lineno}: what is in {ast.unparse(other)}?")

    def _values(self, place: Place) -> Iterator[Place]:
        for end in self.ends(place):
            assert isinstance(end.node, ast.Dict), ast.unparse(end.node)
            for value in end.node.values:
                yield from self.ends(end.at(value))

    def _results(self, place: Place) -> Iterator[Place]:
        match place.node:
            case ast.Call(func=ast.Attribute(value=table, attr="items"), args=[]):
                for end in self.ends(place.at(table)):
                    assert isinstance(end.node, ast.Dict), ast.unparse(end.node)
                    pairs = zip(end.node.keys, end.node.values, strict=True)
                    yield end.at(ast.List([ast.Tuple(list(pair)) for pair in pairs]))
            case ast.Call(func=ast.Name(id="next"), args=[series, *rest]):
                yield from self._items(place.at(series), -1)
                yield from (p for default in rest for p in self.ends(place.at(default)))
            case ast.Call(func=ast.Name(id=name)):
                yield from self._returned(name, place)
            case _:
                yield place

    def _returned(self, name: str, place: Place) -> Iterator[Place]:
        made = [
            (tree, function)
            for tree in self.modules.values()
            for function in tree.body
            if isinstance(function, ast.FunctionDef) and function.name == name
        ]
        if not made:
            yield place
        for tree, function in made:
            for node in ast.walk(function):
                if isinstance(node, ast.Return) and node.value is not None:
                    yield from self.ends(Place(node.value, (function, tree)))


def _imported(tree: ast.Module) -> Iterator[str]:
    """Files that a module may import, wherever it does."""
    for node in ast.walk(tree):
        named = []
        if isinstance(node, ast.Import):
            named = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            named = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in named:
            path = name.replace(".", "/")
            yield from (f"{path}.py", f"{path}/__init__.py")


def _within(node: ast.AST, around: tuple[ast.AST, ...]) -> Iterator[Place]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            yield Place(child, around)
        inner = (
            ast.FunctionDef | ast.AsyncFunctionDef | ast.ListComp | ast.GeneratorExp | ast.Lambda
        )
        yield from _within(child, (child, *around) if isinstance(child, inner) else around)


def _arguments(scope: ast.AST) -> list[str]:
    """Names of a function's; none of what is no function."""
    if not isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef):
        return []
    return [argument.arg for argument in (*scope.args.args, *scope.args.kwonlyargs)]


def _name(function: ast.expr) -> str:
    match function:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _argument(call: ast.expr, index: int, name: str) -> ast.expr | None:
    assert isinstance(call, ast.Call)
    for keyword in call.keywords:
        if keyword.arg == name:
            return keyword.value
    return call.args[index] if index < len(call.args) else None


def _bindings(scope: ast.AST, name: str) -> Iterator[tuple[ast.expr, tuple[int, ...]]]:
    """What a name is bound to in a scope: an expression, and which item of it."""
    pending = list(ast.iter_child_nodes(scope))
    while pending:
        node = pending.pop(0)
        pairs: list[tuple[ast.expr, ast.expr | None, tuple[int, ...]]] = []
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef() | ast.Lambda():
                continue
            case ast.Assign(targets=targets, value=value):
                pairs = [(target, value, ()) for target in targets]
            case (
                ast.AnnAssign(target=target, value=value)
                | ast.NamedExpr(target=target, value=value)
            ):
                pairs = [(target, value, ())]
            case ast.For(target=target, iter=value) | ast.comprehension(target=target, iter=value):
                pairs = [(target, value, (-1,))]
        for target, value, path in pairs:
            if value is not None and (place := _position(target, name)) is not None:
                yield value, (*path, *place)
        pending += ast.iter_child_nodes(node)


def _position(target: ast.expr, name: str) -> tuple[int, ...] | None:
    match target:
        case ast.Name(id=found):
            return () if found == name else None
        case ast.Tuple(elts=items):
            for index, item in enumerate(items):
                if (inner := _position(item, name)) is not None:
                    return (index, *inner)
    return None
