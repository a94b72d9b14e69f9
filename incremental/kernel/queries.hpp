// Questions to the object as a whole.
//
// Theory. The object is the union of the triangles that constriction left. A place is in it if its
// triangle is; on the boundary if it is a vertex of the ring, or lies on an edge between a triangle
// that is left and one that is not (or the outside). All by exact signs.
//
// Cost: that of finding the triangle, O(log n) expected.
#pragma once

#include "constriction.hpp"

namespace flintknap {

// +1 inside, 0 on the boundary, -1 outside.
inline int side(const Triangulation& t, const Constriction& c, Point q, Index start) {
    if (t.is_flat()) return -1;
    const Mesh& m = t.mesh();
    Triangulation::Location found = t.locate(q, start);
    if (found.on_vertex && c.on_ring(m.origin(found.edge))) return 0;
    bool here = c.is_inside(Mesh::triangle(found.edge));
    if (found.on_edge && !found.on_vertex) {
        if (here != c.is_inside(Mesh::triangle(m.twin(found.edge)))) return 0;
    }
    return here ? 1 : -1;
}

}  // namespace flintknap
