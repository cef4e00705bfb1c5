"""Suites of ``ppg bench``."""
