"""The documentation: the site is built strictly, needs no network, and its reference is that of the code."""

import importlib
import os
import re
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest
from browser import FLAT, loaded, needs_a_browser

import sgnlp
from sgnlp.base.settings import Settings
from sgnlp.cli import COMMANDS
from sgnlp.control import Command
from sgnlp.planning.grasps import Grasps
from sgnlp.program.constraints import CONSTRAINTS
from sgnlp.program.terms import CLOSURE, COMPLIANT

for module in ("latex2mathml", "material", "mkdocstrings"):
    pytest.importorskip(module, reason="the site is built with the extra docs", exc_type=ImportError)

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs" / "pages").rglob("*.md"))
LINK = re.compile(r"\]\((?!https?:)([^)#]+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The folder of the site, built with warnings as errors."""
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        ROOT / "docs" / "mkdocs.yml",
        "-d",
        folder,
    ]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_every_page_is_built_and_in_the_navigation(site):
    front = (site / "index.html").read_text(encoding="utf-8")
    for page in PAGES:
        place = page.relative_to(ROOT / "docs" / "pages").with_suffix(".html").as_posix()
        assert (site / place).is_file()
        assert f'href="{place}"' in front, f"{place} is not in the navigation"


def test_no_page_loads_anything_from_the_network(site):
    for page in site.rglob("*.html"):
        loaded = re.findall(
            r"<(?:script|img|iframe)[^>]* src=\"([^\"]+)|<link[^>]* rel=\"?stylesheet[^>]*",
            page.read_text(encoding="utf-8"),
        )
        assert not [source for source in loaded if source.startswith(("http:", "https:", "//"))], page


@needs_a_browser
def test_the_site_is_searched_from_a_folder(site, tmp_path):
    page = (site / "theory" / "grasp.html").as_uri()
    for words, found in (("mumps", {"howto/solver.html"}), ("qqq", set())):
        elements, told = loaded(f"{page}?q={words}", tmp_path, *FLAT, "--virtual-time-budget=30000")
        links = re.findall(r'<a href="([^"?#]+)[^"]*" class="md-search-result__link', elements)
        assert {link.removeprefix(f"{site.as_uri()}/") for link in links} >= found
        assert bool(links) == bool(found)
        assert not told


def test_every_formula_is_drawn(site):
    """As MathML, and without a command of TeX that the converter does not know."""
    text = (site / "theory" / "grasp.html").read_text(encoding="utf-8")
    assert text.count("<math") > 50
    for page in site.rglob("*.html"):
        for formula in re.findall(r"<math.*?</math>", page.read_text(encoding="utf-8"), re.DOTALL):
            assert "\\" not in formula, f"{page.name}: {formula}"
        text = re.sub(r"<(pre|code|script|math).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert "arithmatex" not in text, page
        assert not re.search(r"\\(?:sum|mathbf|left|frac)", text), page


def test_the_reference_has_every_setting_command_and_array(site):
    settings = (site / "reference" / "settings.html").read_text(encoding="utf-8")
    chosen = Settings()
    for section in fields(chosen):
        group = getattr(chosen, section.name)
        names = [f"{section.name}.{f.name}" for f in fields(group)] if is_dataclass(group) else [section.name]
        assert not [name for name in names if f"<code>--{name.replace('_', '-')}</code>" not in settings]
    commands = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    assert all(f"usage: sgnlp {name} " in commands for name in COMMANDS)
    assert not re.search(r"--[a-z-]+\.[a-z]", commands), "the settings have a page of their own"
    files = (site / "reference" / "files.html").read_text(encoding="utf-8")
    assert all(f"<code>{f.name}</code>" in files for f in fields(Grasps))


def test_the_page_of_python_has_every_name_that_is_exported_and_no_other():
    page = (ROOT / "docs" / "pages" / "reference" / "python.md").read_text(encoding="utf-8")
    shown = re.findall(r"^::: sgnlp\.(\w+)$", page, re.MULTILINE)
    assert sorted(shown) == sorted(sgnlp.__all__)
    assert "::: sgnlp.simulation.SimulationSettings\n" in page


def test_the_page_of_python_has_every_field_of_a_grasp_and_an_observation_with_its_shape_or_meaning(site):
    page = (site / "reference" / "python.html").read_text(encoding="utf-8")
    for kind in (sgnlp.Grasp, sgnlp.Observation, Command):
        for field in fields(kind):
            row = rf"<tr>\s*<td><code>{field.name}</code></td>\s*<td>([^\n]*)</td>\s*</tr>"
            said = re.findall(row, page)
            assert said, field.name
            assert all(said) or field.name == "name", field.name


def test_a_comment_behind_a_field_or_above_it_is_its_meaning(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    rows = importlib.import_module("reference").record("sgnlp.program.grasp.Grasp")
    assert "| `tips` | (m, 3) [m], a_i |" in rows
    assert "| `obstacle_clearances` | (S,) [m], of every sphere from obstacles;" in rows


def test_the_theory_names_every_term_and_constraint():
    theory = ROOT / "docs" / "pages" / "theory"
    energy, program = (
        (theory / "energy.md").read_text(encoding="utf-8"),
        (theory / "program.md").read_text(encoding="utf-8"),
    )
    assert not [term.name for term in (*COMPLIANT, *CLOSURE) if f"`{term.name}`" not in energy]
    assert not [constraint.name for constraint in CONSTRAINTS if f"`{constraint.name}`" not in program]


def test_the_picture_of_the_rooms_is_on_the_page_of_the_code(site):
    page = (site / "reference" / "code.html").read_text(encoding="utf-8")
    (picture,) = re.findall(r'<figure class="rooms"><svg.*?</svg></figure>', page, re.DOTALL)
    for room in ("base", "perception", "program", "planning", "experiments"):
        assert f">{room}</text>" in picture
        assert f'id="{room}"' in page


def test_a_table_is_copied_by_the_title_above_it(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    reference = importlib.import_module("reference")
    monkeypatch.setattr(reference, "ROOT", tmp_path)
    text = (
        "## One, of two\n\n| a |\n| --- |\n| 1 |\n\n## Two\n\nWords.\n\n| b | c |\n| --- | --- |\n| 2 | - |\n\nMore.\n"
    )
    (tmp_path / "t.md").write_text(text, encoding="utf-8")
    assert reference.filled("<!-- table: t.md -->") == "| a |\n| --- |\n| 1 |"
    assert reference.filled("x\n<!-- table: t.md | Two -->\ny") == "x\n| b |\n| --- |\n| 2 |\ny"
    with pytest.raises(ValueError, match="no table 'Three'"):
        reference.filled("<!-- table: t.md | Three -->")


WRITTEN = [*(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")), *PAGES]


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.stem)
def test_no_link_between_pages_is_broken(page):
    made = {"settings.md", "commands.md", "index.md", "can.jpg", "scene.jpg", "hands.jpg"}
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists() or Path(target).name in made, target
