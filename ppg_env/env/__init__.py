"""The environment: rules, compiled kernel, simulator, PettingZoo and Gymnasium interfaces."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
