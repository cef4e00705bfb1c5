"""Studies: each has a folder with its data, its figure, and the study that uses both."""
