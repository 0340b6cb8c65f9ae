"""Made-up hands: copies of the one with three fingers in which something is replaced."""

import shutil
from pathlib import Path

import pytest

from sgnlp.base.errors import NotInstalledError
from sgnlp.hand.hand import Hand, load_hand

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


def installed(name: str) -> Hand:
    """A hand of the package; the test is skipped where what describes it is not installed."""
    try:
        return load_hand(name)
    except NotInstalledError as error:
        pytest.skip(str(error))


def weighed(folder: Path) -> Path:
    """A copy of the made-up hand in which each link weighs something else, its centre beside its joint."""
    file = folder / "hand.urdf"
    links = file.read_text(encoding="utf-8").split('<link name="')
    for i in range(1, len(links)):
        name, rest = links[i].split('"/>', 1)
        place = f'<origin xyz="{0.001 * i} {-0.002 * i} 0.02"/>'
        inertia = '<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/>'
        links[i] = f'{name}"><inertial>{place}<mass value="{0.01 * i}"/>{inertia}</inertial></link>{rest}'
    file.write_text('<link name="'.join(links), encoding="utf-8")
    return folder
