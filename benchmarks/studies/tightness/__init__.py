"""The study ``tightness``: its data, its figure, and the study that uses both."""
