// The gamma-neighbourhood graph on Delaunay edges.
//
// Theory (section 2.1). On each side of a Delaunay edge stands at most one triangle; with phi its
// angle opposite the edge, the side's value is 1 - sin phi if phi <= 90 degrees, sin phi - 1 if
// larger, 1 if there is no triangle. In terms of the cotangent, which is correctly rounded,
// 1 - sin phi = cot^2 / (csc (1 + csc)) with csc^2 = 1 + cot^2: no digits cancel, and the sign is
// exact. The two angles of an edge sum to 180 degrees at most, so only the value of smaller
// magnitude can be negative: sorted, the two are (gamma0, gamma1).
//
// Cost: O(1) an edge; O(n) for all edges of one graph.
#pragma once

#include <algorithm>
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
    double cot = cotangent(t.site(m.origin(h)), t.site(m.target(h)), t.site(m.apex(h)));
    double csc = std::hypot(1.0, cot);
    return (cot / csc) * (std::fabs(cot) / (1 + csc));
}

inline Gamma gamma_of_edge(const Triangulation& t, Index h) {
    auto [gamma0, gamma1] = std::minmax({gamma_of_side(t, h), gamma_of_side(t, t.mesh().twin(h))});
    return {gamma0, gamma1};
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
        if (m.is_free(Mesh::triangle(h)) || h > m.twin(h)) continue;
        if (m.origin(h) == kGhost || m.target(h) == kGhost) continue;
        if (in_graph(t, h, graph)) edges.push_back(h);
    }
    return edges;
}

}  // namespace flintknap
