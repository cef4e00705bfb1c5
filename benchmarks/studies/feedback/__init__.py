"""The study ``feedback``: its data, its figure, and the study that uses both."""
