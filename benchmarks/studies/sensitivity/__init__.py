"""The study ``sensitivity``: its data, its figure, and the study that uses both."""
