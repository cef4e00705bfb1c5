"""The study ``price``: its data, its figure, and the study that uses both."""
