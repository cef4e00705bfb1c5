"""``ppg certify``: how far a plan is from an equilibrium, with proof."""

from __future__ import annotations

from benchmarks.options import JsonOption, PlanArgument, with_planner_options
from benchmarks.terminal import print_json, print_note, print_table, working
from solvers.planner_options import PlannerOptions


@with_planner_options("charge", "solver", "time_limit", "seed")
def certify(plan: PlanArgument, *, planner: PlannerOptions, as_json: JsonOption = False) -> None:
    """Prove how much each agent of a plan could still gain by changing alone."""
    from benchmarks.comparison.claims import claims_note, different_claims
    from benchmarks.comparison.overlaps import between_steps_note, between_steps_report
    from ppg_env.formats.plan_file import read_plan
    from ppg_env.game.evaluation import evaluate
    from solvers.equilibrium.certificate import certify as prove

    game, profile, stored = read_plan(plan)
    with working(f"best responses to {plan}"):
        proof = prove(
            game,
            profile,
            charge=planner.charge,
            solver=planner.solver,
            time_limit=planner.time_limit,
        )
    if as_json:
        names = ("regret", "epsilon", "cost", "bound")
        report = {name: getattr(proof, name) for name in names}
        claims = different_claims(stored, evaluate(game, profile))
        between = between_steps_report(game, profile)
        print_json(report | {"between_steps": between, "different_claims": claims})
        return
    rows = [
        (name, f"{cost:.6f}", f"{bound:.6f}", f"{regret:.2e}")
        for name, cost, bound, regret in zip(
            game.agent_names, proof.cost, proof.bound, proof.regret, strict=True
        )
    ]
    print_table(
        f"{plan}: an equilibrium within {proof.epsilon:.2e}",
        ("agent", "pays", "could be no less than", "regret at most"),
        rows,
    )
    print_note(between_steps_note(game, {"": profile}))
    print_note(claims_note(stored, evaluate(game, profile)))
