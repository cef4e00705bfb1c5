"""Reproduction of the paper: its figures and claims, from the cells of a sweep to verdicts."""
