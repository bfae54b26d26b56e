"""Every problem code that the service can answer with, read from its source.

A code is the argument of a `ShapeError`, of a `Problem`, and of every class with a field of that
name.  Where it is no plain text, what it can be is followed through names, calls and their callers;
what can't be followed is an error, so that no code is overlooked.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import product

from provoke_source import Known, Place, Source, argument, arguments_of, bindings

from service.mesh.formats import READERS, ZIP

FORMATS = [ast.Constant(name) for name in (*READERS, ZIP)]
"""What any `format` is: files tell their own."""


class Codes:
    """What follows a code to where it is said."""

    def __init__(self, source: Source) -> None:
        self.source = source

    @cached_property
    def takes_a_code(self) -> dict[Known, int]:
        """Classes, and which of their arguments is the code."""
        source, found = self.source, {}
        for module, kind in source.classes:
            named = [argument for node in kind.body for argument in _of_init(node)] or _fields(kind)
            if "code" in named:
                found[module, kind.name] = named.index("code")
        before = 0
        while len(found) > before:
            before = len(found)
            for module, kind in source.classes:
                bases = [source.origin(module, base) for base in kind.bases]
                inherited = [found[base] for base in bases if base in found]
                if inherited and (module, kind.name) not in found:
                    own = "__init__" in [getattr(node, "name", "") for node in kind.body]
                    assert not own, f"{module}: what is the code of {kind.name}?"
                    found[module, kind.name] = inherited[0]
        return found

    def found(self) -> dict[str, set[str]]:
        """By code the modules that answer with it.

        Raises:
            LookupError: what a code can be can't be followed.
        """
        found: dict[str, set[str]] = {}
        names = {name for _, name in self.takes_a_code}
        for module, name, place in self.source.calls:
            known = self.source.origin(module, place.node.func)
            if known is None and name in names:
                raise LookupError(f"{module}:{place.node.lineno}: which {name} is it?")
            index = self.takes_a_code.get(known)
            if index is None:
                continue
            code = argument(place.node, index, "code")
            assert code is not None, f"{module}:{place.node.lineno} has no code"
            try:
                texts = list(self.texts(place.at(code)))
            except LookupError as error:
                raise LookupError(f"{module}:{place.node.lineno}: {error}") from error
            for text in texts:
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
            case ast.Starred(value=several):
                yield from self._items(place.at(several), 0)
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
            names = arguments_of(scope)
            if name in names:
                yield from self._passed(place, name, names)
                return
            bound = list(bindings(scope, name))
            for value, path in bound:
                yield from self._unpacked(Place(value, around), path)
            if bound:
                return
        yield from self._constants(name, place)

    def _passed(self, place: Place, name: str, names: list[str]) -> Iterator[Place]:
        """What the callers of a function give for an argument."""
        function = next(f.name for f in place.around if name in arguments_of(f))
        index = names.index(name) - (names[0] in ("self", "cls"))
        calls = [call for _, called, call in self.source.calls if called == function]
        if not calls:
            raise LookupError(f"line {place.node.lineno}: who calls {function}?")
        for call in calls:
            if (given := argument(call.node, index, name)) is not None:
                yield from self.ends(call.at(given))

    def _member(self, name: str, place: Place) -> Iterator[Place]:
        """What classes have under a name."""
        return self._bound(
            name, place, [(self.source.modules[m], c) for m, c in self.source.classes]
        )

    def _constants(self, name: str, place: Place) -> Iterator[Place]:
        return self._bound(name, place, [(tree, tree) for tree in self.source.modules.values()])

    def _bound(
        self, name: str, place: Place, scopes: Sequence[tuple[ast.Module, ast.AST]]
    ) -> Iterator[Place]:
        found = [(tree, value) for tree, scope in scopes for value, _ in bindings(scope, name)]
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
        made = self.source.functions(name)
        if not made:
            yield place
        for tree, function in made:
            for node in ast.walk(function):
                if isinstance(node, ast.Return) and node.value is not None:
                    yield from self.ends(Place(node.value, (function, tree)))


def _of_init(node: ast.stmt) -> list[str]:
    """Arguments that a class is made with, by its own word."""
    own = isinstance(node, ast.FunctionDef) and node.name == "__init__"
    return arguments_of(node)[1:] if own else []


def _fields(kind: ast.ClassDef) -> list[str]:
    """Names that a class declares, in order: of a dataclass its arguments."""
    targets = [node.target for node in kind.body if isinstance(node, ast.AnnAssign)]
    return [target.id for target in targets if isinstance(target, ast.Name)]
