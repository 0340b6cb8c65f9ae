"""`sgnlp cloud` without masks: split a whole scene into clusters, list them, write the chosen ones."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.cli import codes
from sgnlp.perception import scene_files
from sgnlp.perception.observation import world_pose
from sgnlp.perception.scene import Cluster, Scene
from sgnlp.perception.segment import segment
from sgnlp.planning import results
from sgnlp.show.columns import Table
from sgnlp.show.png import drawable

HOW = "choose one by --pick N, --near X Y Z or --pixel U V, or write --all"


@dataclass(frozen=True)
class Choice:
    """Which clusters are written; the only one if nothing is chosen."""

    pick: tuple[int, ...] = ()
    near: tuple[float, float, float] | None = None
    pixel: tuple[int, int] | None = None
    all: bool = False

    def __post_init__(self) -> None:
        """Refuse more than one kind of choice."""
        given = [name for name in ("pick", "near", "pixel", "all") if getattr(self, name) not in (None, False, ())]
        if len(given) > 1:
            raise InputError(f"give one of {' and '.join('--' + name for name in given)}")

    def of(self, scene: Scene) -> list[list[Cluster]]:
        """The clusters of each chosen object. Raises `InputError` if there is no such cluster, or the choice is
        unclear."""
        for number in self.pick:
            if not 1 <= number <= len(scene.clusters):
                raise InputError(f"--pick must be 1 to {len(scene.clusters)}; found {number}")
        if self.pick:
            return [[scene.cluster(number) for number in dict.fromkeys(self.pick)]]
        if self.near is not None:
            return [[scene.nearest(self.near)]]
        if self.pixel is not None:
            return [[scene.at_pixel(*self.pixel)]]
        choices = [[cluster] for cluster in scene.choices]
        if not choices:
            raise InputError(f"no cluster may be an object: {'; '.join(_fault(c) for c in scene.clusters)}; see --pick")
        if len(choices) > 1 and not self.all:
            raise InputError(f"{len(choices)} objects stand on the table: {HOW}")
        return choices


@dataclass(frozen=True)
class Source:
    """The files of a scene, and how they are read."""

    files: tuple[Path, ...]
    cameras: tuple[Path, ...]
    unit: float | None
    key: str | None
    up: str
    pose: tuple[float, ...] | None
    table_height: float | None

    def scene(self) -> Scene:
        """The scene of the files. An error message begins with the path, if there is a single file."""
        pose = world_pose(self.up, self.pose)
        found = scene_files.read(self.files, self.cameras, self.unit, self.key)
        height = self.table_height
        if height is None and pose is None:
            height = found.table_height
        try:
            return segment(found.views, pose=pose, table_height=height, notes=found.notes)
        except InputError as error:
            raise InputError(f"{', '.join(map(str, self.files))}: {error}") from error


def run(console: Console, source: Source, choice: Choice, out: Path, png: Path | None) -> int:
    """Find the clusters, list, draw, write."""
    if png is not None:
        drawable()
        results.writable(png.absolute().parent)
    scene = source.scene()
    for note in scene.notes:
        console.print(note, style="dim", soft_wrap=True)
    console.print(table(scene))
    if png is not None:
        from sgnlp.show.tabletop import picture

        results.write_bytes(png, picture(scene))
        console.print(f"written: {png}", soft_wrap=True)
    chosen = choice.of(scene)
    for parts, file in zip(chosen, _files(out, chosen, choice.all), strict=True):
        arrays = scene.arrays(*(part.number for part in parts))
        name = {"name": np.array(file.stem), "notes": np.array(arrays["notes"], str)}
        results.write_arrays(file, arrays | name)
        numbers = " and ".join(str(part.number) for part in parts)
        marked = "".join(f", though {part.number} {part.fault}" for part in parts if part.fault)
        console.print(f"{file.stem}: cluster {numbers}, {len(arrays['points'])} points{marked}", soft_wrap=True)
        console.print(f"written: {file}", soft_wrap=True)
    return codes.FEASIBLE


def table(scene: Scene) -> Table:
    """The clusters: position in the world, size, and distance from the nearest camera."""
    shown = Table("Clusters, by number of points", "number", "points", "x, y, z [mm]", "size [mm]", "away [mm]", "")
    for cluster in scene.clusters:
        away = "" if cluster.distance is None else f"{1e3 * cluster.distance:.0f}"
        size = " x ".join(f"{1e3 * side:.0f}" for side in cluster.size)
        middle = ", ".join(f"{1e3 * x:.0f}" for x in cluster.centre + 0.0)
        fault = f"no object: it {cluster.fault}" if cluster.fault else ""
        shown.add_row(str(cluster.number), str(len(cluster.points)), middle, size, away, fault)
    return shown


def _fault(cluster: Cluster) -> str:
    return f"{cluster.number} {cluster.fault}"


def _files(out: Path, chosen: list[list[Cluster]], each: bool) -> Iterator[Path]:
    """The file of each chosen object: `out`, or with `each` one file per object in the folder of that name."""
    if not each:
        yield out
        return
    folder = out.with_suffix("")
    results.writable(folder)
    for parts in chosen:
        yield folder / f"{out.stem}_{parts[0].number}.npz"
