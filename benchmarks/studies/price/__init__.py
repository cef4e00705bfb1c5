"""The study ``price``."""
