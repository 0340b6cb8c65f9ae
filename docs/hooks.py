"""What the build of the documentation adds: pages from the root, pages made from the code, formulas as MathML."""

import os
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import reference
from formulas import mathml
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "pages"
FROM_ROOT = {"README.md": "index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md"}
"""Pages that lie beside the package, and where the site has them."""
LINK = re.compile(r"\]\(([^)#:]+)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made and not written, and what pages show or link to beside them."""
    pages = {place: from_root(name) for name, place in FROM_ROOT.items()}
    pages |= {"reference/settings.md": reference.settings(), "reference/commands.md": reference.commands()}
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    for picture in sorted((ROOT / "docs" / "images").iterdir()):
        files.append(File.generated(config, f"images/{picture.name}", abs_src_path=str(picture)))
    for file in sorted(set(linked())):
        files.append(File.generated(config, file.as_posix(), abs_src_path=str(ROOT / file)))
    return files


def linked() -> Iterator[Path]:
    """The files of results/ that pages link to, the pictures on them, and the citation."""
    yield Path("CITATION.cff")
    for page in [ROOT / "README.md", *PAGES.rglob("*.md")]:
        for link in LINK.findall(page.read_text(encoding="utf-8")):
            target = Path(os.path.normpath(page.parent / link)).relative_to(ROOT)
            if target.parts[0] != "results":
                continue
            yield target
            if target.suffix == ".md":
                shown = LINK.findall((ROOT / target).read_text(encoding="utf-8"))
                yield from (target.parent / picture for picture in shown)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Tables and pictures that are made from code and results; links to results at their place in the site."""
    depth = len(Path(page.file.src_uri).parts)
    here, there = f"]({'../' * (depth + 1)}results/", f"]({'../' * (depth - 1)}results/"
    return reference.filled(markdown).replace(here, there)


def on_page_content(html: str, **_: Any) -> str:
    """Formulas as MathML, which browsers draw without a script and without the network."""
    return FORMULA.sub(_mathml, html)


def _mathml(formula: re.Match[str]) -> str:
    return mathml(unescape(formula[2]).strip(), "block" if formula[1] == "div" else "inline")


def from_root(name: str) -> str:
    """A page beside the package, its links those of the site."""
    text = (ROOT / name).read_text(encoding="utf-8")
    for there, here in {"docs/pages/": "", "docs/images/": "images/", "README.md": "index.md"}.items():
        text = text.replace(f"]({there}", f"]({here}")
    return text
