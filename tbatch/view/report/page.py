"""The page: HTML without scripts, fonts or pictures from elsewhere."""

import base64
import csv
import io
import math
from collections.abc import Sequence
from html import escape
from typing import Any

from tbatch.view.report.drawing import Picture

_CSS = """
body { font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", Arial, sans-serif; color: #1a1a1a; background: #fff;
       max-width: 64rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; }
h2 { font-size: 1.25rem; margin-top: 2.4rem; border-bottom: 1px solid #ddd; }
h3 { font-size: 1.05rem; margin: 2rem 0 .3rem; } svg { width: 100%; height: auto; }
svg text { font-family: inherit; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .87rem; margin: .8rem 0; }
th, td { padding: .2rem .4rem; text-align: right; border-bottom: 1px solid #e4e4e4; vertical-align: top;
         white-space: pre-line; }
td:not(.text) { white-space: pre; }
th { border-bottom: 2px solid #999; font-weight: 600; } td.text, th.text { text-align: left; }
tr.fail td { background: #fdecec; } .wide { overflow-x: auto; }
figure { margin: 0 0 1rem; } figcaption, .note { color: #555; font-size: .87rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; font-size: .9rem; }
dt { color: #555; } dd { margin: 0; overflow-wrap: anywhere; } .csv { font-size: .85rem; }
.flag { color: #8a4b00; }
@media print { h3 { break-after: avoid; } figure { break-inside: avoid; } }
"""


def csv_text(picture: Picture) -> str:
    """The numbers behind a figure; an end that the runs leave open is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(picture.columns)
    writer.writerows([[_plain(value) for value in row] for row in picture.rows])
    return text.getvalue()


def figure_html(picture: Picture, basis: str) -> str:
    """A figure with its caption and its numbers, which travel within the page.

    Args:
        picture: The figure.
        basis: What all figures rest on: runs, seed, version.
    """
    data = base64.b64encode(csv_text(picture).encode()).decode()
    link = f'<a class="csv" download="{picture.name}.csv" href="data:text/csv;base64,{data}">{picture.name}.csv</a>'
    return (
        f'<h3 id="{picture.name}">{escape(picture.title)}</h3>\n<figure>\n{picture.svg}\n'
        f"<figcaption>{escape(picture.caption)} {escape(basis)} {link}</figcaption>\n</figure>"
    )


def table_html(
    titles: Sequence[str], rows: Sequence[Sequence[str]], *, text: int = 0, failed: Sequence[int] = ()
) -> str:
    """A table; the first ``text`` columns are words, rows of ``failed`` are marked."""
    kinds = [' class="text"' if place < text else "" for place in range(len(titles))]
    head = "".join(f"<th{kind}>{escape(title)}</th>" for kind, title in zip(kinds, titles, strict=True))
    body = []
    for index, row in enumerate(rows):
        cells = "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(kinds, row, strict=True))
        mark = ' class="fail"' if index in failed else ""
        body.append(f"<tr{mark}>{cells}</tr>")
    return (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>\n'
        + "\n".join(body)
        + "\n</tbody></table></div>"
    )


def facts_html(facts: Sequence[tuple[str, str]]) -> str:
    """What the report rests on, by name."""
    return "<dl>" + "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>\n" for name, value in facts) + "</dl>"


def page_html(title: str, parts: Sequence[str]) -> str:
    """The whole page."""
    head = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{_CSS}</style>\n</head>\n<body>\n"
    )
    return head + "\n".join(parts) + "\n</body>\n</html>\n"


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return repr(float(value)) if math.isfinite(value) else ""
    return value
