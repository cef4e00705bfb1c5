"""The study ``learned``."""
