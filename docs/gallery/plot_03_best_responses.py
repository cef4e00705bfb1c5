"""
Best responses fall into an equilibrium
=======================================

Agents join one after the other, and improve their plans in turn. Every improvement lowers the
potential, so the sequence ends; a proved bound on the gain of any further deviation is the
certificate.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import COLOURS
from solvers import best_response_dynamics, certify

game = make_game("circle(8)")
solution = best_response_dynamics(game)
certificate = certify(game, solution.profile)
print("no agent gains more than", certificate.regret.max())

figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
potentials = [update.potential for update in solution.trace]
axes.plot(range(1, len(potentials) + 1), potentials, color="0.6", zorder=0)
for k, update in enumerate(solution.trace, start=1):
    axes.plot(k, update.potential, "o", color=COLOURS[update.agent % len(COLOURS)])
axes.set_xlabel("update; the colour is the agent's")
axes.set_ylabel("potential")
