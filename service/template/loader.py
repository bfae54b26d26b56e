"""Template files: YAML in, a compiled `AffineTemplate` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from service.template.affine import AffineTemplate, Array
from service.template.expressions import ExpressionError, parse_affine
from service.template.parameters import Derived, Parameter
from service.template.shapes import UnitShape, box


class TemplateError(ValueError):
    """A template file that can't be compiled; the message names the entry."""


def load_template(source: str | Path) -> AffineTemplate:
    """Compile a template.

    Args:
        source: the name of a built-in category (``"chair"``) or the path of a YAML file.

    Raises:
        TemplateError: for a missing file or entry, or an expression that is not affine.
    """
    if isinstance(source, str) and not source.endswith((".yaml", ".yml")):
        file = resources.files("service.template") / f"{source}.yaml"
        if not file.is_file():
            raise TemplateError(f"there is no built-in template named {source!r}")
        text = file.read_text("utf-8")
        return compile_template(yaml.safe_load(text))
    try:
        spec = yaml.safe_load(Path(source).read_text("utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise TemplateError(f"{source} can't be read: {error}") from error
    return compile_template(spec)


def compile_template(spec: Mapping[str, Any]) -> AffineTemplate:
    """Compile a template from the parsed YAML; see `chair.yaml` for the entries."""
    try:
        parameters = tuple(_parameter(name, entry) for name, entry in spec["parameters"].items())
        names = [parameter.name for parameter in parameters]
        parts = [
            part for name, entry in spec["parts"].items() for part in _parts(name, entry, names)
        ]
        return AffineTemplate(
            name=spec["name"],
            label=spec["label"],
            points=int(spec["points"]),
            parameters=parameters,
            derived={n: _derived(n, e, names) for n, e in spec.get("derived", {}).items()},
            relations=_rows(spec.get("relations", []), names),
            relation_texts=tuple(map(str, spec.get("relations", []))),
            anchors={name: _rows(point, names) for name, point in spec["keep"].items()},
            **_assemble(parts),
        )
    except KeyError as error:
        raise TemplateError(f"the entry {error} is missing") from error
    except ExpressionError as error:
        raise TemplateError(str(error)) from error
    except TemplateError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise TemplateError(f"an entry has the wrong form: {error}") from error


class _Part:
    """One placed unit shape: its frame's ``[3, 4, 1 + d]`` rows and its hidden faces."""

    def __init__(self, name: str, shape: UnitShape, frame: Array, hidden: Sequence[str]) -> None:
        self.name = name
        self.shape = shape
        self.frame = frame
        unknown = set(hidden) - set(shape.sides)
        if unknown:
            raise TemplateError(f"part {name!r}: no side is named {sorted(unknown)[0]!r}")
        self.hidden = np.isin(shape.side, [shape.sides.index(side) for side in hidden])

    def mirrored(self, name: str, axes: str) -> _Part:
        """The reflection across the planes through the origin that are normal to `axes`."""
        sign = np.array([-1.0 if axis in axes else 1.0 for axis in "xyz"])
        faces = self.shape.faces[:, ::-1] if len(axes) % 2 else self.shape.faces
        copy = _Part.__new__(_Part)
        copy.name = name
        copy.shape = UnitShape(self.shape.vertices, faces, self.shape.side, self.shape.sides)
        copy.frame = sign[:, None, None] * self.frame
        copy.hidden = self.hidden
        return copy


def _parts(name: str, entry: Mapping[str, Any], names: Sequence[str]) -> list[_Part]:
    if entry["shape"] != "box":
        raise TemplateError(f"part {name!r}: no shape is named {entry['shape']!r}; there is 'box'")
    a, b, c = (int(count) for count in entry["cells"])
    frame = np.zeros((3, 4, 1 + len(names)))
    frame[np.arange(3), np.arange(3)] = _rows(entry["size"], names)
    frame[:, 3] = _rows(entry["center"], names)
    part = _Part(name, box((a, b, c)), frame, entry.get("hidden", []))
    return [part, *(part.mirrored(n, axes) for n, axes in entry.get("mirror", {}).items())]


def _assemble(parts: Sequence[_Part]) -> dict[str, Any]:
    """The arrays of all parts, one after the other."""
    offsets = np.cumsum([0, *(len(part.shape.vertices) for part in parts)])
    coefficients = np.concatenate([
        np.einsum("vk,ckd->vcd", homogeneous(part.shape.vertices), part.frame)
        for part in parts
    ])  # fmt: skip
    frames = np.stack([part.frame for part in parts])
    return {
        "base": coefficients[..., 0],
        "jacobian": np.ascontiguousarray(coefficients[..., 1:]),
        "faces": np.concatenate([p.shape.faces + o for p, o in zip(parts, offsets, strict=False)]),
        "part": np.repeat(np.arange(len(parts)), np.diff(offsets)),
        "parts": tuple(part.name for part in parts),
        "hidden": np.concatenate([part.hidden for part in parts]),
        "frame_base": frames[..., 0],
        "frame_jacobian": np.ascontiguousarray(frames[..., 1:]),
    }


def homogeneous(points: Array) -> Array:
    """``[n, 3]`` points with a fourth coordinate of 1."""
    return np.pad(points, ((0, 0), (0, 1)), constant_values=1.0)


def _parameter(name: str, entry: Mapping[str, Any]) -> Parameter:
    low, high = (float(end) for end in entry["range"])
    if not 0.0 < low < high:
        raise TemplateError(f"parameter {name!r}: the range {[low, high]} is empty or not positive")
    return Parameter(
        name=name,
        label=entry["label"],
        group=entry["group"],
        paper=entry.get("paper", entry["label"].lower()),
        low=low,
        high=high,
        typical=_interval(entry.get("typical", [low, high])),
    )


def _derived(name: str, entry: Mapping[str, Any], names: Sequence[str]) -> Derived:
    return Derived(
        name=name,
        label=entry["label"],
        group=entry["group"],
        typical=_interval(entry["typical"]),
        row=parse_affine(entry["value"], names) if "value" in entry else None,
        extent=entry.get("extent"),
        by=tuple(names.index(parameter) for parameter in entry["by"]),
    )


def _interval(pair: Sequence[float]) -> tuple[float, float]:
    return float(pair[0]), float(pair[1])


def _rows(expressions: Sequence[str | float], names: Sequence[str]) -> NDArray[np.float64]:
    rows = [parse_affine(expression, names) for expression in expressions]
    return np.array(rows).reshape(-1, 1 + len(names))
