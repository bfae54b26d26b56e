"""Affine expressions of named parameters, as template files write them."""

from __future__ import annotations

import ast
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Affine = NDArray[np.float64]
"""``[1 + d]``: the constant, then one coefficient a parameter."""


class ExpressionError(ValueError):
    """The text is no affine expression of the given names."""


def parse_affine(text: str | float, names: Sequence[str]) -> Affine:
    """Coefficients of an expression such as ``"seat_width / 2 - leg_width / 2"``.

    Args:
        text: numbers, parameter names, ``+ - * /`` and brackets.
        names: the ``d`` parameter names, in order.

    Returns:
        ``[1 + d]`` constant and coefficients.

    Raises:
        ExpressionError: for anything that is not affine in the parameters, naming the spot.
    """
    source = str(text)
    try:
        tree = ast.parse(source, mode="eval")
    except SyntaxError as error:
        raise ExpressionError(f"{source!r} is not an expression") from error
    return _Evaluator(source, names).visit_node(tree.body)


def parse_rows(texts: Sequence[str | float], names: Sequence[str]) -> Affine:
    """``[n, 1 + d]`` coefficients of several expressions; see `parse_affine`."""
    rows = [parse_affine(text, names) for text in texts]
    return np.array(rows).reshape(-1, 1 + len(names))


class _Evaluator:
    """Walks an expression tree; every value on the way is an affine row."""

    def __init__(self, source: str, names: Sequence[str]) -> None:
        self.source = source
        self.names = names

    def visit_node(self, node: ast.expr) -> Affine:
        if isinstance(node, ast.Constant):
            return self._number(node)
        if isinstance(node, ast.Name):
            return self._parameter(node.id)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            operand = self.visit_node(node.operand)
            return -operand if isinstance(node.op, ast.USub) else operand
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        raise ExpressionError(f"{self.source!r}: {ast.unparse(node)!r} is not allowed here")

    def _number(self, node: ast.Constant) -> Affine:
        # True and False are integers to Python, and what a stray YAML yes or no becomes.
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            raise ExpressionError(f"{self.source!r}: {ast.unparse(node)!r} is not allowed here")
        row = np.zeros(1 + len(self.names))
        row[0] = node.value
        return row

    def _parameter(self, name: str) -> Affine:
        if name not in self.names:
            raise ExpressionError(f"{self.source!r}: no parameter is named {name!r}")
        row = np.zeros(1 + len(self.names))
        row[1 + self.names.index(name)] = 1.0
        return row

    def _binary(self, node: ast.BinOp) -> Affine:
        left, right = self.visit_node(node.left), self.visit_node(node.right)
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        if isinstance(node.op, ast.Mult):
            if not right[1:].any():
                return left * right[0]
            if not left[1:].any():
                return right * left[0]
            raise ExpressionError(f"{self.source!r}: a product of parameters is not affine")
        if isinstance(node.op, ast.Div):
            if right[1:].any():
                raise ExpressionError(f"{self.source!r}: dividing by a parameter is not affine")
            if right[0] == 0.0:
                raise ExpressionError(f"{self.source!r}: division by zero")
            return left / right[0]
        raise ExpressionError(f"{self.source!r}: only + - * / are allowed")
