"""What the build of the documentation adds: the front page, the pages made from the code, formulas as MathML."""

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import reference
from formulas import mathml
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"\]\(([^)#:]+)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made and not written, and what the README shows or links to beside them."""
    pages = {
        "index.md": front_page(),
        "reference/settings.md": reference.settings(),
        "reference/commands.md": reference.commands(),
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    for picture in sorted((ROOT / "docs" / "images").iterdir()):
        files.append(File.generated(config, f"images/{picture.name}", abs_src_path=str(picture)))
    for result in sorted(results()):
        files.append(File.generated(config, result.as_posix(), abs_src_path=str(ROOT / result)))
    return files


def results() -> Iterator[Path]:
    """The pages of results that the README links to and the pictures on them, at the places that they have there."""
    for link in set(LINK.findall((ROOT / "README.md").read_text(encoding="utf-8"))):
        if link.startswith("results/"):
            page = Path(link)
            yield page
            yield from {page.parent / shown for shown in LINK.findall((ROOT / page).read_text(encoding="utf-8"))}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Tables that are made from the code."""
    return reference.filled(markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Formulas as MathML, which browsers draw without a script and without the network."""
    return FORMULA.sub(_mathml, html)


def _mathml(formula: re.Match[str]) -> str:
    return mathml(unescape(formula[2]).strip(), "block" if formula[1] == "div" else "inline")


def front_page() -> str:
    """The README, its links those of the site."""
    return (
        (ROOT / "README.md")
        .read_text(encoding="utf-8")
        .replace("](docs/pages/", "](")
        .replace("](docs/images/", "](images/")
    )
