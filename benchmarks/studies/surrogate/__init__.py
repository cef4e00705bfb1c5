"""The study ``surrogate``: its data, its figure, and the study that uses both."""
