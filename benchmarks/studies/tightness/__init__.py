"""The study ``tightness``."""
