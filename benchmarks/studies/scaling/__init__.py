"""The study ``scaling``: its data, its figure, and the study that uses both."""
