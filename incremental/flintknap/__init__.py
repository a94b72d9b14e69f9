"""Live object boundaries from streams of points.

After R. C. Veltkamp, 2D Computational Morphology (1993), made incremental: points on the boundary
of a planar object arrive in no known order; at any moment the engine serves a simple polygon
through them, exact point-in-object answers and the gamma-graph behind them.
"""

from flintknap import reference
from flintknap._kernel import MAX_MAGNITUDE, MIN_MAGNITUDE
from flintknap.boundary import Boundary
from flintknap.collision import Crossings, Hit, Nearest
from flintknap.engine import Engine
from flintknap.errors import InputError, InvariantError, LogError
from flintknap.scene import Scene
from flintknap.snapshot import load, save
from flintknap.window import Window

__all__ = [
    "MAX_MAGNITUDE",
    "MIN_MAGNITUDE",
    "Boundary",
    "Crossings",
    "Engine",
    "Hit",
    "InputError",
    "InvariantError",
    "LogError",
    "Nearest",
    "Scene",
    "Window",
    "load",
    "reference",
    "save",
]
