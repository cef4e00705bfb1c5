"""``ppg equilibria``: the different equilibria of a game."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    named_game,
    with_game_options,
    with_planner_options,
)
from benchmarks.terminal import bar, no_solution, outward, print_json, print_note, print_table
from solvers.planner_options import DEFAULTS, PlannerOptions

if TYPE_CHECKING:
    from ppg_env.game.evaluation import Evaluation
    from ppg_env.game.game import Game
    from solvers.equilibrium.enumeration import Equilibrium
    from solvers.extremes.bounds_result import EquilibriumBounds


MOST_RUNS = 10_000

PASSING = (
    "\n0<1 left: agents 0 and 1 keep each other on their left while they pass; agents count from 0"
)


@dataclass(frozen=True)
class EquilibriumSet:
    """The kinds of equilibrium of ``game``, by increasing social cost, with their evaluations."""

    game: Game
    runs: int
    kinds: Sequence[Equilibrium]
    evaluations: Sequence[Evaluation]
    bounds: EquilibriumBounds | None = None
    prices: dict[str, Any] | None = None

    @property
    def risks(self) -> list[float]:
        """Bounds on the probability of any crash."""
        return [evaluation.risk_bound_any for evaluation in self.evaluations]

    @property
    def safest(self) -> int:
        """Index of the least risk."""
        return self.risks.index(min(self.risks))

    @property
    def riskiest(self) -> int:
        """Index of the largest risk."""
        return self.risks.index(max(self.risks))


@with_game_options
@with_planner_options("charge", "solver", "time_limit", "seed")
def equilibria(
    game: GameArgument,
    *,
    runs: Annotated[int, typer.Option(min=1, max=MOST_RUNS, help="Runs of the dynamics.")] = 20,
    price: Annotated[
        bool, typer.Option("--price", help="Solve for the optimum; print the price of anarchy.")
    ] = False,
    prove: Annotated[
        bool,
        typer.Option(
            "--prove",
            help="Bound the best and the worst equilibrium; --time-limit (default 300 s) is then "
            "that of the proof, too.",
        ),
    ] = False,
    out: Annotated[
        str | None,
        typer.Option(metavar="STEM", help="Write the plans to STEM-1.json, STEM-2.json, ..."),
    ] = None,
    planner: PlannerOptions,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Collect certified equilibria from many starts and orders; name the best and the worst."""
    from benchmarks.commands.equilibrium_price import price_report
    from benchmarks.commands.proved_equilibria import bound_equilibria
    from ppg_env.errors import require
    from ppg_env.support.atomic_write import check_target
    from solvers.equilibrium.enumeration import collect_equilibria

    instance = named_game(game, overrides)
    if out is not None:
        check_target(f"{out}-1.json", ".json")
    selfish = planner.charge == DEFAULTS["charge"] or not (price or prove)
    require(selfish, "--charge", "has no effect on prices and proofs", "leave it or them out")
    with bar(f"equilibria of {game}", runs) as advance:
        kinds = collect_equilibria(
            instance,
            runs=runs,
            seed=planner.seed,
            charge=planner.charge,
            solver=planner.solver,
            time_limit=planner.time_limit,
            progress=lambda _number: advance(1),
        )
    bounds = bound_equilibria(instance, kinds, planner.time_limit) if prove else None
    kinds = kinds if bounds is None else list(bounds.sampled)
    if not kinds:
        no_solution(f"none of {runs} runs reached an equilibrium; allow more runs or time")
    evaluations = [
        kind.solution.evaluation for kind in kinds if kind.solution.evaluation is not None
    ]
    prices = price_report(instance, evaluations, planner) if price else None
    collection = EquilibriumSet(instance, runs, kinds, evaluations, bounds, prices)
    if out is not None:
        _write(collection, out)
    if as_json:
        print_json(_report(collection))
    else:
        _print(collection)


def _write(collection: EquilibriumSet, stem: str) -> None:
    """Write a plan file per row of the table."""
    from benchmarks.comparison.report import solution_report
    from ppg_env.formats.plan_file import write_plan

    for k, kind in enumerate(collection.kinds):
        if kind.solution.profile is not None:
            path, report = f"{stem}-{k + 1}.json", solution_report(kind.solution)
            write_plan(path, collection.game, kind.solution.profile, report)
            typer.echo(f"wrote {path}: {kind.name}", err=True)


def _report(collection: EquilibriumSet) -> dict[str, Any]:
    from benchmarks.commands.proved_equilibria import proof_report
    from benchmarks.comparison.overlaps import between_steps_report
    from benchmarks.comparison.report import evaluation_report, game_name

    report = {
        "scenario": game_name(collection.game),
        "collisions": collection.game.collisions,
        "runs": collection.runs,
        "equilibria": [
            {
                "name": kind.name,
                "found": kind.found,
                "regret": kind.solution.regret,
                **evaluation_report(evaluation),
                "between_steps": between_steps_report(collection.game, kind.solution.profile),
            }
            for kind, evaluation in zip(collection.kinds, collection.evaluations, strict=True)
            if kind.solution.profile is not None
        ],
        "cheapest": 0,
        "dearest": len(collection.kinds) - 1,
        "safest": collection.safest,
        "riskiest": collection.riskiest,
    }
    proved = {} if collection.bounds is None else {"proved": proof_report(collection.bounds)}
    return report | (collection.prices or {}) | proved


def _print(collection: EquilibriumSet) -> None:
    from benchmarks.commands.equilibrium_price import print_price
    from benchmarks.commands.proved_equilibria import print_proof
    from benchmarks.comparison.overlaps import between_steps_note
    from benchmarks.comparison.report import game_name
    from ppg_env.game.between_steps import overlap_times

    game = collection.game
    labels = _labels(collection)
    rows = [
        (
            kind.name,
            ", ".join(labels.get(k, [])),
            f"{evaluation.social_cost:.4f}",
            outward(evaluation.risk_bound_any, ".2e", up=True),
            " ".join(map(str, evaluation.arrival)),
            ""
            if kind.solution.regret is None
            else outward(float(kind.solution.regret.max()), ".1e", up=True),
            f"{kind.found}",
        )
        for k, (kind, evaluation) in enumerate(
            zip(collection.kinds, collection.evaluations, strict=True)
        )
    ]
    print_table(
        f"{game_name(game)}: kinds of equilibrium reached in {collection.runs} runs",
        ("who passes whom", "", "social cost", "crash risk at most", "arrivals", "regret", "runs"),
        rows,
        f"crash risk, safest, riskiest: by the bound on any overlap {overlap_times(game)}"
        + (PASSING if game.dim == 2 else ""),
        texts=2,
    )
    if collection.prices is not None:
        print_price(collection.prices, collection.runs)
    if collection.bounds is not None:
        print_proof(collection.bounds)
    print_note(
        between_steps_note(game, {kind.name: kind.solution.profile for kind in collection.kinds})
    )


def _labels(collection: EquilibriumSet) -> dict[int, list[str]]:
    """Name the cheapest and costliest, the safest and riskiest, where they differ."""
    from ppg_env import tolerances as tol

    labels: dict[int, list[str]] = {}
    first, last = collection.evaluations[0], collection.evaluations[-1]
    if last.social_cost - first.social_cost > tol.AGREEMENT:
        labels[0], labels[len(collection.kinds) - 1] = ["cheapest"], ["costliest"]
    risks, safest, riskiest = collection.risks, collection.safest, collection.riskiest
    if risks[riskiest] > risks[safest] * (1 + tol.AGREEMENT):
        labels.setdefault(safest, []).append("safest")
        labels.setdefault(riskiest, []).append("riskiest")
    return labels
