"""Made-up hands: copies of the one with three fingers in which something is replaced."""

import shutil
from pathlib import Path

THREE = Path(__file__).parent / "golden" / "three_fingers"
BENT = '<axis xyz="0 0.8 0.6"/>'
MULTIPLIER, OFFSET = -0.5, 0.2


def changed(target: Path, name: str, *changes: tuple[str, str]) -> Path:
    """A copy of the made-up hand in which the first of each `old` in a file is replaced."""
    folder = target / "hand"
    if not folder.is_dir():
        shutil.copytree(THREE, folder)
    text = (folder / name).read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def coupled(target: Path) -> Path:
    """The made-up hand, with the last joint of finger b at 0.2 - 0.5 q, q of the bending joint of finger a."""
    mimic = f'{BENT}<mimic joint="a_bend" multiplier="{MULTIPLIER}" offset="{OFFSET}"/>'
    changed(target, "hand.urdf", (BENT, mimic))
    return changed(target, "hand.yaml", (", b_curl: 0.3", ""))
