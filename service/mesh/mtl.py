"""MTL, the materials beside an OBJ: what each says, and of the pictures it names."""

from __future__ import annotations

import math
from dataclasses import dataclass

from service.mesh.looks import Statements

# Options ahead of a picture's name, by how many words follow.
WORDS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-texres": 1, "-type": 1,
}  # fmt: skip
# Those that are followed by one to three numbers.
VECTORS = ("-o", "-s", "-t")


@dataclass(frozen=True)
class Picture:
    """A picture as a material names it.

    Attributes:
        path: of the file.
        offset, scale: what moves and repeats it, in u and v.
    """

    path: str
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)


def read_materials(data: bytes) -> dict[str, Statements]:
    """What each material says: the rest of the line by keyword, in lower case, of the last one."""
    materials: dict[str, Statements] = {}
    statements: Statements = {}
    for line in text_of(data).splitlines():
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        if keyword.lower() == "newmtl":
            statements = materials[rest.strip()] = {}
        elif keyword and not keyword.startswith("#"):
            statements[keyword.lower()] = rest.strip()
    return materials


def text_of(data: bytes) -> str:
    """Names are UTF-8 today, and were anything once."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def number(statements: Statements, *keywords: str) -> float | None:
    """The first number behind the first of some keywords that has one."""
    for keyword in keywords:
        found = _numbers(statements.get(keyword, "").split()[:1])
        if found:
            return found[0]
    return None


def colour(statements: Statements, keyword: str) -> list[float] | None:
    """Red, green and blue, from 0 to 1; one number alone stands for all."""
    found = _numbers(statements.get(keyword, "").split()[:3])
    if not found:
        return None
    red, green, blue = found if len(found) == 3 else [found[0]] * 3
    return [min(max(value, 0.0), 1.0) for value in (red, green, blue)]


def picture(statements: Statements, *keywords: str) -> Picture | None:
    """The picture behind the first of some keywords that names one."""
    for keyword in keywords:
        found = _picture(statements.get(keyword, "").split(" "))
        if found.path:
            return found
    return None


def _picture(words: list[str]) -> Picture:
    vectors = {"-o": (0.0, 0.0), "-s": (1.0, 1.0)}
    while words and (not words[0] or words[0].lower() in (*WORDS, *VECTORS)):
        option, *words = words
        option = option.lower()
        if option not in VECTORS:
            words = words[WORDS.get(option, 0) :]
            continue
        values = _numbers(words[:3])
        words = words[len(values) :]
        if option in vectors:
            values += vectors[option][len(values) :]
            vectors[option] = (values[0], values[1])
    return Picture(" ".join(words).strip().strip('"'), vectors["-o"], vectors["-s"])


def _numbers(words: list[str]) -> list[float]:
    """Finite numbers up to the first word that is none."""
    found: list[float] = []
    for word in words:
        try:
            value = float(word)
        except ValueError:
            break
        if not math.isfinite(value) or abs(value) > 1e9:
            break
        found.append(value)
    return found
