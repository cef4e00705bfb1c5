"""``python -m benchmarks`` is ``ppg``."""

from benchmarks.cli import main

main()
