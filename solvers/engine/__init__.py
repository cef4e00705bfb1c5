"""The exact engine: arrival vectors, branch and bound over faces, cuts, presolve."""
