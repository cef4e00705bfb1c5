"""The reference: the paper's mixed-integer programs through cvxpy and a MILP solver."""
