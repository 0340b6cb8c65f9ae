"""`sgnlp simulate`: tests in simulation whether planned grasps hold the object."""

from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
import tyro
from rich.console import Console

from sgnlp.base.errors import InputError
from sgnlp.base.ranges import BodyMass, Friction
from sgnlp.cli import codes
from sgnlp.cli.flags import made
from sgnlp.cli.progress import bars
from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import PLAIN, Observation, Reading, load
from sgnlp.perception.shape import Shape
from sgnlp.planning import reopen, results
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion.way import Way, way
from sgnlp.planning.surroundings import Surroundings
from sgnlp.show import trials
from sgnlp.show.png import drawable, picture
from sgnlp.show.simulation_pictures import PHASES, ends, scene
from sgnlp.simulation import Outcome, SimulationSettings, command, estimated, execute, plain, true_body
from sgnlp.simulation.prepared import prepared

SIMULATION, PICTURE = "simulation.json", "simulation-{}.png"  # of `results.AFTER`
DEFAULTS = SimulationSettings()


@dataclass(frozen=True)
class Flags(SimulationSettings):
    """Settings as flags. If mass and friction are not given, those of the plan are used."""

    mass: Annotated[float | None, get_args(BodyMass)[1]] = None  # type: ignore[assignment]
    """mass of the object [kg], spread evenly over its volume; if not given, the mass that the plan assumes"""
    friction: Annotated[float | None, get_args(Friction)[1]] = None  # type: ignore[assignment]
    """Coulomb's coefficient of every contact; if not given, the friction that the plan assumes"""


@dataclass
class Simulate:
    """Carry out planned grasps in MuJoCo, on the true object or the estimated one: approach, close, lift, hold, push.
    Needs the extra `sim`."""

    folder: tyro.conf.Positional[Path]
    """a result of `sgnlp solve`"""
    grasps: int | Literal["all"] = 1
    """number of grasps, best first; all: every feasible one"""
    object: Path | None = None
    """file with mesh_vertices and mesh_faces, in the cloud's frame; if not given, the file that was solved"""
    hand: str | None = None
    """folder of the hand, if `sgnlp hands` does not list it"""
    scale: float | None = None
    """factor of that file to metres; if not given, 1, or for the file that was solved what `sgnlp solve` was given"""
    estimated: bool = False
    """take the surface that the plan estimated, where nobody knows the true one: it tests loads and errors of the
    hand's place, not the estimate; needs the extra `view`"""
    true_load: bool = False
    """use the mass and friction in the object's file instead of those that the plan assumes"""
    motion: bool = False
    """let a floating hand follow the planned trajectory from the stand-off to the lift; a hand on an arm always does"""
    pictures: bool = False
    """draw the first grasp at the end of each phase into the folder; needs the extra `view`"""
    settings: Annotated[Flags, tyro.conf.arg(name="")] = field(default_factory=Flags)
    """object, control, joints, contact, phases and judgement"""

    def run(self, console: Console) -> int:
        """Read the result, simulate, write, print."""
        _require_mujoco()
        if self.pictures:
            drawable()
        grasps, hand = reopen.opened(self.folder, self.hand)
        source = reopen.source(grasps, self.folder, self.object)
        seen = self._estimated(grasps, hand) if self.estimated else self._true(grasps, source)
        thing, ranks, (settings, load_words) = true_body(seen), self._ranks(grasps), self._loaded(grasps, seen)
        around, outcomes = self._obstacles(grasps, seen), []
        with bars(console) as bar:
            simulating = bar("simulating", len(ranks))
            for rank in ranks:
                moving = self._motion(grasps, hand, rank)
                outcomes.append(execute(command(grasps, rank), thing, hand, settings, around, moving))
                simulating.advance(outcomes)
        folder = self.folder if self.folder.is_dir() else self.folder.parent
        record = self._made(grasps, source, settings, outcomes)
        _write(folder, record, {})
        other = "" if self.object or self.estimated else reopen.replaced(grasps, self.folder)
        for words in filter(None, (load_words, reopen.changed(grasps, hand), other)):
            console.print(words, soft_wrap=True)
        if self.estimated:
            console.print("on the estimated surface, not the true one: a wrong estimate does not show", soft_wrap=True)
        _show(console, outcomes, hand, grasps)
        console.print(f"written: {folder / SIMULATION}", soft_wrap=True)
        if self.pictures:
            told = prepared(command(grasps, 0), hand, settings, self._motion(grasps, hand, 0))
            title = f"{thing.name}, estimated, grasp 0" if self.estimated else f"{thing.name}, grasp 0"
            shown = scene(told, thing, settings, outcomes[0], title, around)
            drawn = {PICTURE.format(phase): picture(shown, i, 0) for i, phase in enumerate(ends(outcomes[0].trace))}
            _write(folder, record, drawn)
            console.print(f"written: {', '.join(str(folder / name) for name in drawn)}", soft_wrap=True)
        return codes.FEASIBLE if any(outcome.score == 1 for outcome in outcomes) else codes.NONE_FEASIBLE

    def _estimated(self, grasps: Grasps, hand: Hand) -> Observation:
        """The object as the plan estimated it."""
        if self.object or self.true_load:
            raise InputError("--estimated takes neither --object nor --true-load: both need what is true")
        try:
            cloud = reopen.observation(grasps, self.folder)
            return estimated(cloud, reopen.problem(grasps, cloud, hand))
        except InputError as error:
            raise error.within("--estimated needs the surface of the plan") from None

    def _true(self, grasps: Grasps, source: Path) -> Observation:
        """The object with its true surface, from its file."""
        reading = PLAIN if self.object else reopen.reading(grasps.meta)
        scale = reading.scale if self.scale is None else self.scale
        return load(source, Reading(scale=scale, key=reading.key, up=reading.up, pose=reading.pose))

    def _obstacles(self, grasps: Grasps, seen: Observation) -> tuple[Shape, ...]:
        """The obstacles of the plan: those given to it, and those in the cloud that was solved, not in `object`.

        Raises:
            InputError: another object is given, and the solved cloud is missing or has changed.
        """
        given = Surroundings.restored(grasps.meta.get("surroundings", {}))
        solved = reopen.observation(grasps, self.folder) if self.object and grasps.meta.get("input_digest") else seen
        return given.and_seen(solved).obstacles

    def _motion(self, grasps: Grasps, hand: Hand, rank: int) -> Way | None:
        """The motion of a grasp; None if the hand begins at its pregrasp."""
        if not (hand.arm or self.motion):
            return None
        asked = reopen.settings(grasps.meta)
        return way(hand, asked.motion, asked.closing, grasps, rank)

    def _loaded(self, grasps: Grasps, seen: Observation) -> tuple[SimulationSettings, str]:
        """The settings with mass and friction from the flags, the file or the plan, and a line that says which."""
        values, words = asdict(self.settings), []
        for name, text in {"mass": "{:g} kg", "friction": "friction {:g}"}.items():
            value, source = getattr(self.settings, name), "as given"
            if self.true_load and value is not None:
                raise InputError(f"--true-load takes the {name} in the object's file; leave out --{name}")
            if self.true_load:
                value, source = getattr(seen, name), "the object's own"
            elif value is None:
                value, source = getattr(reopen.settings(grasps.meta).contact, name), "as planned for"
            if value is None:
                raise InputError(f"--true-load needs the mass and friction of '{seen.name}' in its file")
            if value == 0:
                value, source = getattr(DEFAULTS, name), f"the plan has no {name}"
            values[name] = value
            words.append(f"{text.format(value)} ({source})")
        return SimulationSettings(**values), f"carried out with {', '.join(words)}"

    def _ranks(self, grasps: Grasps) -> range:
        if not len(grasps):
            raise InputError("the result has no grasps")
        count = int(grasps.feasible.sum()) if self.grasps == "all" else int(self.grasps)
        if count < 1 or len(grasps) < count:
            raise InputError(f"--grasps must be between 1 and {len(grasps)}, or all, which is {grasps.feasible.sum()}")
        return range(count)

    def _made(
        self, grasps: Grasps, source: Path, settings: SimulationSettings, outcomes: list[Outcome]
    ) -> dict[str, Any]:
        rows = [{"rank": rank} | plain(outcome) for rank, outcome in enumerate(outcomes)]
        told = made(object=str(source), estimated=self.estimated, settings=asdict(settings))
        return told | {"plan": grasps.digest, "grasps": rows}


def _write(folder: Path, record: dict[str, Any], drawn: dict[str, bytes]) -> None:
    """Write outcomes and pictures, whose digests they have, and delete older pictures."""
    told = record | {"pictures": {name: sha256(png).hexdigest() for name, png in drawn.items()}}
    pictures = dict.fromkeys(map(PICTURE.format, PHASES)) | drawn
    results.write_files(folder, {SIMULATION: results.encoded(results.json_text(told))} | pictures)


def _require_mujoco() -> None:
    try:
        import mujoco  # noqa: F401
    except ImportError:
        raise InputError("the simulator is not installed: pip install 'sgnlp[sim]'") from None


def _show(console: Console, outcomes: list[Outcome], hand: Hand, grasps: Grasps) -> None:
    console.print(trials.simulation_table(outcomes))
    console.print()
    console.print(trials.touches_table(outcomes[0], hand, np.asarray(grasps.forces_eq[0])))
    console.print()
    for line in (*trials.closing_lines(outcomes[0]), *trials.motion_lines(outcomes[0])):
        console.print(line, soft_wrap=True)
    console.print()
    scores = [outcome.score for outcome in outcomes]
    mean = f"; mean of {len(scores)} grasps: {np.mean(scores):.2f}" if len(scores) > 1 else ""
    console.print(f"score of the first choice: {scores[0]:g}{mean}")
