"""Experiments, reports, and the command ``ppg``."""
