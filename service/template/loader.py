"""Template files: YAML in, a compiled `AffineTemplate` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from service.template.affine import AffineTemplate
from service.template.expressions import ExpressionError, parse_affine, parse_rows
from service.template.guide import Guide, read_guide
from service.template.parameters import Derived, Parameter
from service.template.parts import Part, PartError, read_parts

BUILT_IN = Path(__file__).parent
"""The folder of the categories' templates that come with the service."""


class TemplateError(ValueError):
    """A template file that can't be compiled; the message names the entry."""


def load_template(source: str | Path) -> AffineTemplate:
    """Compile a template.

    Args:
        source: the name of a built-in category (``"chair"``) or the path of a YAML file.

    Raises:
        TemplateError: for a missing file or entry, or an expression that is not affine.
    """
    path = template_path(source)
    if path.parent == BUILT_IN and not path.is_file():
        raise TemplateError(f"there is no built-in template named {path.stem!r}")
    try:
        spec = yaml.safe_load(path.read_text("utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise TemplateError(f"{source} can't be read: {error}") from error
    return compile_template(spec)


def template_path(source: str | Path) -> Path:
    """The file of a template that is named as for `load_template`."""
    built_in = isinstance(source, str) and not source.endswith((".yaml", ".yml"))
    return BUILT_IN / f"{source}.yaml" if built_in else Path(source)


def compile_template(spec: Mapping[str, Any]) -> AffineTemplate:
    """Compile a template from the parsed YAML; see `chair.yaml` for the entries."""
    try:
        entries: Mapping[str, Any] = spec["parameters"]
        names = [str(name) for name in entries]
        parameters = tuple(_parameter(name, entry, entries) for name, entry in entries.items())
        parts = [
            part for name, entry in spec["parts"].items() for part in read_parts(name, entry, names)
        ]
        return AffineTemplate(
            name=spec["name"],
            label=spec["label"],
            points=int(spec["points"]),
            parameters=parameters,
            derived={n: _derived(n, e, names) for n, e in spec.get("derived", {}).items()},
            relations=parse_rows(spec.get("relations", []), names),
            relation_texts=tuple(map(str, spec.get("relations", []))),
            anchors={name: parse_rows(point, names) for name, point in spec["keep"].items()},
            present=_variants(spec.get("variants", {}), spec["parts"], parts),
            **_assemble(parts),
        )
    except KeyError as error:
        raise TemplateError(f"the entry {error} is missing") from error
    except (ExpressionError, PartError) as error:
        raise TemplateError(str(error)) from error
    except TemplateError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise TemplateError(f"an entry has the wrong form: {error}") from error


def _variants(
    entries: Mapping[str, Mapping[str, Any]], files: Mapping[str, Any], parts: Sequence[Part]
) -> dict[str, NDArray[np.bool_]]:
    """Which parts each variant has.  A part that it is `without` takes its mirrored copies along.

    Raises:
        TemplateError: for a part that there is none of, or a variant of no parts.
    """
    present = {}
    for name, entry in entries.items():
        absent: set[str] = set()
        for part in entry.get("without") or []:
            if part not in files:
                raise TemplateError(f"variant {name!r}: no part is named {part!r}")
            absent |= {part, *files[part].get("mirror", {})}
        present[str(name)] = np.array([part.name not in absent for part in parts])
        if not present[str(name)].any():
            raise TemplateError(f"variant {name!r} has no parts")
    return present


def _assemble(parts: Sequence[Part]) -> dict[str, Any]:
    """The arrays of all parts, one after the other."""
    offsets = np.cumsum([0, *(len(part.shape.vertices) for part in parts)])
    coefficients = np.concatenate([part.vertices() for part in parts])
    frames = np.stack([part.frame for part in parts])
    tapers = np.stack([part.taper for part in parts])
    return {
        "base": coefficients[..., 0],
        "jacobian": np.ascontiguousarray(coefficients[..., 1:]),
        "faces": np.concatenate([p.shape.faces + o for p, o in zip(parts, offsets, strict=False)]),
        "part": np.repeat(np.arange(len(parts)), np.diff(offsets)),
        "parts": tuple(part.name for part in parts),
        "hidden": np.concatenate([part.hidden for part in parts]),
        "frame_base": frames[..., 0],
        "frame_jacobian": np.ascontiguousarray(frames[..., 1:]),
        "taper_base": tapers[..., 0],
        "taper_jacobian": np.ascontiguousarray(tapers[..., 1:]),
        "run": np.array([part.run for part in parts]),
    }


def _parameter(
    name: str, entry: Mapping[str, Any], entries: Mapping[str, Mapping[str, Any]]
) -> Parameter:
    low, high = (float(end) for end in entry["range"])
    nuisance = _flag(entry.get("nuisance", False))
    if not low < high:
        raise TemplateError(f"parameter {name!r}: the range {[low, high]} is empty")
    if low <= 0.0 and not nuisance:
        raise TemplateError(
            f"parameter {name!r}: the range {[low, high]} is not positive; "
            "only nuisance parameters may be signed"
        )
    return Parameter(
        name=name,
        label=entry["label"],
        group=entry["group"],
        paper=entry.get("paper", entry["label"].lower()),
        low=low,
        high=high,
        typical=_interval(entry.get("typical", [low, high])),
        nuisance=nuisance,
        follows=_follows(name, entry, entries),
    )


def _follows(
    name: str, entry: Mapping[str, Any], entries: Mapping[str, Mapping[str, Any]]
) -> Guide | None:
    """Only nuisance parameters follow, and only public ones lead."""
    if "follows" not in entry:
        return None
    public = [not other.get("nuisance", False) for other in entries.values()]
    try:
        if not entry.get("nuisance", False):
            raise ExpressionError("only nuisance parameters do")
        return read_guide(name, entry["follows"], list(entries), public)
    except ExpressionError as error:
        raise TemplateError(f"parameter {name!r} follows {entry['follows']!r}: {error}") from error


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is neither true nor false")
    return value


def _derived(name: str, entry: Mapping[str, Any], names: Sequence[str]) -> Derived:
    return Derived(
        name=name,
        label=entry["label"],
        group=entry["group"],
        typical=_interval(entry["typical"]),
        row=parse_affine(entry["value"], names) if "value" in entry else None,
        extent=entry.get("extent"),
        by=tuple(names.index(parameter) for parameter in entry["by"]),
        on=_measured_on(name, entry),
    )


def _measured_on(name: str, entry: Mapping[str, Any]) -> str | None:
    """The part whose upper face says how a row is measured on the mesh itself."""
    measure = entry.get("measure")
    if measure is None:
        return None
    if "value" not in entry:
        raise TemplateError(f"derived {name!r}: an extent is measured as it is; leave out measure")
    ways = {key: measure[key] for key in measure if key != "part"}
    if ways != {"face": "+y", "from": "floor"}:
        raise TemplateError(
            f"derived {name!r}: measure is {{part: ..., face: +y, from: floor}}, no other way"
        )
    return str(measure["part"])


def _interval(pair: Sequence[float]) -> tuple[float, float]:
    return float(pair[0]), float(pair[1])
