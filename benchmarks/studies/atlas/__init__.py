"""The study ``atlas``."""
