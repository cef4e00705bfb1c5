"""Studies, one file each: what is run, what is found, and how it is told."""
