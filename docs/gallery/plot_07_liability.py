"""
Who pays for a crash?
=====================

Liability rules change what an agent pays: its own harm, a share of the other's, all of it, or
everything for the agent that has to yield. The equilibria follow.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from solvers import best_response_dynamics

game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
rules = "selfish", "partial:0.5", "pigou", "right-of-way"
plans = {rule: best_response_dynamics(game, charge=rule).evaluation for rule in rules}

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), sharey=True, layout="constrained")
left.barh(rules, [plan.social_cost for plan in plans.values()])
left.set_xlim(left=min(plan.social_cost for plan in plans.values()) - 0.5)
left.set_xlabel("social cost")
right.barh(rules, [plan.risk_sum_any for plan in plans.values()], color="#D55E00")
right.set_xscale("log")
right.set_xlabel("crash probability, at most")
left.invert_yaxis()
