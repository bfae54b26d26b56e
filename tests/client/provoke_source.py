"""The service's source, to look things up in: who calls what, and what a name is bound to."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
STARTS = ("service/main.py", "service/__main__.py")
"""What is not imported from here, sooner or later, answers no request."""


Known = tuple[str, str]
"""A module's file and a name in it."""


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
    def classes(self) -> list[tuple[str, ast.ClassDef]]:
        """Every class of a module."""
        nodes = [(module, node) for module, tree in self.modules.items() for node in tree.body]
        return [(module, node) for module, node in nodes if isinstance(node, ast.ClassDef)]

    def origin(self, module: str, called: ast.expr) -> Known | None:
        """The class that is meant by a name, or a name of an imported module's, in a module."""
        match called:
            case ast.Name(id=name):
                return self._origin(module, name)
            case ast.Attribute(value=ast.Name(id=base), attr=name):
                whose = self._imports.get((module, base))
                return self._origin(f"{whose.replace('.', '/')}.py", name) if whose else None
        return None

    def _origin(self, module: str, name: str) -> Known | None:
        while (module, name) not in self._defined:
            path = self._imports.get((module, name))
            if path is None:
                return None
            package, _, name = path.rpartition(".")
            module = f"{package.replace('.', '/')}.py"
        return module, name

    @cached_property
    def _defined(self) -> frozenset[Known]:
        return frozenset((module, kind.name) for module, kind in self.classes)

    @cached_property
    def _imports(self) -> dict[Known, str]:
        """What a name of a module is by its imports: dotted, its own name last."""
        return {
            (module, alias.asname or alias.name): f"{node.module}.{alias.name}"
            for module, tree in self.modules.items()
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }

    @cached_property
    def calls(self) -> list[tuple[str, str, Place]]:
        """Module, name of what is called, and the call."""
        return [
            (module, name_of(place.node.func), place)
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

    def functions(self, name: str) -> list[tuple[ast.Module, ast.FunctionDef]]:
        """Those of modules, by a name."""
        return [
            (tree, node)
            for tree in self.modules.values()
            for node in tree.body
            if isinstance(node, ast.FunctionDef) and node.name == name
        ]


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


def arguments_of(scope: ast.AST) -> list[str]:
    """Names of a function's; none of what is no function."""
    if not isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef):
        return []
    return [argument.arg for argument in (*scope.args.args, *scope.args.kwonlyargs)]


def name_of(function: ast.expr) -> str:
    match function:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def argument(call: ast.expr, index: int, name: str) -> ast.expr | None:
    assert isinstance(call, ast.Call)
    for keyword in call.keywords:
        if keyword.arg == name:
            return keyword.value
    assert not any(isinstance(given, ast.Starred) for given in call.args[:index]), call.lineno
    return call.args[index] if index < len(call.args) else None


def bindings(scope: ast.AST, name: str) -> Iterator[tuple[ast.expr, tuple[int, ...]]]:
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
