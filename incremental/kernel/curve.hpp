// A smooth boundary that never changes, and shares with others what they have in common.
//
// Theory. A tangent depends on a vertex and its neighbours (smooth.hpp), so the tangents of a piece
// of an outline depend on the piece, the vertex before it and the one after it. As long as these
// stay, so do the tangents, which the piece carries: a curve is made by looking at each piece, and
// making anew the tangents of those that are new or have got another neighbour. Control points are
// written where somebody asks for them, from vertices and tangents; what belongs to a vertex is the
// end of one segment and the beginning of the next,
//
//      ... p0 p1 [p2 p3 | p0 p1] p2 p3 ...
//
// A piece carries the tangents by the weights that were asked last.
//
// Cost: O(1) a piece, and a tangent for each vertex of those that changed; 40 bytes a vertex.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "outline.hpp"
#include "smooth.hpp"

namespace flintknap {

// The tangents of a piece between two other vertices.
struct Arcs {
    Weights weights;
    Point before, after;
    std::vector<Tangent> tangents;
};

class Curve {
   public:
    Curve(std::shared_ptr<const Outline> outline, Weights weights)
        : outline_(std::move(outline)), weights_(weights) {
        const Outline::Pieces& pieces = outline_->pieces();
        arcs_.reserve(pieces.size());
        for (std::size_t i = 0, k = pieces.size(); i < k; ++i) {
            Point before = pieces[i == 0 ? k - 1 : i - 1]->last;
            Point after = pieces[i + 1 == k ? 0 : i + 1]->first;
            std::shared_ptr<const Arcs>& arcs = pieces[i]->arcs;
            if (arcs == nullptr || arcs->weights != weights || !(arcs->before == before) ||
                !(arcs->after == after)) {
                arcs = make(*pieces[i], weights, before, after);
                made_ += pieces[i]->count;
            }
            arcs_.push_back(arcs);
        }
    }

    std::size_t size() const { return outline_->size(); }
    Weights weights() const { return weights_; }
    // How many tangents were made for this curve; the others were there.
    std::size_t made() const { return made_; }

    // f(i, vertex, tangent) for each vertex in order.
    template <class F>
    void visit(F&& f) const {
        for (std::size_t p = 0; p < arcs_.size(); ++p) {
            const Piece& piece = *outline_->pieces()[p];
            for (std::size_t i = 0; i < piece.count; ++i) {
                f(outline_->start(p) + i, piece.xy()[i], arcs_[p]->tangents[i]);
            }
        }
    }

   private:
    static std::shared_ptr<const Arcs> make(const Piece& piece, Weights weights, Point before,
                                            Point after) {
        auto arcs = std::make_shared<Arcs>(Arcs{weights, before, after, {}});
        arcs->tangents.reserve(piece.count);
        const Point* xy = piece.xy();
        for (std::size_t i = 0; i < piece.count; ++i) {
            Point p = i == 0 ? before : xy[i - 1], q = i + 1 == piece.count ? after : xy[i + 1];
            arcs->tangents.push_back(tangent({p, xy[i], q}, weights));
        }
        return arcs;
    }

    std::shared_ptr<const Outline> outline_;
    Weights weights_;
    std::vector<std::shared_ptr<const Arcs>> arcs_;
    std::size_t made_ = 0;
};

}  // namespace flintknap
