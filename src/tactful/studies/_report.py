"""A report of an experiment as one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #22262b; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
table { border-collapse: collapse; font-size: 13px; margin: 0.8rem 0; }
th, td { border-bottom: 1px solid #e0e3e7; padding: 0.25rem 0.7rem; text-align: right; vertical-align: top; }
th:first-child, td:first-child { text-align: left; } th { font-weight: 600; color: #5b626b; }
figure { margin: 1rem 0; } figure svg, figure img { max-width: 100%; height: auto; }
figcaption { font-size: 13px; color: #5b626b; } .missed { color: #b3402f; font-weight: 600; }
footer { margin-top: 3rem; font-size: 12px; color: #5b626b; }
"""


@dataclass(frozen=True)
class Table:
    """Rows of text below a heading; the first column names the row."""

    heading: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Picture:
    """An SVG or PNG file, which the report takes in."""

    path: Path
    caption: str


@dataclass(frozen=True)
class Section:
    """A heading with what stands below it; text becomes a paragraph."""

    title: str
    content: Sequence[str | Table | Picture]


def report(title: str, sections: Sequence[Section], *, footer: str = "") -> str:
    """Return the report; nothing in it is fetched from elsewhere, and no text is taken for markup."""
    body = [f"<h1>{html.escape(title)}</h1>"]
    for section in sections:
        body.append(f"<h2>{html.escape(section.title)}</h2>")
        body += [_markup(item) for item in section.content]
    if footer:
        body.append(f"<footer>{html.escape(footer)}</footer>")
    head = f'<meta charset="utf-8"><title>{html.escape(title)}</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n' + "\n".join(body) + "\n</body></html>\n"


def targets_table(targets: Sequence[dict[str, object]]) -> Table:
    """Return the table of what was wanted and what was reached."""
    rows = []
    for row in targets:
        reached = row["reached"]
        said = reached if isinstance(reached, str) else "-" if reached is None else f"{reached:.3g}"
        rows.append((str(row["what"]), str(row["target"]), said, "" if row["met"] else "missed"))
    return Table(("what", "wanted", "reached", ""), rows)


def _markup(item: str | Table | Picture) -> str:
    if isinstance(item, str):
        return f"<p>{html.escape(item)}</p>"
    if isinstance(item, Table):
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in item.heading)
        rows = ["<tr>" + "".join(map(_cell, row)) + "</tr>" for row in item.rows]
        return f"<table><thead><tr>{head}</tr></thead><tbody>\n" + "\n".join(rows) + "\n</tbody></table>"
    data = base64.b64encode(item.path.read_bytes()).decode()
    kind = {".svg": "svg+xml", ".png": "png"}[item.path.suffix]
    caption = html.escape(item.caption)
    image = f'<img alt="{caption}" src="data:image/{kind};base64,{data}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def _cell(text: str) -> str:
    style = ' class="missed"' if text == "missed" else ""
    return f"<td{style}>{html.escape(text)}</td>"
