"""All tolerances and size limits of the project, each with its reason.

Lengths are in the unit of the game (:mod:`ppg_env.game.units`), which is that of its positions for
bodies of usual size, margins in units of sqrt(2) sigma, costs in time steps.
"""

from __future__ import annotations

LENGTH = 1e-6
"""A mean this close to its goal has arrived, and bodies that overlap by less only touch, for
planners, simulation and environment alike.
Ten times the loosest feasibility of HiGHS on the paper's scenarios, a ten-millionth of a body."""

CONTROL = 1e-7
"""A control may leave its polytope by this much: the feasibility tolerance of the back ends."""

SMALLEST = 1e-12
"""Least width of a body, an obstacle and a control set, in the user's unit."""

LARGEST = 1e17
"""Largest absolute value of a number in a game, in the user's unit.  Entries of covariances are
bounded by its square, normals of half-planes by its reciprocal from below."""

FARTHEST = 1e8
"""Largest position, control and standard deviation, in the units of the agent.  A double near 1e8
resolves 1.5e-8, a seventh of CONTROL; beyond it, rounding decides instead of the tolerances."""

NARROWEST = 1e-5
"""Least extent of a control set, in the units of the agent, and least margin cap: ten times LENGTH
and AGREEMENT, a hundred times CONTROL.  Below it, the tolerances decide instead of the game."""

HEAVIEST = 1e8
"""Largest crash cost, and largest lam / (1 - lam)."""

GROWTH = 1e25
"""Largest entry of a power of A, and largest standard deviation, within the horizon.  A position
of LARGEST then stays below 1e34, within the float32 of observations."""

DEVIATION = 1e-12
"""A standard deviation below this counts as no noise (t = 0, or an agent without noise)."""

FACE = 1e-9
"""Two facets whose unit normals and offsets differ by less are one face; qhull triangulates
faces of more than three vertices, and every spare facet would cost a binary per time step."""

FLAT = 1e-9
"""A polytope thinner than this, relative to its extent or to its largest coordinate, is flat."""

INSIDE = 1e-6
"""Vertices may lie this deep inside their hull, relative to its extent: points on an edge, written
with six digits, are harmless."""

SYMMETRY = 1e-9
"""A covariance may miss symmetry, or have an eigenvalue below zero, by this relative amount."""

RADIUS = 1e-12
"""A spectral radius of 1 - RADIUS or more counts as 1 or more, so that A = I without gain does."""

IMPROVEMENT = 1e-6
"""A best response that gains less than this gains nothing, and the dynamics stop.  Far above the
objective error of the back ends (1e-9), far below any difference of practical interest."""

EQUILIBRIUM = 1e-4
"""A converged profile is an equilibrium if no certified regret exceeds this, in time steps: far
above the error of the bounds, far below one step."""

REFINEMENT = 1e-7
"""Tangents of the crash-risk curve are added until the model's cost is this close to the exact
one; certificates of 1e-5 then keep two digits in hand."""

MIP_GAP = 1e-9
"""Gap passed to the back ends.  HiGHS's default of 1e-4 fakes best-response improvements."""

FEASIBILITY = 1e-9
"""Primal and integrality tolerance asked of the back ends: a big-M of 100 then leaks 1e-7."""

FLAT_SLOPE = 1e-8
"""Tangents of the crash-risk curve with a smaller slope are dropped: HiGHS zeroes matrix entries
below 1e-9."""

AGREEMENT = 1e-6
"""The objective of a back end may differ from the evaluator's by this much (relative above 1)."""
