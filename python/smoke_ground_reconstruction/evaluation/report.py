"""One self-contained HTML page of an evaluation: tables and figures, nothing from outside."""

import base64
import io
from html import escape

STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 1150px; margin: 2em auto; padding: 0 1em;
       color: #1d2529; }
h1 { font-size: 1.6em; } h2 { font-size: 1.25em; margin-top: 2em; }
table { border-collapse: collapse; font-size: 13px; margin: .5em 0; }
caption { text-align: left; font-weight: bold; padding: .3em 0; }
th, td { border: 1px solid #cfd8dc; padding: .2em .5em; text-align: right; white-space: nowrap; }
th:first-child, td:first-child, td:nth-child(2), td:nth-child(3) { text-align: left; }
th { background: #eceff1; } tr:nth-child(even) td { background: #fafbfc; }
.note { color: #546e7a; font-size: 13px; } .scroll { overflow-x: auto; }
img { max-width: 100%; } summary { cursor: pointer; }
"""


def page(title, sections):
    """The whole page.

    Args:
        title: of the page, text.
        sections: pairs of a heading and HTML.
    """
    body = "\n".join(f"<h2>{escape(heading)}</h2>\n{html}" for heading, html in sections)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}'
        f"</title><style>{STYLE}</style></head>\n<body><h1>{escape(title)}</h1>\n{body}\n"
        "</body></html>\n"
    )


def table_html(table):
    """A tables.Table as HTML."""
    head = "".join(f"<th>{escape(name)}</th>" for name in table.columns)
    rows = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return (
        f'<div class="scroll"><table><caption>{escape(table.title)}</caption>'
        f"<tr>{head}</tr>\n{rows}</table></div>{note}"
    )


def details(summary, html):
    """A part that is folded away until it is clicked."""
    return f"<details><summary>{escape(summary)}</summary>{html}</details>"


def paragraph(text):
    return f"<p>{escape(text)}</p>"


def figure_html(figure, caption):
    """A matplotlib figure, embedded as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
