"""`sgnlp solve`: from a point cloud to a folder of grasps."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import count
from math import ceil
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp.cli import codes, compiling, lacks
from sgnlp.cli.flags import Abstaining, Ended, Extending, Observing, Surrounding
from sgnlp.cli.progress import Bar, bars
from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning import confidence, results
from sgnlp.planning.plan import Plan
from sgnlp.planning.reach import OUT_OF_REACH
from sgnlp.planning.solve import solve
from sgnlp.show import tables

MORE = 4
"""Where no grasp is feasible, so many times the starts that were tried are proposed."""


@dataclass(kw_only=True)
class Solve(Abstaining, Ended, Extending, Surrounding, Observing):
    """Plan compliant pregrasps for a point cloud (.npz, .ply, .pcd, .xyz)."""

    file: tyro.conf.Positional[Path]
    """the cloud: z up, metres; an npz holds `points` (N, 3) or one `points_<camera>` array a camera"""
    out: Path | None = None
    """folder of the result; results/NAME if not given"""
    build: bool = True
    """compile the functions behind it, if they are not, for the plans after this one"""
    report: bool = False
    """write report.html and report.md too, as `sgnlp report` does"""
    explain: bool = False
    """say what each energy term and each constraint is"""
    json: bool = False
    """print the summary as JSON and nothing else"""
    quiet: bool = False
    """print nothing but errors"""

    def run(self, console: Console) -> int:
        """Load, plan, save, show."""
        observation = load(self.file, self.reading)
        hand = self.robot
        folder = self.out or Path("results") / observation.name
        results.writable(folder)
        if self.report:
            import_module("sgnlp.show.png").drawable("skimage")
        around = self.surroundings.and_seen(observation).around(self.settings, hand.arm is not None)
        with compiling.behind(hand, self, around) as behind:
            return self._run(console, observation, hand, folder, behind)

    def _run(
        self, console: Console, observation: Observation, hand: Hand, folder: Path, behind: compiling.Behind
    ) -> int:
        show = not (self.json or self.quiet)
        with bars(console, show) as bar:
            plan = self._plan(observation, hand, self._advancing(bar("solving starts", self.starts)))
        outcome = plan.summary()
        results.save(plan.arrays(), outcome, folder, plan.histories(), plan.motion_files())
        pages = []
        if self.report and plan.solutions:
            pages = import_module("sgnlp.cli.report").write(folder, hand=self.hand)  # a second of imports
        if self.json:
            sys.stdout.write(results.json_text(outcome))
        if show:
            made = [results.GRASPS, results.SUMMARY, *results.MOTION[: 1 if plan.motion else 0]]
            _show(console, plan, outcome, [*(folder / name for name in made), *pages], self, behind)
            for caution in outcome["cautions"]:
                console.print(Text.assemble(("caution:", "yellow"), f" {caution}"), soft_wrap=True)
            console.print("\n".join(_next(plan, folder, pages)), style="dim", soft_wrap=True)
        refusal = confidence.refusal(plan.best.confidence, self.min_confidence) if plan.best else ""
        if show and refusal:
            said = f"do not carry the first choice out: {refusal} (--min-confidence {self.min_confidence:g})"
            console.print(Text.assemble(("abstained:", "red"), f" {said}"), soft_wrap=True)
        return codes.FEASIBLE if plan.best and not refusal else codes.NONE_FEASIBLE

    def _advancing(self, bar: Bar) -> Callable[[object], None]:
        """Moves a bar by one start. Its total is that of the rounds that have begun."""
        done = count(1)

        def advance(result: object) -> None:
            number = next(done)
            bar.move(number, self.starts * ceil(number / self.starts))

        return advance

    def _plan(self, observation: Observation, hand: Hand, progress: Callable[[object], None]) -> Plan:
        around = self.surroundings
        return solve(
            observation,
            hand,
            self.settings,
            obstacles=around.obstacles,
            avoid=around.avoid,
            touch=around.touch,
            solver=self.solver,
            extension=self.extension,
            count=self.starts,
            seed=self.seed,
            jobs=self.jobs,
            timeout=self.timeout,
            first=self.first,
            deadline=self.deadline,
            rounds=self.rounds,
            widen=self.widen,
            progress=progress,
        )


def _show(
    console: Console, plan: Plan, summary: dict[str, Any], files: list[Path], asked: Solve, behind: compiling.Behind
) -> None:
    for note in summary["notes"]:
        console.print(note, style="dim", soft_wrap=True)
    for table in tables.tables(plan, summary):
        console.print(table)
        console.print()
    if asked.explain:
        console.print("\n".join((*tables.legend(plan.problem), "")), soft_wrap=True)
    for line in tables.pose_lines(plan, plan.solutions[0]) if plan.solutions else []:
        console.print(line, soft_wrap=True)
    lacks.tell(console)
    behind.told(console)
    if plan.best:
        console.print(confidence.words(plan.best.confidence), soft_wrap=True)
    for line in plan.motion.told() if plan.motion else ():
        console.print(line, soft_wrap=True)
    console.print(tables.headline(plan), soft_wrap=True)
    console.print(f"written: {', '.join(map(str, files))}", soft_wrap=True)


def _next(plan: Plan, folder: Path, pages: Sequence[Path]) -> list[str]:
    """What to do now; `pages` are those of a report that is written already."""
    if plan.best is None:
        return [f"next:  {_remedy(plan)}"]
    known = plan.observation.mesh_vertices is not None
    simulated = "  see whether it holds, in MuJoCo" if known else " --estimated  carry it out, on the estimated surface"
    report = f"{pages[0]}  read about it, in a browser" if pages else f"sgnlp report {folder}    read about it"
    return [
        f"next:  sgnlp view {folder}      look at the grasp",
        f"       {report}",
        f"       sgnlp simulate {folder}{simulated}",
        f"       {folder / results.SUMMARY}  for your robot: joints by name, wrist and targets in the cloud's frame",
        f"       {folder / results.MOTION[2]}  its whole motion for ROS 2; {results.MOTION[3]} is for MoveIt",
    ]


def _remedy(plan: Plan) -> str:
    """What to do where no grasp is feasible."""
    if plan.left:
        return f"a longer --deadline (starts not done: {plan.left}); 'sgnlp cache --build' makes each of them faster"
    if not plan.solutions and all(failure.stopped for failure in plan.failures):
        return f"a longer --timeout: every start was stopped after {plan.timeout:g} s"
    if not plan.solutions and all(failure.reason == OUT_OF_REACH for failure in plan.failures):
        return "move the arm: --arm-base X Y Z; docs/pages/howto/robot.md says what else helps"
    more = f"--starts {MORE * plan.tried} tries more"
    return f"--solver.formulation elastic --no-widen tells by how much constraints are missed; {more}"
