"""
When do they crash?
===================

The exact probability of an overlap at each time step, and the share of simulated episodes that
overlap then.
"""

import matplotlib.pyplot as plt
import numpy as np

from ppg_env import make_game
from ppg_env.risk import crash_counts, risk_bounds
from solvers import potential_equilibrium

game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
profile = potential_equilibrium(game).profile
exact = np.exp(risk_bounds(game, profile).log_instants)
counts = crash_counts(game, profile, samples=100_000, seed=1)

figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
for encounter, line, times in zip(game.encounters, exact, counts.times, strict=True):
    i, j = encounter.agents
    (drawn,) = axes.plot(line, label=f"agents {i} and {j}")
    axes.plot(times / counts.samples, "o", color=drawn.get_color())
axes.set_xlabel("time step")
axes.set_ylabel("overlap probability")
axes.legend(title="line: exact, dots: counted")
