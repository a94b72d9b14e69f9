// The gamma-neighbourhood graph on Delaunay edges.
//
// Theory (section 2.1). On each side of a Delaunay edge stands at most one triangle; with phi its
// angle opposite the edge, the side's value is 1 - sin phi if phi <= 90 degrees, sin phi - 1 if
// larger, 1 if there is no triangle. The two values, the smaller magnitude first, are (gamma0,
// gamma1). Since 1 - sin phi = cos^2 phi / (1 + sin phi), no digits cancel near a right angle; the
// sign is that of an exact dot product.
//
// Cost: O(1) an edge; O(n) for all edges of one graph.
#pragma once

#include <cmath>
#include <vector>

#include "triangulation.hpp"

namespace flintknap {

enum class Graph { delaunay, gabriel, hull };

struct Gamma {
    double gamma0, gamma1;
};

// The value of the side on which triangle h / 3 lies, h being a half-edge of it.
inline double gamma_of_side(const Triangulation& t, Index h) {
    const Mesh& m = t.mesh();
    if (m.apex(h) == kGhost) return 1;
    Point i = t.site(m.origin(h)), j = t.site(m.target(h)), k = t.site(m.apex(h));
    double ux = i.x - k.x, uy = i.y - k.y, vx = j.x - k.x, vy = j.y - k.y;
    double lengths = std::sqrt(ux * ux + uy * uy) * std::sqrt(vx * vx + vy * vy);
    double cosine = (ux * vx + uy * vy) / lengths, sine = std::fabs(ux * vy - uy * vx) / lengths;
    return dot_sign(i, j, k) * (cosine * cosine) / (1 + sine);
}

inline Gamma gamma_of_edge(const Triangulation& t, Index h) {
    double here = gamma_of_side(t, h), there = gamma_of_side(t, t.mesh().twin(h));
    // of equal magnitudes the negative one comes first, so that the pair has one name
    if (std::fabs(here) < std::fabs(there) || (here == -there && here < 0)) return {here, there};
    return {there, here};
}

inline bool in_graph(const Triangulation& t, Index h, Graph graph) {
    const Mesh& m = t.mesh();
    Index c = m.apex(h), d = m.apex(m.twin(h));
    auto seen_at_most_right = [&](Index k) {
        return k == kGhost || dot_sign(t.site(m.origin(h)), t.site(m.target(h)), t.site(k)) >= 0;
    };
    switch (graph) {
        case Graph::delaunay: return true;
        case Graph::gabriel: return seen_at_most_right(c) && seen_at_most_right(d);
        case Graph::hull: return c == kGhost || d == kGhost;
    }
    return false;
}

// One half-edge of each edge of the graph. Needs triangles.
inline std::vector<Index> edges_of(const Triangulation& t, Graph graph) {
    const Mesh& m = t.mesh();
    std::vector<Index> edges;
    for (Index h = 0; h < 3 * m.triangles(); ++h) {
        if (h > m.twin(h) || m.origin(h) == kGhost || m.target(h) == kGhost) continue;
        if (in_graph(t, h, graph)) edges.push_back(h);
    }
    return edges;
}

}  // namespace flintknap
