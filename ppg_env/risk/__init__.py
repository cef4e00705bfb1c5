"""Crash probabilities: Monte Carlo, rare-event sampling, certified bounds, exact instants."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
