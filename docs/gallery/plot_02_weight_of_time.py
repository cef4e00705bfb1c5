"""
What haste costs
================

The larger lam, the more an agent weighs its time against its crashes. At some weight the agents
accept a narrow pass. In the equilibrium that weight is lower: no agent pays for the harm to the
other.
"""

import matplotlib.pyplot as plt
import numpy as np

from ppg_env import make_game
from solvers import potential_equilibrium, social_optimum

lams = np.linspace(0.6, 0.95, 8)
risks = {"equilibrium": [], "optimum": []}
for lam in lams:
    game = make_game("head_on", speed="l1", objective="risk", lam=lam)
    risks["equilibrium"].append(potential_equilibrium(game).evaluation.risk_sum_any)
    risks["optimum"].append(social_optimum(game).evaluation.risk_sum_any)

figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
for (name, values), marker in zip(risks.items(), "os", strict=True):
    axes.semilogy(lams, values, marker=marker, label=name)
axes.set_xlabel("lam, the weight of time")
axes.set_ylabel("union bound on the crash probability")
axes.legend()
