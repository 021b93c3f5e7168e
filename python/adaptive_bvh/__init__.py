from ._core import __doc__, __version__
from ._core import *
