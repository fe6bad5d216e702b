"""Periodic motions of a model: one, all of them, and how they change with a value of the model.

A name is imported at its first use (``__init__.pyi``): who asks whether there are other motions at all loads nothing.
"""

from __future__ import annotations

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
