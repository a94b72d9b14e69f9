"""Boundaries of objects for other programs: one GeoJSON text for all.

Takes objects by name, such as `Replay.engines`. Every coordinate is held exactly: numbers read back
bit for bit. They are those that went in, on whatever plane that was; RFC 7946 would have them be
longitude and latitude. Equal sets of points give equal text, whatever their history.

A degenerate object has no polygon: its geometry is null.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flintknap.engine import Engine


def geojson(objects: Mapping[str, Engine]) -> str:
    """Return a FeatureCollection: a Feature for each object, a counter-clockwise Polygon each.

    Properties: "object", "status", "points" (distinct), "inside" (how many) and "digest".
    """
    features = []
    for name, engine in objects.items():
        boundary = engine.boundary()
        properties = {
            "object": name,
            "status": boundary.status,
            "points": len(engine),
            "inside": len(boundary.inside),
            "digest": engine.digest(),
        }
        geometry = boundary.__geo_interface__ if len(boundary) else None
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    return msgspec.json.encode({"type": "FeatureCollection", "features": features}).decode() + "\n"
