"""The study ``learned``: its data, its figure, and the study that uses both."""
