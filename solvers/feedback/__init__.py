"""Policies that observe the state while they play."""
