"""What helps those who take part: the hooks, the public CI and the citation parse and agree with the project."""

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

import sgnlp

ROOT = Path(__file__).parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
LINES = (ROOT / "tests" / "constraints.txt").read_text(encoding="utf-8").splitlines()
PINNED = dict(line.split("==") for line in LINES if not line.startswith("#"))


def parsed(file: str) -> Any:
    return yaml.safe_load((ROOT / file).read_text(encoding="utf-8"))


def test_the_hooks_have_the_versions_of_the_tests():
    ruff, local = parsed(".pre-commit-config.yaml")["repos"]
    assert ruff["rev"] == f"v{PINNED['ruff']}"
    assert [hook["id"] for hook in ruff["hooks"]] == ["ruff-check", "ruff-format"]
    (mypy,) = local["hooks"]
    needed = dict(requirement.split("==") for requirement in mypy["additional_dependencies"])
    assert "mypy" in needed
    assert needed == {name: PINNED[name] for name in needed}


def test_the_public_ci_runs_what_the_project_runs_itself():
    (job,) = parsed(".github/workflows/ci.yml")["jobs"].values()
    assert job["steps"][-1] == {"run": ".ci/run"}
    (python,) = (step["with"]["python-version"] for step in job["steps"] if "setup-python" in step.get("uses", ""))
    assert f"Python {python}" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


def test_the_citation_names_this_version_and_the_paper():
    cited = parsed("CITATION.cff")
    assert {"cff-version", "message", "title", "authors"} <= cited.keys()
    assert cited["cff-version"] == "1.2.0"
    assert cited["version"] == sgnlp.__version__
    assert cited["authors"] == [{"name": "sgnlp developers"}]
    (paper,) = cited["references"]
    assert paper["title"] in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert [author["family-names"] for author in paper["authors"]] == ["Chen", "Bohg", "Liu"]


def test_the_quick_selection_names_tests_that_are_there():
    (command,) = re.findall(r"^pytest (tests/(?:.*\\\n)*.*)", CONTRIBUTING, re.MULTILINE)
    done = subprocess.run(["bash", "-c", f"ls {command}"], cwd=ROOT, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) > 5


@pytest.mark.parametrize("path", re.findall(r"`(sgnlp/[\w/.]+)`", CONTRIBUTING))
def test_the_places_to_add_things_are_there(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize(("name", "place"), re.findall(r"`([A-Z]{5,})` (?:of|in) `(sgnlp/[\w/.]+)`", CONTRIBUTING))
def test_the_tables_to_add_a_line_to_are_there(name, place):
    assert f"{name}" in (ROOT / place).read_text(encoding="utf-8")
