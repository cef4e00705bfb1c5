"""Planners: best responses, Nash equilibria, social optima, and certificates.

Names are loaded on first use, because cvxpy takes a second to import; ``__init__.pyi`` lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
