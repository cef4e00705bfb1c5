"""The study ``surrogate``."""
