"""The shape of the code: imports point one way, only the command line prints, nothing grows too long."""

import ast
import importlib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

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


def test_imports_point_to_earlier_rooms_only():
    pairs = [(dotted(path), name) for path in INSIDE for name in imported(path) - {"sgnlp"}]
    assert len(pairs) > len(INSIDE)
    assert not [(own, name) for own, name in pairs if ROOMS.index(room(name)) > ROOMS.index(room(own))]


def test_the_rooms_of_the_picture_are_those_of_the_code(monkeypatch):
    """The picture of the documentation counts the imports that the test of the architecture sees."""
    monkeypatch.syspath_prepend(str(PACKAGE.parent / "docs"))
    rooms = importlib.import_module("rooms")
    seen = [(room(dotted(path)), room(name)) for path in INSIDE for name in imported(path) - {"sgnlp"}]
    assert rooms.order() == ROOMS
    assert dict(rooms.imports()) == {(a, b): seen.count((a, b)) for a, b in seen if a != b}


def test_every_room_is_a_package_and_nothing_lies_outside():
    assert {path.parent.relative_to(PACKAGE).parts[0] for path in INSIDE} == set(ROOMS)
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py"}


def test_there_is_no_cycle_within_a_package_either():
    graph = {dotted(path): imported(path) - {dotted(path)} for path in MODULES if dotted(path) != "sgnlp"}
    TopologicalSorter({name: needed - {"sgnlp"} for name, needed in graph.items()}).prepare()


def test_only_the_command_line_prints():
    quiet = [path for path in MODULES if "cli" not in path.relative_to(PACKAGE).parts]
    calls = [(path, node) for path in quiet for node in ast.walk(parse(path)) if isinstance(node, ast.Call)]
    assert len(calls) > len(quiet)
    printing = {"print", "sys.stdout.write", "sys.stderr.write", "input"}
    assert not [(dotted(path), node.lineno) for path, node in calls if ast.unparse(node.func) in printing]


def test_no_module_imports_what_is_slow_or_optional_before_it_is_needed():
    at_the_top = [(path, name) for path in MODULES for node in parse(path).body for name in _outside(node)]
    slow = {"open3d", "matplotlib", "mujoco", "pandas", "plotly", "skimage"}
    assert not [(dotted(path), name) for path, name in at_the_top if name in slow]
    assert all("cli" in path.relative_to(PACKAGE).parts for path, name in at_the_top if name == "tyro")


def _outside(node: ast.stmt) -> Iterator[str]:
    """The top-level names of other packages that an import statement names."""
    if isinstance(node, ast.Import):
        yield from (alias.name.split(".")[0] for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        yield str(node.module).split(".")[0]


def test_no_module_is_longer_than_300_lines():
    lengths = {dotted(path): len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    assert not {name: length for name, length in lengths.items() if length > MAX_MODULE}


def lines_of_code(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of the body without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return len({line for part in body for line in range(part.lineno, int(part.end_lineno or 0) + 1)})


def test_no_function_is_longer_than_40_lines():
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    found = [(path, node) for path in MODULES for node in ast.walk(parse(path)) if isinstance(node, kinds)]
    lengths = {(dotted(path), node.name): lines_of_code(node) for path, node in found}
    assert max(lengths.values()) > MAX_FUNCTION / 2
    assert not {name: length for name, length in lengths.items() if length > MAX_FUNCTION}


def test_every_module_says_what_it_is():
    silent = [path for path in MODULES if not ast.get_docstring(parse(path))]
    assert not [dotted(path) for path in silent if path.read_text(encoding="utf-8")]
