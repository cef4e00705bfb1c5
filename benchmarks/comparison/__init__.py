"""Comparison of players in one game."""
