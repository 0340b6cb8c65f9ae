"""The pages of a report: one HTML file that opens offline, and Markdown with a folder of pictures."""

import base64
from collections.abc import Mapping
from html import escape

from sgnlp.show import sheets
from sgnlp.show.report.content import Figure, Report, Section
from sgnlp.show.sheets import Sheet

PICTURES = "report"
"""Folder of the pictures, beside the Markdown."""
TYPES = {"svg": "image/svg+xml", "png": "image/png"}
"""Media types of pictures by suffix, vector graphics first."""
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
"""Makes a phone use its own width instead of shrinking a wide page."""
GROWN = 1.4
"""Largest over least width of a cell of a figure, so that letters keep about one size."""
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 68rem; margin: 2rem auto; padding: 0 1rem;
  overflow-wrap: break-word }
h1, h2 { font-weight: 600; line-height: 1.2 } h2 { margin-top: 2.2rem; border-bottom: 1px solid #ccc }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
caption { text-align: left; font-weight: 600; padding: .3rem 0 } th { border-bottom: 1px solid #888 }
th, td { padding: .15rem .8rem .15rem 0; text-align: right } td { white-space: nowrap }
th:first-child, td:first-child { text-align: left }
.sheets { display: flex; flex-wrap: wrap; gap: 0 3rem } .sheet { overflow-x: auto; max-width: 100%; margin: 1rem 0 }
figure { margin: 1.2rem 0 } img { max-width: 100% } figcaption { color: #444; font-size: 14px }
.cells { display: flex; flex-wrap: wrap; gap: .5rem } .cells img { min-width: 0 }
pre { background: #f2f2f2; padding: .8rem; white-space: pre-wrap; overflow-wrap: anywhere }
@media (max-width: 44rem) { body { margin: 1rem auto } th, td { padding-right: .6rem; font-size: 14px } }
"""


def html(report: Report) -> str:
    """The whole page, without scripts; it loads nothing from elsewhere."""
    body = "\n".join(_html_section(section) for section in report.sections)
    title = escape(report.title)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n{VIEWPORT}\n<title>{title}</title>\n'
        f'<link rel="icon" href="data:,">\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n'
        f"<p>{escape(report.lead)}</p>\n{body}\n</body>\n</html>\n"
    )


def _html_section(section: Section) -> str:
    parts = [f"<h2>{escape(section.title)}</h2>"]
    parts.append(_html_sentences(section.sentences))
    if section.code:
        parts.append(f"<pre>{escape(section.code)}</pre>")
    if section.sheets:
        parts.append('<div class="sheets">' + "\n".join(map(_html_sheet, section.sheets)) + "</div>")
    parts += [_html_figure(figure) for figure in section.figures]
    return "\n".join(parts)


def _html_sentences(sentences: tuple[str, ...]) -> str:
    """One sentence as a paragraph, several as a list."""
    if len(sentences) < 2:
        return "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)
    return "<ul>" + "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) + "</ul>"


def _html_sheet(sheet: Sheet) -> str:
    head, *rows = sheet.rows
    caption = f"<caption>{escape(sheet.title)}</caption>" if sheet.title else ""
    heads = "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>"
    body = ("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="sheet"><table>{caption}{heads if any(head) else ""}{"".join(body)}</table></div>'


def _html_figure(figure: Figure) -> str:
    style = f' style="flex: 1 1 {figure.cell_width}rem; max-width: min(100%, {GROWN * figure.cell_width:g}rem)"'
    images = [_html_image(figure.name, files, style * bool(figure.cells)) for files in figure.cells or (figure.files,)]
    caption = f"<figcaption>{escape(figure.caption)}</figcaption>"
    return f'<figure><div class="cells">{"".join(images)}</div>{caption}</figure>'


def _html_image(name: str, files: Mapping[str, bytes], style: str) -> str:
    suffix = next(suffix for suffix in TYPES if suffix in files)
    data = base64.b64encode(files[suffix]).decode()
    return f'<img{style} alt="{escape(name)}" src="data:{TYPES[suffix]};base64,{data}">'


def markdown(report: Report) -> tuple[str, dict[str, bytes]]:
    """The text, and the pictures that it shows by their paths beside it."""
    parts = [f"# {report.title}", report.lead]
    files: dict[str, bytes] = {}
    for section in report.sections:
        parts.append(f"## {section.title}")
        bullet = "* " * (len(section.sentences) > 1)
        parts += ["\n".join(bullet + sentence for sentence in section.sentences)] if section.sentences else []
        parts += [f"```bash\n{section.code}\n```"] if section.code else []
        for sheet in section.sheets:
            parts += [f"### {sheet.title}"] if sheet.title else []
            parts.append(sheets.markdown(sheet.rows))
        for figure in section.figures:
            files |= {f"{PICTURES}/{figure.name}.{suffix}": content for suffix, content in figure.files.items()}
            parts += [f"![{figure.name}]({PICTURES}/{figure.name}.png)", figure.caption]
    return "\n\n".join(parts) + "\n", files
