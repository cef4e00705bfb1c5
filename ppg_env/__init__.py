"""Path planning games: the game as data, its evaluator, its simulation, its environment.

Names are loaded when first used, since some bring Gymnasium along; ``__init__.pyi`` lists them.
"""

import lazy_loader

from ppg_env.env.registration import register_environments
from ppg_env.scenarios.make import scenarios as scenarios  # bound now: a package has this name too

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

register_environments()
