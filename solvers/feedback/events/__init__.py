"""Exact probabilities of crashes in one step."""
