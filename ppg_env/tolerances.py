"""Every judgement number of the project, each with its reason.

Lengths are in the units of the game's positions, margins in units of sqrt(2) sigma,
costs in time steps.
"""

from __future__ import annotations

LENGTH = 1e-6
"""A mean this close to its goal is *at* the goal, and bodies that overlap by less only touch,
for planners, simulation and environment alike.
Ten times HiGHS's loosest feasibility answer on the paper's scenarios, a ten-millionth of a body."""

CONTROL = 1e-7
"""A control may leave its polytope by this much: the back ends' feasibility tolerance."""

DEVIATION = 1e-12
"""A standard deviation below this is no noise at all (t = 0, or an agent without noise)."""

FACE = 1e-9
"""Two facets whose unit normals and offsets differ by less are one face; qhull triangulates
faces of more than three vertices, and every spare facet would cost a binary per time step."""

FLAT = 1e-9
"""A polytope thinner than this, relative to its extent, has no interior."""

SYMMETRY = 1e-9
"""A covariance may miss symmetry, or have an eigenvalue below zero, by this relative amount."""

RADIUS = 1e-12
"""The spectral radius is `1 or more` from 1 - RADIUS on, so that A = I without gain counts."""

IMPROVEMENT = 1e-6
"""A best response that gains less than this has gained nothing: the dynamics stop.  Far above
the back ends' objective error (1e-9), far below what anybody could measure."""

EQUILIBRIUM = 1e-4
"""Dynamics that have settled are called an equilibrium if no certified regret is above this, in
time steps: far above the error of bounds, far below a step."""

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
"""A back end's objective may differ from the evaluator's by this much (relative above 1)."""
