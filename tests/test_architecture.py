"""The shape of the code: imports point one way, only the command line prints, nothing grows too long."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "sgnlp"
ROOMS = (
    "base",
    "perception",
    "surface",
    "hand",
    "control",
    "program",
    "planning",
    "simulation",
    "show",
    "cli",
    "experiments",
)
"""A room may import those before it; `sgnlp/__init__` and `__main__` stand above all."""

MAX_MODULE, MAX_FUNCTION = 300, 40
MODULES = sorted(PACKAGE.rglob("*.py"))
NAMES = [path.relative_to(PACKAGE).as_posix() for path in MODULES]


@cache
def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def dotted(path: Path) -> str:
    """The module's name, sgnlp.program.terms.term."""
    parts = ("sgnlp", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULE_OF = {dotted(path): path for path in MODULES}


@cache
def imported(path: Path) -> frozenset[str]:
    """The modules of the package that a module imports, anywhere in it, by their full names."""
    found = set()
    for node in ast.walk(parse(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name in MODULE_OF}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: relative import"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found |= {inner} & MODULE_OF.keys() or {str(node.module)} & MODULE_OF.keys()
    return frozenset(found)


def room(name: str) -> str:
    """The room of a module: the part after the package's name."""
    return name.split(".")[1]


INSIDE = [path for path in MODULES if path.parent != PACKAGE]


@pytest.mark.parametrize("path", INSIDE, ids=dotted)
def test_imports_point_to_earlier_rooms_only(path):
    own = room(dotted(path))
    for name in imported(path) - {"sgnlp"}:
        assert ROOMS.index(room(name)) <= ROOMS.index(own), f"{dotted(path)} imports {name}"


def test_every_room_is_a_package_and_nothing_lies_outside():
    assert {path.parent.relative_to(PACKAGE).parts[0] for path in INSIDE} == set(ROOMS)
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py"}


def test_there_is_no_cycle_within_a_package_either():
    graph = {dotted(path): imported(path) - {dotted(path)} for path in MODULES if dotted(path) != "sgnlp"}
    TopologicalSorter({name: needed - {"sgnlp"} for name, needed in graph.items()}).prepare()


@pytest.mark.parametrize("path", [p for p in MODULES if "cli" not in p.relative_to(PACKAGE).parts], ids=dotted)
def test_only_the_command_line_prints(path):
    for node in ast.walk(parse(path)):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {"print", "sys.stdout.write", "sys.stderr.write", "input"}, f"line {node.lineno}"


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_no_module_imports_what_is_slow_or_optional_before_it_is_needed(path):
    at_the_top = {name for node in parse(path).body for name in _outside(node)}
    assert not at_the_top & {"open3d", "matplotlib", "mujoco", "pandas", "plotly", "skimage"}
    assert "tyro" not in at_the_top or "cli" in path.relative_to(PACKAGE).parts


def _outside(node: ast.stmt) -> Iterator[str]:
    """The top-level names of other packages that an import statement names."""
    if isinstance(node, ast.Import):
        yield from (alias.name.split(".")[0] for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        yield str(node.module).split(".")[0]


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_no_module_is_longer_than_300_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_MODULE


def lines_of_code(function: ast.FunctionDef) -> int:
    """Lines of the body without its docstring; a record filled in by keywords counts as one line."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    lines = {line for statement in body for line in range(statement.lineno, int(statement.end_lineno or 0) + 1)}
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and node.keywords and not node.args:
            lines -= set(range(node.lineno + 1, int(node.end_lineno or 0) + 1))
    return len(lines)


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_no_function_is_longer_than_40_lines(path):
    for node in ast.walk(parse(path)):
        if isinstance(node, ast.FunctionDef):
            assert lines_of_code(node) <= MAX_FUNCTION, f"{node.name} has {lines_of_code(node)} lines"


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_every_module_says_what_it_is(path):
    assert ast.get_docstring(parse(path)) or not path.read_text(encoding="utf-8")
