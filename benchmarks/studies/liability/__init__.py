"""The study ``liability``: its data, its figure, and the study that uses both."""
