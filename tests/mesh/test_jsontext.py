from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.mesh.jsontext import END, Path, dump, splice

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=12,
)


@pytest.mark.parametrize(
    ("text", "edits", "expected"),
    [
        ('{"a": 1.50, "b" : [1, 2]}', {("a",): 2}, '{"a": 2, "b" : [1, 2]}'),
        ('{"b":[ {"x":1} ,{"x":2}]}', {("b", 1, "x"): [0.5]}, '{"b":[ {"x":1} ,{"x":[0.5]}]}'),
        ('{"b":[1, 2 ]}', {("b", END): [3, {"c": None}]}, '{"b":[1, 2,3,{"c":null} ]}'),
        ('{"b":[ ]}', {("b", END): ["é"]}, '{"b":["é" ]}'),
        ('{"a":{"x":1}}', {("a", "y"): 2, ("a", "x"): 3}, '{"a":{"x":3,"y":2}}'),
        ('{ "a" : { } }', {("a", "y"): True}, '{ "a" : {"y":true } }'),
        ("\ufeff\n{}", {("a",): 1}, '\ufeff\n{"a":1}'),
        ('{"a":1,"a":2}', {("a",): 3}, '{"a":3,"a":3}'),
        ('{"\\u0061":"]}"}', {("a",): "}"}, '{"\\u0061":"}"}'),
        ('{"a":{"b":1},"c":2}', {("c",): {"b": 2}}, '{"a":{"b":1},"c":{"b":2}}'),
    ],
)
def test_only_the_named_values_change(text: str, edits: dict[Path, object], expected: str) -> None:
    assert splice(text, edits) == expected


@settings(deadline=None, database=None)
@given(
    document=st.dictionaries(st.text(max_size=4), values, min_size=1),
    indent=st.sampled_from([None, 1, "\t"]),
    ascii=st.booleans(),
    data=st.data(),
)
def test_splicing_is_setting(
    document: dict[str, Any], indent: str | None, ascii: bool, data: st.DataObject
) -> None:
    text = json.dumps(document, indent=indent, ensure_ascii=ascii)
    path: list[str | int] = []
    target: Any = document
    while isinstance(target, dict | list) and target and (not path or data.draw(st.booleans())):
        keys = list(target) if isinstance(target, dict) else list(range(len(target)))
        path.append(data.draw(st.sampled_from(keys)))
        target = target[path[-1]]
    new = data.draw(values)
    spliced = splice(text, {tuple(path): new})
    owner: Any = document
    for step in path[:-1]:
        owner = owner[step]
    owner[path[-1]] = new
    assert json.loads(spliced) == document


def test_dump_is_compact_and_keeps_letters() -> None:
    assert dump({"ü": [1, 0.1]}) == '{"ü":[1,0.1]}'


def test_half_a_surrogate_pair_stays_an_escape() -> None:
    text = splice('{"a":"\\ud800","b":1}', {("b",): {"\ud800": "ü"}})
    assert text.encode() == b'{"a":"\\ud800","b":{"\\ud800":"\\u00fc"}}'
