// The tree of Flintstones, made where queries reach it and kept through changes.
//
// Theory (section 4.1; docs/theory.md). The two vertices farthest apart on the rim of the smallest
// enclosing disc part the ring into two polylines, level 0; each polyline of level l is parted at
// its Flintstone's split into two of level l + 1, down to single edges. A node depends on nothing
// but its polyline:
//
//      level 0      b0 ----------------------- b1         (and b1 ... b0 likewise)
//                        [left, right, split,
//                         farthest, error]
//      level 1      b0 ---------- split --------- b1      p and s are the parents' business:
//                      [first]            [second]        nodes do not store them
//
// A node is *known* when its polyline has been searched, *refined* when its children exist. A child
// that is a single edge of the ring is no node. Polylines may also be parted at the vertex farthest
// from the chord: then there are no discs, and all else is the same.
//
// Through changes. Some vertices of the ring are touched: all those followed by another one than
// before, all that are new. A polyline without a touched vertex is what it was, and so are all
// nodes below. In another one, the stretch up to its first touched vertex and the one after its
// last have been there before; only the rest is looked at:
//
//      p ======= t ----- t -- t ======= s      = there before, - perhaps new
//
// If the vertices that decided before are still there, and nothing on the stretches between beats
// them, the node stands as it is; nothing else need be asked. If it does not, it is known no more,
// and the next query that reaches it searches it anew; its children stay as long as it is parted at
// the same vertex.
//
// Invariants (check): every known node is what a plain scan of its polyline gives; the base is
// that of a disc made from scratch.
// Cost: a search is a descent through the boxes of ring.hpp, at worst O(length); a change, one test
// for each touched vertex and known node above it. 64 bytes a node. No recursion: the tree may be
// as deep as the ring is long.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "enclosing.hpp"
#include "flintstone.hpp"
#include "links.hpp"
#include "nodes.hpp"
#include "ring_search.hpp"
#include "triangulation.hpp"

namespace flintknap {

// How far down: an edge above `level` is parted while its error is beyond `tolerance`.
struct Cut {
    Index level;
    double tolerance;
};

class Hierarchy {
   public:
    static constexpr Index kAnyLevel = std::numeric_limits<Index>::max();
    static constexpr double kAnyError = -1;  // a tolerance that no error keeps

    // One edge of an approximation, and the stretch of the ring that it stands for.
    struct Edge {
        Index start, stop, level;
        Index node;  // of the polyline between, not for keeping; negative: that is this edge
        Point at;    // of the start
        double error;
    };

    Hierarchy(const Triangulation& triangulation, const Ring& ring, Parting parting)
        : t_(triangulation), r_(ring), parting_(parting) {}

    bool is_begun() const { return !nodes_.empty(); }

    // How many nodes are refined, the base included.
    Index refined() {
        follow();
        return nodes_.refined();
    }
    // The deepest level that has a vertex.
    Index depth() {
        follow();
        return nodes_.deepest();
    }

    void clear() {
        nodes_.clear();
        base_ = {};
        top_ = {};
        is_base_known_ = false;
        heard_.clear();
    }

    // The ring is about to follow these links. The tree does so when it is asked; where that may
    // take longer than making it anew, it is given up.
    void hear(const Links& links) {
        if (links.none() || nodes_.empty()) return;
        std::size_t touched = heard_.size() + links.touched().size();
        bool is_long = touched * at(nodes_.deepest()) > 16 * at(nodes_.refined()) + at(r_.size());
        if (links.all() || touched > at(r_.size()) / 8 || is_long) {
            clear();
        } else {
            heard_.insert(heard_.end(), links.touched().begin(), links.touched().end());
        }
    }

    // Calls emit(Edge) for each edge of an approximation, in order along the ring, which is not
    // empty.
    template <class Poll, class Emit>
    void cut(Cut want, Poll poll, Emit emit) {
        begin();
        while (!stack_.empty()) {
            Frame f = stack_.back();
            stack_.pop_back();
            if (f.node == kEdge) {
                emit(Edge{f.p, f.s, f.level, kEdge, f.at, 0});
                continue;
            }
            know(f, poll);
            if (is_final(f, want)) {
                emit(Edge{f.p, f.s, f.level, f.node, f.at, nodes_[f.node].found.error});
            } else {
                part(f);
            }
        }
    }

    // Of an edge just emitted; that of a single edge is the edge itself.
    Flintstone flintstone(const Edge& e) const {
        return e.node == kEdge ? Flintstone{} : nodes_[e.node].found;
    }

    // For searches: one polyline, the two of level 0, and the halves of one whose error was asked.
    struct Frame {
        Index node, p, s, level;
        Point at;  // of p
    };
    std::array<Frame, 2> top() {
        begin();
        return {stack_[1], stack_[0]};
    }
    std::array<Frame, 2> halves(const Frame& f) {
        if (!nodes_[f.node].is_refined()) refine(f);
        return {first_child(f), second_child(f)};
    }
    template <class Poll>
    double error(const Frame& f, Poll& poll) {
        if (f.node == kEdge) return 0;
        know(f, poll);
        return nodes_[f.node].found.error;
    }
    // Whether the cut goes no further down than this one, whose error was asked.
    bool is_final(const Frame& f, Cut want) const {
        return f.node == kEdge || f.level >= want.level ||
               nodes_[f.node].found.error <= want.tolerance;
    }
    std::array<Point, 2> chord(const Frame& f) const { return {f.at, t_.site(f.s)}; }

    // Where w lies as far as the tree down to a cut tells: +1 inside, -1 outside, 0 if it is in a
    // Flintstone of the cut, no farther from its chord than the polyline, and so on all levels
    // above. (The discs are known if polylines are parted there.) Exact.
    template <class Poll>
    int side(Point w, Cut want, Poll poll) {
        int winding = 0;
        begin();
        while (!stack_.empty()) {
            Frame f = stack_.back();
            stack_.pop_back();
            auto [p, s] = chord(f);
            bool is_near = false;
            if (f.node == kEdge) {
                is_near = is_on_chord(p, s, w);
            } else {
                know(f, poll);
                const Flintstone& found = nodes_[f.node].found;
                is_near = (parting_ == Parting::farthest || is_inside(p, s, found, w)) &&
                          distance_to_chord(p, s, w) <= found.error;
            }
            if (!is_near) {
                winding += crossing(p, s, w);
            } else if (is_final(f, want)) {
                return 0;
            } else {
                part(f);
            }
        }
        return winding == 0 ? -1 : 1;
    }

    // The first level on which no error is beyond the tolerance.
    template <class Poll>
    Index level_for(double tolerance, Poll poll) {
        begin();
        std::vector<Frame> here, next(stack_.rbegin(), stack_.rend());
        for (Index level = 0;; ++level) {
            here.swap(next);
            next.clear();
            bool is_enough = true;
            for (const Frame& f : here) {
                if (f.node == kEdge) continue;
                know(f, poll);
                is_enough = is_enough && nodes_[f.node].found.error <= tolerance;
            }
            if (is_enough) return level;
            for (const Frame& f : here) {
                if (f.node == kEdge) continue;
                stack_.clear();
                part(f);
                next.insert(next.end(), stack_.begin(), stack_.end());
            }
        }
    }

    std::size_t bytes() const { return nodes_.bytes(); }

    // The first broken invariant, or nothing. O(length) a node.
    std::string check() const {
        if (!heard_.empty()) {
            Hierarchy other(*this);
            other.follow();
            return other.check();
        }
        if (nodes_.empty()) return {};
        std::array<Vertex, 2> base = find_base(t_, find_disc(t_));
        for (int n : {0, 1}) {
            if (is_base_known_ && base[at(n)].index != base_[at(n)].index) {
                return "the base is not that of the smallest disc";
            }
        }
        Index count = 1;
        std::vector<Index> at_level(nodes_.at_level().size(), 0);
        at_level[0] = 2;
        std::vector<Frame> todo = tops();
        while (!todo.empty()) {
            Frame f = todo.back();
            todo.pop_back();
            std::string broken = check(f);
            if (!broken.empty()) return broken;
            if (f.node == kEdge || !nodes_[f.node].is_refined()) continue;
            ++count;
            if (at(f.level + 1) >= at_level.size()) return "a level that is not counted";
            ++at_level[at(f.level + 1)];
            todo.push_back(first_child(f));
            todo.push_back(second_child(f));
        }
        if (count != nodes_.refined()) return "miscounted the nodes that are refined";
        return at_level == nodes_.at_level() ? "" : "miscounted the vertices of a level";
    }

   private:
    static constexpr Index kEdge = Nodes::kEdge;
    static constexpr Index kOften = 4096;  // searches from one poll to the next

    // How far behind base_[0] a vertex is along the ring.
    struct Place {
        Index place, vertex;
        bool operator<(const Place& o) const { return place < o.place; }
        bool operator==(const Place& o) const { return place == o.place; }
    };
    // A polyline that may have changed: one of the children of `parent`.
    struct Change {
        Index parent;
        int child;
        Index p, s, from, to, level;
    };

    // ------------------------------------------------------------------ the base
    // Goes through what was heard. If memory ends, the tree is lost.
    void follow() {
        if (heard_.empty()) return;
        try {
            follow_heard();
        } catch (...) {
            clear();
            throw;
        }
        heard_.clear();
    }

    void follow_heard() {
        if (!is_there(base_[0]) || !is_there(base_[1])) return clear();
        start_ = r_.rank(base_[0].index);
        places_.clear();
        for (Index v : heard_) {
            if (r_.holds(v)) places_.push_back({place(v), v});
        }
        std::sort(places_.begin(), places_.end());
        places_.erase(std::unique(places_.begin(), places_.end()), places_.end());
        follow_base();
        Index middle = place(base_[1].index);
        changes_.clear();
        changes_.push_back({kNone, 0, base_[0].index, base_[1].index, 0, middle, 0});
        changes_.push_back({kNone, 1, base_[1].index, base_[0].index, middle, r_.size(), 0});
        while (!changes_.empty()) {
            Change c = changes_.back();
            changes_.pop_back();
            follow(c);
        }
    }

    // Sees to it that there is a base, and puts its two polylines on the stack.
    void begin() {
        follow();
        if (!is_base_known_) {
            Disc disc = find_disc(t_);
            std::array<Vertex, 2> base = find_base(t_, disc);
            bool same = !nodes_.empty();
            for (std::size_t n : {0, 1}) {
                same = same && base[n].index == base_[n].index && base[n].at == base_[n].at;
            }
            if (!same) {
                clear();
                nodes_.make_room_for_base();
                base_ = base;
                top_ = {child_between(base[0].index, base[1].index),
                        child_between(base[1].index, base[0].index)};
                nodes_.set_base();
            }
            disc_ = disc;
            is_base_known_ = true;
        }
        stack_ = tops();
    }

    std::vector<Frame> tops() const {
        return {{top_[1], base_[1].index, base_[0].index, 0, base_[1].at},
                {top_[0], base_[0].index, base_[1].index, 0, base_[0].at}};
    }

    void follow_base() {
        for (int n = 0; n < disc_.count; ++n) {
            is_base_known_ = is_base_known_ && is_there(disc_.rim[at(n)]);
        }
        for (const Place& touched : places_) {
            Index v = touched.vertex;
            int side = disc_.side(t_.site(v));
            bool is_base = v == base_[0].index || v == base_[1].index;
            if (side < 0 || (side == 0 && !is_base)) is_base_known_ = false;
        }
    }

    // ------------------------------------------------------------------ nodes
    bool is_there(const Vertex& v) const { return r_.holds(v.index) && t_.site(v.index) == v.at; }

    Index child_between(Index p, Index s) { return r_.next(p) == s ? kEdge : nodes_.make(); }

    Frame first_child(const Frame& f) const {
        const Node& n = nodes_[f.node];
        return {n.first, f.p, n.found.split, f.level + 1, f.at};
    }
    Frame second_child(const Frame& f) const {
        const Node& n = nodes_[f.node];
        return {n.second, n.found.split, f.s, f.level + 1, n.found.split_vertex().at};
    }

    // Puts the children of a known node on the stack, made if need be.
    void part(const Frame& f) {
        if (!nodes_[f.node].is_refined()) refine(f);
        stack_.push_back(second_child(f));
        nodes_.prefetch(stack_.back().node);
        stack_.push_back(first_child(f));
    }

    void refine(const Frame& f) {
        Index split = nodes_[f.node].found.split;
        nodes_.refine(
            f.node, f.level, [&] { return child_between(f.p, split); },
            [&] { return child_between(split, f.s); });
    }

    // ------------------------------------------------------------------ searches
    template <class Poll>
    void know(const Frame& f, Poll& poll) {
        if (nodes_[f.node].found.is_known()) return;
        if (++searches_ % kOften == 0) poll();
        Flintstone found = search_.search(f.p, f.s, nodes_[f.node].found);
        Vertex before = nodes_[f.node].found.split_vertex(), now = found.split_vertex();
        if (before.index != now.index || !(before.at == now.at))
            nodes_.drop_children(f.node, f.level);
        nodes_[f.node].found = found;
    }

    // ------------------------------------------------------------------ changes
    Index place(Index v) const {
        Index place = r_.rank(v) - start_;
        return place < 0 ? place + r_.size() : place;
    }
    bool is_between(Index v, const Change& c) const {
        Index there = place(v);
        return c.from < there && there < c.to;
    }

    Index& link(const Change& c) {
        if (c.parent == kNone) return top_[at(c.child)];
        Node& n = nodes_[c.parent];
        return c.child == 0 ? n.first : n.second;
    }

    void follow(const Change& c) {
        auto first = std::lower_bound(places_.begin(), places_.end(), Place{c.from, kNone});
        if (first == places_.end() || first->place >= c.to) return;
        Index node = link(c);
        if (node == kEdge) {
            if (c.to - c.from > 1) {
                Index made = nodes_.make();
                link(c) = made;
            }
            return;
        }
        if (c.to - c.from == 1) {
            nodes_.drop_children(node, c.level);
            nodes_.give_back(node);
            link(c) = kEdge;
            return;
        }
        Flintstone before = nodes_[node].found;
        Vertex split = before.split_vertex();
        Index middle = split.index != kNone && is_there(split) ? place(split.index) : kNone;
        bool is_parted = c.from < middle && middle < c.to;
        if (before.is_known() && !(is_parted && stands(c, before))) {
            nodes_[node].found.error = Flintstone::kUnknown;
        }
        if (!nodes_[node].is_refined()) return;
        if (!is_parted) {
            nodes_.drop_children(node, c.level);
            return;
        }
        changes_.push_back({node, 0, c.p, split.index, c.from, middle, c.level + 1});
        changes_.push_back({node, 1, split.index, c.s, middle, c.to, c.level + 1});
    }

    // Whether a search of the polyline would find what was found before. Its split is still there.
    bool stands(const Change& c, const Flintstone& before) {
        for (Vertex v :
             {Vertex{before.left, before.left_at}, Vertex{before.right, before.right_at}}) {
            if (v.index == kNone || v.index == before.split) continue;
            if (!is_there(v) || !is_between(v.index, c)) return false;
        }
        auto first = std::lower_bound(places_.begin(), places_.end(), Place{c.from, kNone});
        Point p = t_.site(c.p), s = t_.site(c.s);
        Index farthest = before.farthest;
        if (farthest != before.left && farthest != before.right) {
            if (!r_.holds(farthest)) return false;
            Place there{place(farthest), farthest};
            if (there.place <= c.from || there.place >= c.to) return false;
            if (std::binary_search(first, places_.end(), there) &&
                distance_to_chord(p, s, t_.site(farthest)) != before.error) {
                return false;
            }
        }
        search_.resume(p, s, before);
        Index seen = kNone;  // the place of the last touched vertex
        for (auto next = first; next != places_.end() && next->place < c.to; ++next) {
            if (seen != kNone) search_.see_range(start_ + seen + 1, next->place - seen - 1);
            seen = next->place;
            if (seen > c.from) search_.see({next->vertex, t_.site(next->vertex)});
        }
        return search_.found_no_more_than(before);
    }

    // +1 if the ray from w to the right crosses the edge from p to s upward, -1 if downward.
    static int crossing(Point p, Point s, Point w) {
        if ((p.y <= w.y) == (s.y <= w.y)) return 0;
        int turn = orient(p, s, w);
        if (p.y <= w.y) return turn > 0 ? 1 : 0;
        return turn < 0 ? -1 : 0;
    }

    // The node and its edge, by a plain walk along the ring.
    std::string check(const Frame& f) const {
        std::string name = "polyline " + std::to_string(f.p) + " to " + std::to_string(f.s) + ": ";
        Search plain(parting_);
        plain.begin(t_.site(f.p), t_.site(f.s));
        Index v = r_.next(f.p);
        if (f.node == kEdge) return v == f.s ? "" : name + "is no edge";
        if (v == f.s) return name + "is an edge";
        for (; v != f.s; v = r_.next(v)) {
            if (v == f.p) return name + "never ends";
            plain.see({v, t_.site(v)});
        }
        const Node& n = nodes_[f.node];
        if (!n.found.is_known()) {
            return !n.is_refined() || is_there(n.found.split_vertex()) ? "" : name + "no split";
        }
        Flintstone found = plain.result();
        if (found.left != n.found.left || found.right != n.found.right ||
            found.split != n.found.split || found.error != n.found.error) {
            return name + "is not what a plain scan finds";
        }
        return is_there(n.found.split_vertex()) ? "" : name + "no split";
    }

    const Triangulation& t_;
    const Ring& r_;
    Parting parting_;
    Nodes nodes_;
    Disc disc_;                     // the smallest that holds all
    std::array<Vertex, 2> base_{};  // the two vertices of level 0
    bool is_base_known_ = false;    // if not, base_ is what it was
    std::array<Index, 2> top_{};    // the two polylines of level 0
    std::int64_t searches_ = 0;
    std::vector<Index> heard_;  // vertices touched since the tree followed
    // Work in progress.
    RingSearch search_{t_, r_, parting_};
    std::vector<Frame> stack_;
    std::vector<Place> places_;  // touched vertices, in order
    std::vector<Change> changes_;
    Index start_ = 0;  // the rank of base_[0]
};

}  // namespace flintknap
