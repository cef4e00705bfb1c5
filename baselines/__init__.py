"""Learned players: train them, load them, play them, and bound their regret.

Names are loaded when first used: training needs the extra ``rl`` (stable-baselines3, torch),
playing does not.  ``__init__.pyi`` lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
