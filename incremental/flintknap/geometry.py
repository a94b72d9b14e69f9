"""What all polygonal results share: measures, and the formats that other programs read.

A result is one closed polygon: vertices in `xy`, the first not repeated. In all formats it is a
Polygon of one exterior ring that is closed, the first vertex repeated, and runs counter-clockwise
as the vertices do. With fewer than three vertices it is an empty Polygon.

Coordinates leave as they are: every format holds them bit for bit, and none names a coordinate
system, for nobody told one. (`docs/formats.md`: what to do about longitude and latitude.)

Cost: O(n) each. shapely and matplotlib are imported where they are asked for, and are all that may
not be there.
"""

from __future__ import annotations

import struct
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType
    from numpy.typing import DTypeLike, NDArray
    from shapely import Polygon

LITTLE_ENDIAN, WKB_POLYGON = 1, 3


class Polygonal:
    """A result with vertices ``xy``, float64 (n, 2), of a closed polygon.

    Goes wherever a geometry or an array is expected: shapely.geometry.shape(result) and geopandas
    read its ``__geo_interface__``, numpy.asarray(result) is its vertices.
    """

    xy: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.xy)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.xy, dtype=dtype, copy=copy)

    @cached_property
    def area(self) -> float:
        """Area of the object, in square units. O(n) once."""
        if len(self.xy) == 0:
            return 0.0
        x, y = (self.xy - self.xy[0]).T  # near the ring, fewer digits cancel
        return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2

    @cached_property
    def length(self) -> float:
        """Length of the boundary, in units. O(n) once."""
        step = np.roll(self.xy, -1, axis=0) - self.xy
        return float(np.sum(np.hypot(step[:, 0], step[:, 1])))

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        ring = [tuple(p) for p in self._ring().tolist()]
        return {"type": "Polygon", "coordinates": [ring] if ring else []}

    def to_geojson(self) -> str:
        """Return a GeoJSON geometry. Numbers read back bit for bit. O(n)."""
        import msgspec

        return msgspec.json.encode(self.__geo_interface__).decode()

    def to_wkt(self) -> str:
        """Return well-known text. Numbers read back bit for bit. O(n)."""
        ring = ", ".join(f"{x!r} {y!r}" for x, y in self._ring().tolist())
        return f"POLYGON (({ring}))" if ring else "POLYGON EMPTY"

    def to_wkb(self) -> bytes:
        """Return well-known binary, little-endian. O(n)."""
        ring = self._ring()
        head = struct.pack("<BI", LITTLE_ENDIAN, WKB_POLYGON)
        if len(ring) == 0:
            return head + struct.pack("<I", 0)
        return head + struct.pack("<II", 1, len(ring)) + ring.astype("<f8").tobytes()

    def to_shapely(self) -> Polygon:
        """Return a shapely Polygon, without a detour by Python's numbers. O(n).

        Raises ImportError where shapely is not installed: `pip install 'flintknap[shapely]'`.
        """
        import shapely

        ring = self._ring()
        rings = [0, len(ring)] if len(ring) else [0]
        (polygon,) = shapely.from_ragged_array(
            shapely.GeometryType.POLYGON, ring, (np.array(rings), np.array([0, len(rings) - 1]))
        )
        return polygon

    def plot(
        self, ax: Axes | None = None, *, color: ColorType | None = None, label: str | None = None
    ) -> Axes:
        """Draw the polygon on axes of matplotlib, pyplot's current ones if none, and return them.

        Lines and colours suit the axes' background, light or dark; ``color`` takes their place,
        ``label`` goes to the legend. Axes get equal scales. O(n).

        Raises ImportError where matplotlib is not installed: `pip install 'flintknap[plot]'`.
        """
        from flintknap import picture, plot

        return plot.plot(ax, [picture.Mark("area", picture.Polygon(self.xy))], color, label)

    def _ring(self) -> NDArray[np.float64]:
        """Return the vertices with the first one repeated; none if there is no polygon."""
        if len(self.xy) < 3:
            return np.zeros((0, 2))
        return np.concatenate([self.xy, self.xy[:1]])
