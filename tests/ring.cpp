// The ring sequence against a plain list, through random splices, and answers against brute force,
// with cells that follow and without.
//
// The model is a list of vertices; what a change does to it is told as the boundary tells it: each
// vertex that is followed by another one than before, each slot that got a new site. Most polygons
// cross themselves, which neither the sequence nor the parity of crossings minds; the others are
// simple, as seen from a centre, and cells are asked about sides.
//
// Prints what broke, and fails if anything did.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "collision.hpp"

using namespace flintknap;

namespace {

[[noreturn]] void fail(const std::string& what) {
    std::printf("%s\n", what.c_str());
    std::exit(1);
}

class Model {
   public:
    explicit Model(unsigned seed) : dice_(seed) {}

    // What Splices asks of a source.
    Index ring_size() const { return static_cast<Index>(list_.size()); }
    Index slots() const { return static_cast<Index>(sites_.size()); }
    bool on_ring(Index v) const { return following_[at(v)] != kNone; }
    Index following(Index v) const { return following_[at(v)]; }
    void prefetch(Index) const {}
    Point site(Index v) const { return sites_[at(v)]; }
    Index smallest() const {
        return *std::min_element(list_.begin(), list_.end(),
                                 [&](Index a, Index b) { return site(a) < site(b); });
    }

    std::size_t size() const { return list_.size(); }
    bool is_simple() const { return is_simple_; }
    std::size_t random(std::size_t n) { return dice_() % n; }

    void grow(std::size_t place, std::size_t n) {
        std::vector<Index> added;
        for (std::size_t i = 0; i < n; ++i) added.push_back(new_vertex());
        list_.insert(list_.begin() + std::ptrdiff_t(place), added.begin(), added.end());
    }
    void shrink(std::size_t place, std::size_t n) {
        auto first = list_.begin() + std::ptrdiff_t(place);
        for (auto v = first; v < first + std::ptrdiff_t(n); ++v) free_.push_back(*v);
        list_.erase(first, first + std::ptrdiff_t(n));
    }
    // Puts what stands in [a, b) behind what stands in [b, c).
    void swap_runs(std::size_t a, std::size_t b, std::size_t c) {
        auto first = list_.begin();
        std::rotate(first + std::ptrdiff_t(a), first + std::ptrdiff_t(b),
                    first + std::ptrdiff_t(c));
    }
    void reverse(std::size_t a, std::size_t b) {
        std::reverse(list_.begin() + std::ptrdiff_t(a), list_.begin() + std::ptrdiff_t(b));
    }
    // Another site takes the slot and the place of one.
    void replace(std::size_t place) {
        sites_[at(list_[place])] = somewhere();
        links.touch(list_[place]);
    }
    // As removed by one change and brought back by another.
    void touch_any() { links.touch(Index(random(sites_.size()))); }

    // Makes a simple polygon of four corners about the centre, and keeps it one: all directions
    // from there differ, and no two that follow each other by half a turn.
    void begin_simple() {
        is_simple_ = true;
        double high = double(grid_) + 1;
        for (Point p : {Point{-1, -1}, {high, -1}, {high, high}, {-1, high}})
            list_.push_back(vertex_at(p));
    }
    void grow_simple(std::size_t n) {
        for (; n > 0; --n) {
            Point p = {double(random(8 * grid_)) / 8, double(random(8 * grid_)) / 8};
            for (std::size_t i = 0; i < size(); ++i) {
                if (!is_between(i, p, i + 1)) continue;
                list_.insert(list_.begin() + std::ptrdiff_t(i) + 1, vertex_at(p));
                break;
            }
        }
    }
    void shrink_simple(std::size_t place) {
        Point before = site_at(place + size() - 1), after = site_at(place + 1);
        if (orient(centre_, before, after) > 0) shrink(place, 1);
    }
    void replace_simple(std::size_t place) {
        Point p = somewhere();
        if (!is_between(place + size() - 1, p, place + 1)) return;
        sites_[at(list_[place])] = p;
        links.touch(list_[place]);
    }

    // Tells who is followed by another one.
    void tell() {
        std::vector<Index> before(sites_.size(), kNone);
        before.swap(following_);
        before.resize(sites_.size(), kNone);
        for (std::size_t i = 0; i < list_.size(); ++i) {
            Index v = list_[i], w = list_[(i + 1) % list_.size()];
            following_[at(v)] = w;
            if (before[at(v)] != w) links.touch(v);
        }
    }

    void compare(Cells& cells) {
        const Ring& ring = cells.ring();
        std::string broken = ring.check(*this);
        if (!broken.empty()) fail(broken);
        if (list_.empty()) return;
        std::vector<Index> expected = list_;
        std::rotate(expected.begin(), std::find(expected.begin(), expected.end(), smallest()),
                    expected.end());
        Index n = ring.size(), rank = Index(random(at(n))), count = Index(random(at(n) + 1));
        std::vector<Index> seen;
        ring.visit_range(rank, count, [&](Index node, Index begin, Index end) {
            ring.visit_run(node, begin, end, [&](Index, Index, Index) {});
            collect(ring, node, begin, end, seen);
        });
        if (Index(seen.size()) != count) fail("a range has another length");
        for (Index i = 0; i < count; ++i) {
            if (seen[at(i)] != expected[at((rank + i) % n)]) fail("a range has other vertices");
        }
        Index a = Index(random(at(n))), b = Index(random(at(n))), c = Index(random(at(n)));
        bool is_between = (b - a + n) % n <= (c - a + n) % n;
        if (ring.between(expected[at(a)], expected[at(b)], expected[at(c)]) != is_between)
            fail("who lies between whom");
        compare_sides(ring);
        if (is_flat(ring.node(ring.root()).box)) return;  // as no boundary is: cells expect none
        broken = cells.check();
        if (!broken.empty()) fail(broken);
        compare_answers(cells);
    }

    void compare_sides(const Ring& ring) {
        std::vector<Point> places = some_places();
        Sides sides(ring);
        sides.ask(
            places.size(), [&](std::size_t i) { return places[i]; },
            [&](std::size_t i, int answer) {
                if (answer != expected_side(places[i])) fail("another side, of many");
                if (answer != side(ring, places[i])) fail("another side, of one");
            });
    }

    void compare_answers(Cells& cells) {
        const Ring& ring = cells.ring();
        std::vector<Segment> segments;
        std::vector<Point> places = some_places();
        for (std::size_t i = 0; i < places.size(); ++i) {
            Point q = places[i];
            if (is_simple_ && cells.side(q) != side(ring, q)) fail("another side, by cells");
            if (i % 4 != 0) continue;
            double far = NearestSearch(ring).ask_distance(q);
            if (far != NearestSearch(ring, &cells).ask_distance(q)) fail("another distance");
            for (Point to : {q, places[i / 2], Point{q.x + 1, q.y - 1}, Point{q.x, q.y + 9},
                             Point{q.x - 0.25, q.y + 0.125}}) {
                segments.push_back({q, to});
            }
        }
        auto meets = [&](const Segment& s) {
            return any_contact(ring, ring.root(), s, [](Index, Index) { return true; });
        };
        auto is_held = [&](const Segment& s) {
            auto leads_out = [&](Index n, Index i) { return leads_out_at(ring, n, i, s); };
            return side(ring, s.p) >= 0 && !any_contact(ring, ring.root(), s, leads_out);
        };
        compare_segments<Intersects>(cells, segments, meets);
        if (is_simple_) compare_segments<Holds>(cells, segments, is_held);
    }

    template <class Question, class Expected>
    static void compare_segments(Cells& cells, const std::vector<Segment>& segments,
                                 Expected expected) {
        auto ends = [&](std::size_t i) { return std::pair(segments[i].p, segments[i].q); };
        std::vector<bool> told_of(segments.size());
        for (int times = 0; times < 2; ++times) {
            tell_each<Question>(cells, segments.size(), ends,
                                [&](std::size_t i, bool told) { told_of[i] = told; });
            for (std::size_t i = 0; i < segments.size(); ++i) {
                bool is_so = expected(segments[i]);
                if (told_of[i] != is_so) fail("another contact, of many");
                if (flintknap::tell<Question>(cells, segments[i].p, segments[i].q) != is_so)
                    fail("another contact, of one");
            }
        }
    }

    Links links;

   private:
    static bool is_flat(const Box& b) { return b.x_low == b.x_high || b.y_low == b.y_high; }

    std::vector<Point> some_places() {
        std::vector<Point> places = {{-1, 3}, {3, -1}, {99, 3}, {3, 99}};
        for (int i = 0; i < 20; ++i) {
            Point a = site(list_[random(size())]), b = site(list_[random(size())]);
            places.push_back(a);
            places.push_back({a.x, b.y});
            places.push_back({(a.x + b.x) / 2, (a.y + b.y) / 2});
            places.push_back(somewhere());
            for (int j = 0; j < 2; ++j) places.push_back({a.x + eighths(), a.y + eighths()});
        }
        return places;
    }

    double eighths() { return double(random(17)) / 8 - 1; }
    Point somewhere() { return {double(random(grid_)), double(random(grid_))}; }

    Point site_at(std::size_t place) const { return site(list_[place % size()]); }
    bool is_between(std::size_t a, Point p, std::size_t b) const {
        return orient(centre_, site_at(a), p) > 0 && orient(centre_, p, site_at(b)) > 0;
    }
    Index vertex_at(Point p) {
        Index v = slots();
        if (free_.empty()) {
            sites_.push_back(p);
            following_.push_back(kNone);
        } else {
            v = free_.back();
            free_.pop_back();
            sites_[at(v)] = p;
        }
        links.touch(v);
        return v;
    }

    Index new_vertex() {
        if (free_.empty() || random(4) == 0) {
            sites_.push_back(somewhere());
            following_.push_back(kNone);
            links.touch(slots() - 1);
            return slots() - 1;
        }
        std::size_t i = random(free_.size());
        Index v = free_[i];
        free_.erase(free_.begin() + std::ptrdiff_t(i));
        if (random(2) == 0) return v;  // the same one comes back
        sites_[at(v)] = somewhere();
        links.touch(v);
        return v;
    }

    static void collect(const Ring& ring, Index n, Index begin, Index end,
                        std::vector<Index>& seen) {
        if (!ring.is_leaf(n)) {
            if (begin != 0 || end != ring.node(n).count) fail("part of a subtree");
            collect(ring, ring.node(n).left, 0, ring.node(ring.node(n).left).count, seen);
            collect(ring, ring.node(n).right, 0, ring.node(ring.node(n).right).count, seen);
        } else {
            const Ring::Leaf& leaf = ring.leaf(n);
            seen.insert(seen.end(), leaf.vertex + begin, leaf.vertex + end);
        }
    }

    int expected_side(Point q) const {
        int result = -1;
        for (Index v : list_) {
            Point a = site(v), b = site(following(v));
            int turn = orient(a, b, q);
            bool in_box = std::min(a.x, b.x) <= q.x && q.x <= std::max(a.x, b.x) &&
                          std::min(a.y, b.y) <= q.y && q.y <= std::max(a.y, b.y);
            if (turn == 0 && in_box) return 0;
            if ((a.y <= q.y && q.y < b.y && turn > 0) || (b.y <= q.y && q.y < a.y && turn < 0))
                result = -result;
        }
        return result;
    }

    std::minstd_rand dice_;
    std::size_t grid_ = 1 + dice_() % 40;
    Point centre_ = {double(grid_) / 2 + 1.0 / 64, double(grid_) / 2 + 1.0 / 128};
    bool is_simple_ = false;
    std::vector<Index> list_;
    std::vector<Index> following_;
    std::vector<Point> sites_;
    std::vector<Index> free_;
};

void change(Model& m) {
    std::size_t n = m.size(), i = m.random(n), longest = m.random(8) == 0 ? n - i : 1 + n / 40;
    std::size_t length = std::min(n - i, m.random(longest + 1));
    if (m.is_simple()) {
        switch (m.random(4)) {
            case 0: return m.grow_simple(1 + m.random(1 + n / 30));
            case 1: return m.replace_simple(i);
            case 2: return m.touch_any();
            default: return m.shrink_simple(i);
        }
    }
    switch (m.random(8)) {
        case 0: return m.grow(i, 1);
        case 1: return m.grow(i, m.random(1 + n / 30));
        case 2: return n - length >= 3 ? m.shrink(i, length) : void();
        case 3: return n > 3 ? m.shrink(i, 1) : void();
        case 4: return m.reverse(i, i + length);
        case 5: return m.replace(i);
        case 6: return m.touch_any();
        default: {
            std::size_t cuts[3] = {m.random(n), m.random(n), m.random(n)};
            std::sort(cuts, cuts + 3);
            m.swap_runs(cuts[0], cuts[1], cuts[2]);
        }
    }
}

void run(unsigned seed) {
    Model model(seed);
    Ring ring;
    Splices splices;
    Cells cells(ring);
    auto follow = [&] {
        if (splices.update(ring, model, model.links)) cells.follow(splices);
        model.compare(cells);
    };
    follow();
    if (seed % 3 == 0) {
        model.begin_simple();
        model.grow_simple(model.random(seed % 4 == 0 ? 40 : 1000));
    } else {
        model.grow(0, 3 + model.random(seed % 4 == 0 ? 40 : 3000));
    }
    model.tell();
    for (int step = 0; step < 60; ++step) {
        follow();
        for (std::size_t n = 1 + model.random(3); n > 0; --n) change(model);
        model.tell();
    }
    model.shrink(0, model.size());
    model.tell();
    follow();
}

}  // namespace

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 1024);
    unsigned first = argc > 1 ? unsigned(std::atoi(argv[1])) : 0;
    unsigned last = argc > 2 ? unsigned(std::atoi(argv[2])) : first + 100;
    for (unsigned seed = first; seed < last; ++seed) {
        std::printf("seed %u\n", seed);
        run(seed);
    }
    return 0;
}
