"""Compares the simulator and the controllers with recorded runs of the reference simulator.

Every kind of recording has a module that turns the files it finds into cases. What the files
are called and hold is said in ``reference/README.md``.
"""

from experiments.validate.validation import validate

__all__ = ["validate"]
