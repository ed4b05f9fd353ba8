from . import _dynains
from ._dynains import *  # noqa: F403
from ._dynains import __version__  # noqa: F401
from ._page import View, view  # noqa: F401

__doc__ = _dynains.__doc__
