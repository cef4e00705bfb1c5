"""Proved lower bounds on the expected cost of any players."""
