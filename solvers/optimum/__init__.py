"""Optima of a joint objective: social optimum and potential, bounds, annealing."""
