"""Live object boundaries from streams of points.

After R. C. Veltkamp, 2D Computational Morphology (1993), made incremental: points on the boundary
of a planar object arrive in no known order; at any moment the engine serves a simple polygon
through them, exact point-in-object answers and the gamma-graph behind them.

Each name is imported when it is first used: `import flintknap` and `flintknap --help` are quick.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flintknap import reference
    from flintknap._kernel import MAX_MAGNITUDE, MIN_MAGNITUDE
    from flintknap.boundary import Boundary
    from flintknap.changes import Changes
    from flintknap.collision import Bounds, Crossings, Held, Hit, Nearest
    from flintknap.engine import Engine
    from flintknap.errors import InputError, InvariantError, LogError
    from flintknap.flintstones import Approximation, Flintstones
    from flintknap.scene import Scene
    from flintknap.smooth import BezierCurve
    from flintknap.snapshot import load
    from flintknap.window import Window

__all__ = [
    "MAX_MAGNITUDE",
    "MIN_MAGNITUDE",
    "Approximation",
    "BezierCurve",
    "Boundary",
    "Bounds",
    "Changes",
    "Crossings",
    "Engine",
    "Flintstones",
    "Held",
    "Hit",
    "InputError",
    "InvariantError",
    "LogError",
    "Nearest",
    "Scene",
    "Window",
    "load",
    "reference",
]

_ROOMS = {
    "boundary": ["Boundary"],
    "changes": ["Changes"],
    "collision": ["Bounds", "Crossings", "Held", "Hit", "Nearest"],
    "engine": ["Engine"],
    "errors": ["InputError", "InvariantError", "LogError"],
    "flintstones": ["Approximation", "Flintstones"],
    "_kernel": ["MAX_MAGNITUDE", "MIN_MAGNITUDE"],
    "scene": ["Scene"],
    "smooth": ["BezierCurve"],
    "snapshot": ["load"],
    "window": ["Window"],
}


def __getattr__(name: str) -> Any:
    if name == "reference":
        return import_module("flintknap.reference")
    for room, names in _ROOMS.items():
        if name in names:
            value = getattr(import_module(f"flintknap.{room}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
