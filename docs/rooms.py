"""The rooms of the package and the imports between them, as a picture and as a list; both made from the sources."""

import ast
from collections import Counter
from itertools import product
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "sgnlp"
RIGHT, DOWN = 30, 32
"""From a box to the next [pixel]."""
WIDTH, HEIGHT = 84, 22
"""Of a box [pixel]."""
STEM, RADIUS = 15, 10
"""Where the arrows into a box stand, from its left edge, and the radius of a number's circle [pixel]."""
FRAME = 2
"""Free space around all [pixel]."""


def order() -> tuple[str, ...]:
    """The rooms in the order in which they may import, from the test that holds it."""
    tree = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    (found,) = (node.value for node in tree.body if isinstance(node, ast.Assign) and _target(node) == "ROOMS")
    return tuple(ast.literal_eval(found))


def _target(node: ast.Assign) -> str:
    return ast.unparse(node.targets[0])


def imports() -> Counter[tuple[str, str]]:
    """How many modules are imported from one room into another, each counted once for each module that imports it."""
    counted: Counter[tuple[str, str]] = Counter()
    for room in order():
        for path in (PACKAGE / room).rglob("*.py"):
            counted.update((room, name.split(".")[1]) for name in _imported(path) if name.split(".")[1] != room)
    return counted


def _imported(path: Path) -> set[str]:
    """The package's modules that a module imports, wherever in it, without the package itself."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if _is_module(name) else str(node.module) for name in inner}
    return {name for name in found if name.startswith("sgnlp.")}


def _is_module(name: str) -> bool:
    place = ROOT.joinpath(*name.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


def drawn() -> str:
    """The picture as SVG in the page: boxes on the diagonal, arrows from a box to the boxes above it that it needs."""
    names, counted = order(), imports()
    pairs = [(i, j) for i, j in product(range(len(names)), repeat=2) if counted[names[i], names[j]]]
    width, height = (len(names) - 1) * RIGHT + WIDTH + 2 * FRAME, (len(names) - 1) * DOWN + HEIGHT + 2 * FRAME
    parts = [f'<svg viewBox="{-FRAME} {-FRAME} {width} {height}" role="img" aria-labelledby="rooms">']
    parts.append('<title id="rooms">The rooms in order, and how often each imports from those before it</title>')
    parts += [_row(i, min(j for k, j in pairs if k == i)) for i in {i for i, _ in pairs}]
    parts += [_column(j, max(i for i, k in pairs if k == j)) for j in {j for _, j in pairs}]
    parts += [_number(i, j, counted[names[i], names[j]]) for i, j in pairs]
    parts += [_box(i, name) for i, name in enumerate(names)]
    return '<figure class="rooms">' + "".join(parts) + "</svg></figure>"


def _middle(i: int) -> float:
    return i * DOWN + HEIGHT / 2


def _row(i: int, leftmost: int) -> str:
    """The line from a box to the left, on which the numbers of what it imports stand."""
    return f'<path class="wire" d="M{i * RIGHT} {_middle(i):g}H{leftmost * RIGHT + STEM}"/>'


def _column(j: int, lowest: int) -> str:
    """The line up into a box, from all that import it, with its arrow's head."""
    x, top = j * RIGHT + STEM, j * DOWN + HEIGHT
    return f'<path class="wire" d="M{x} {_middle(lowest):g}V{top}"/><path class="head" d="M{x} {top}l-4 7h8z"/>'


def _number(i: int, j: int, count: int) -> str:
    x, y = j * RIGHT + STEM, _middle(i)
    return f'<circle cx="{x}" cy="{y:g}" r="{RADIUS}"/><text class="count" x="{x}" y="{y:g}">{count}</text>'


def _box(i: int, name: str) -> str:
    x, y = i * RIGHT, i * DOWN
    shape = f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="4"/>'
    return f'{shape}<text class="room" x="{x + WIDTH / 2:g}" y="{_middle(i):g}">{name}</text>'


def described() -> str:
    """What each room says of itself: the docstring of its package, examples as code."""
    return "\n\n".join(f"### {name}\n\n{_paragraphs(name)}" for name in order())


def _paragraphs(name: str) -> str:
    tree = ast.parse((PACKAGE / name / "__init__.py").read_text(encoding="utf-8"))
    blocks = (ast.get_docstring(tree) or "").split("\n\n")
    return "\n\n".join(f"```pycon\n{block}\n```" if block.startswith(">>>") else block for block in blocks)
