"""
The price of anarchy, proved
============================

Intervals that hold for all equilibria, found or not: the price of stability (the best
equilibrium's social cost over the optimum's) and of anarchy (the worst one's).
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from solvers import equilibrium_bounds

figure, axes = plt.subplots(figsize=(6.5, 2.6), layout="constrained")
labels = []
for objective in ("margin", "risk"):
    game = make_game("parallel", horizon=10, objective=objective)
    bounds = equilibrium_bounds(game, runs=2, time_limit=10)
    for kind, price in (
        ("stability", bounds.price_of_stability),
        ("anarchy", bounds.price_of_anarchy),
    ):
        axes.plot([price.low, price.high], [len(labels)] * 2, "|-", linewidth=4, markersize=14)
        labels.append(f"{objective}: {kind}")
axes.set_yticks(range(len(labels)), labels)
axes.invert_yaxis()
axes.set_xlabel("price: social cost over the optimum's")
