"""
A game of your own
==================

Agents, bodies and obstacles are data. Here a slow long vehicle and a fast small one share a yard
with an L-shaped wall.
"""

import matplotlib.pyplot as plt

from ppg_env import Agent, Game, Obstacle, Polytope
from ppg_env.plotting import draw_profile
from solvers import potential_equilibrium

long_one = Agent(
    name="truck",
    start=[5, 20],
    goal=[75, 20],
    shape=Polytope.box([14, 6]),
    control=Polytope.box([16, 16]),  # full sides: up to 8 per step and axis
    lam=0.7,
    noise=0.3,
    gain=0.5,
)
small_one = Agent(
    name="scooter",
    start=[45, 55],
    goal=[40, 0],
    shape=Polytope.disc(3),
    control=Polytope.disc(9),
    lam=0.5,
    noise=0.3,
    gain=0.5,
)
wall = [Obstacle(Polytope.from_vertices(v)) for v in (
    [(12, 30), (34, 30), (34, 36), (12, 36)],
    [(28, 36), (34, 36), (34, 50), (28, 50)],
)]  # fmt: skip
game = Game(
    agents=(long_one, small_one), obstacles=wall, horizon=14, objective="risk", collisions="swept"
)
solution = potential_equilibrium(game)

figure, axes = plt.subplots(figsize=(6.5, 4.6), layout="constrained")
draw_profile(axes, game, solution.profile)
axes.set_title(f"{solution.status}: social cost {solution.evaluation.social_cost:.2f}")
