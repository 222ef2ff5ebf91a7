"""The line of every key of a TOML text is found."""

import tomllib
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from tbatch.scenario.positions import key_lines

TEXT = '''# comment with = and [brackets]
title = "a # no comment"

[track]   # first
length = "100 m"
fastener = { stiffness = 1, damping = 2 }
"odd key".'x y' = """
[not.a.table]
a = 1
"""
values = [ # list
    1, "]", [2,
    3],
    { a = 1 },
]

[speed.more]
at = 1979-05-27T07:32:00Z

[[irregularity.defect]]
kind = 'flat'
[[irregularity.defect]]
kind = "flat"
[irregularity.defect.inner]
z = -1e3
'''


def test_lines_of_tables_keys_elements_and_inline_tables() -> None:
    lines = key_lines(TEXT)
    expected: dict[tuple[Any, ...], int] = {
        ("title",): 2,
        ("track",): 4,
        ("track", "length"): 5,
        ("track", "fastener", "damping"): 6,
        ("track", "odd key", "x y"): 7,
        ("track", "values"): 11,
        ("track", "values", 0): 12,
        ("track", "values", 1): 12,
        ("track", "values", 2): 12,
        ("track", "values", 2, 1): 13,
        ("track", "values", 3, "a"): 14,
        ("speed",): 17,
        ("speed", "more", "at"): 18,
        ("irregularity", "defect"): 20,
        ("irregularity", "defect", 0, "kind"): 21,
        ("irregularity", "defect", 1): 22,
        ("irregularity", "defect", 1, "kind"): 23,
        ("irregularity", "defect", 1, "inner", "z"): 25,
    }
    assert {path: lines.get(path) for path in expected} == expected


def test_line_ends_of_windows_do_not_shift_lines() -> None:
    assert key_lines(TEXT.replace("\n", "\r\n")) == key_lines(TEXT)


def _paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [found for key, inner in items for found in [(*path, key), *_paths(inner, (*path, key))]]


_SCALAR = st.one_of(
    st.integers(-5, 5).map(str),
    st.sampled_from(["true", "1.5", "nan", '"a,]}#"', "'b = [1]'", '"\\" \\\\"', '"""x\n[y]\nz = """', "'''\n]'''"]),
)
_VALUE = st.recursive(
    _SCALAR,
    lambda inner: st.lists(inner, max_size=3).map(lambda items: "[ " + ", # x\n".join(items) + "\n]"),
    max_leaves=6,
)
_KEY = st.sampled_from(["a", "b-1", "c.d", '"e f"', "'g.h'.i", '"#"'])
_LINE = st.builds("{} = {}\n".format, _KEY, _VALUE)
_TABLE = st.builds(
    lambda header, lines: header + "".join(dict.fromkeys(lines)),
    st.sampled_from(["[t]\n", "[t.u]\n", "[[v]]\n", "[[v.w]]\n", "# [x]\n\n", "[y.'z z']\n"]),
    st.lists(_LINE, max_size=4),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(_TABLE, max_size=5).map("".join))
def test_every_key_that_tomllib_reads_has_a_line_that_holds_it(text: str) -> None:
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        key_lines(text)  # not valid: no line is promised, but no error either
        return
    lines, rows = key_lines(text), text.split("\n")
    for path in _paths(tables):
        assert path in lines
        named = [key for key in path if isinstance(key, str)][-1]
        if isinstance(path[-1], str):
            assert named in rows[lines[path] - 1]


@settings(max_examples=100, deadline=None)
@given(st.text(alphabet="[]{}=\"'#,.a1 \n\\", max_size=40))
def test_any_text_ends_without_an_error(text: str) -> None:
    key_lines(text)
