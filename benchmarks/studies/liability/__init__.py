"""The study ``liability``."""
