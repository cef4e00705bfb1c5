"""``ppg certify``: how far a plan is from an equilibrium, with proof."""

from __future__ import annotations

from benchmarks.options import (
    ChargeOption,
    JsonOption,
    PlanArgument,
    SeedOption,
    SolverOption,
    TimeLimitOption,
)
from benchmarks.terminal import print_json, print_table, working


def certify(
    plan: PlanArgument,
    charge: ChargeOption = "selfish",
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Prove how much each agent of a plan could still gain by changing alone."""
    from ppg_env.formats.plan_file import read_plan
    from solvers.equilibrium.certificate import certify as prove

    game, profile, _ = read_plan(plan)
    with working(f"best responses to {plan}"):
        proof = prove(game, profile, charge=charge, solver=solver, time_limit=time_limit)
    if as_json:
        print_json(
            {
                "regret": proof.regret,
                "epsilon": proof.epsilon,
                "cost": proof.cost,
                "bound": proof.bound,
            }
        )
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
