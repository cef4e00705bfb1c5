"""The study ``atlas``: its data, its figure, and the study that uses both."""
