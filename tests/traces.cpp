// Traces of strips against brute force: simple polygons whose vertices lie at the corners of parts,
// or a few margins beside, so that edges end just before a strip or pass it by a hair. What strips
// are told of vertices and places is off as far as a grid's coordinates may be.
//
// Prints what broke, and fails if anything did.
#include "traces.hpp"

#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

using namespace flintknap;

namespace {

class Case {
   public:
    explicit Case(unsigned seed) : dice_(seed) {
        Point centre = {double(random(32)) + 1.0 / 3, double(random(32)) + 1.0 / 7};
        corners_ = {{-9, -9}, {40, -9}, {40, 40}, {-9, 40}};
        for (std::size_t n = 4 + random(24), tries = 200; corners_.size() < n && tries > 0;
             --tries) {
            Point p = {near_a_line(), near_a_line()};
            for (std::size_t i = 0; i < corners_.size(); ++i) {
                Point after = corners_[(i + 1) % corners_.size()];
                if (orient(centre, corners_[i], p) <= 0 || orient(centre, p, after) <= 0) continue;
                corners_.insert(corners_.begin() + std::ptrdiff_t(i) + 1, p);
                break;
            }
        }
    }

    // How many places were told by traces, and how many strips crossed and passed by segments.
    struct Told {
        long places = 0, crossed = 0, passed = 0;
    };
    void check(Told& told_so_far) {
        std::size_t n = corners_.size();
        for (Point p : corners_) told_corners_.push_back(about(p));
        Strips strips;
        strips.clear();
        for (std::size_t i = 0; i < n; ++i) {
            strips.add(told_corners_[i], told_corners_[(i + 1) % n], Code(i / 32, int(i % 32)),
                       codes_);
        }
        strips.settle([&](int x, int y) { return expected({x + 0.5, y + 0.5}); });
        for (int i = 0; i < 1500; ++i) {
            Point q = i % 2 == 0 ? Point{near_a_line(), near_a_line()} : beside_an_edge();
            Point told_q = about(q);
            if (!is_in(told_q, Raster::kSide)) continue;
            int x = Raster::part(told_q.x), y = Raster::part(told_q.y), s = y / Trace::kRows;
            int told = strips.raster.side(x, y);
            if (told != 0 && told != expected(q)) fail("a part is not clear");
            int traced = strips.traces[s].is_full()
                             ? Trace::kUntold
                             : strips.traces[s].side(above(told_q, s), [&](std::size_t code) {
                                   std::size_t e = number(codes_[at(s)][code]);
                                   return orient(corner(e), corner(e + 1), q);
                               });
            if (traced == Trace::kUntold) continue;
            if (traced != expected(q)) fail("another side");
            told_so_far.places += told == 0;
        }
        for (int i = 0; i < 200; ++i) check_segment(strips.traces, told_so_far);
    }

   private:
    [[noreturn]] static void fail(const char* what) {
        std::printf("%s\n", what);
        std::exit(1);
    }

    std::size_t random(std::size_t n) { return dice_() % n; }

    static bool is_in(Point q, double high) {
        return q.x >= 0 && q.x <= Raster::kSide && q.y >= 0 && q.y <= high;
    }

    // Where a grid may take a place to be: 2^-20 of a part beside.
    Point about(Point q) {
        auto off = [&] { return (double(random(3)) - 1) / (1 << 20); };
        return {q.x + off(), q.y + off()};
    }

    static Point above(Point q, int strip) { return {q.x, q.y - strip * Trace::kRows}; }
    static std::size_t number(Code code) { return code.leaf() * 32 + std::size_t(code.place()); }
    Point corner(std::size_t i) const { return corners_[i % corners_.size()]; }

    Point beside_an_edge() {
        std::size_t i = random(corners_.size());
        double t = double(random(1025)) / 1024, beside = (double(random(33)) - 16) / 512;
        Point a = corner(i), b = corner(i + 1);
        return {a.x + t * (b.x - a.x) + beside, a.y + t * (b.y - a.y) + beside / 8};
    }

    // Where a segment is said to cross an edge, it does; else whatever it meets in a strip is told.
    void check_segment(const Trace* traces, Told& told_so_far) {
        Point p = {double(random(1025)) / 32, double(random(1025)) / 32};
        Point q = random(8) == 0 ? p : Point{p.x + near_a_line() - 16, p.y + near_a_line() - 16};
        if (random(4) == 0) q = {p.x + (q.x - p.x) / 32, p.y + (q.y - p.y) / 32};
        const Point told_p = about(p), told_q = about(q);
        for (int s = 0; s < Strips::kCount; ++s) {
            if (traces[s].is_full()) continue;
            std::vector<bool> told(corners_.size());
            bool crosses =
                traces[s].any_met(above(told_p, s), above(told_q, s), [&](std::size_t code) {
                    told[number(codes_[at(s)][code])] = true;
                    return false;
                });
            bool is_so = false;
            for (std::size_t i = 0; i < corners_.size(); ++i) {
                Point a = corner(i), b = corner(i + 1);
                int of_p = orient(a, b, p), of_q = orient(a, b, q);
                int turns = orient(p, q, a) * orient(p, q, b);
                is_so = is_so || (of_p * of_q < 0 && turns < 0);
                if (crosses || told[i] || of_p == of_q) continue;  // on one line: met anywhere
                if (!overlap(box_of(a, b), box_of(p, q)) || of_p * of_q > 0 || turns > 0) continue;
                double t = cross(a, b, p) / (cross(a, b, p) - cross(a, b, q));
                Point met = above({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)}, s);
                if (is_in(met, Trace::kRows)) fail("an edge that was not told");
            }
            if (crosses && !is_so) fail("nothing is crossed");
            ++(crosses ? told_so_far.crossed : told_so_far.passed);
        }
    }
    static double cross(Point a, Point b, Point q) {
        return (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
    }

    double near_a_line() {
        double beside = random(2) == 0 ? 0 : Raster::kMargin * (double(random(25)) - 12) / 4;
        return double(random(34)) - 1 + (random(4) == 0 ? double(random(8)) / 8 : beside);
    }

    int expected(Point q) const {
        int result = -1;
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            Point a = corners_[i], b = corners_[(i + 1) % corners_.size()];
            int turn = orient(a, b, q);
            if (turn == 0 && box_of(a, b).holds(q)) return 0;
            if ((a.y <= q.y && q.y < b.y && turn > 0) || (b.y <= q.y && q.y < a.y && turn < 0))
                result = -result;
        }
        return result;
    }

    std::minstd_rand dice_;
    std::vector<Point> corners_, told_corners_;
    Strips::Codes codes_;
};

}  // namespace

int main() {
    Case::Told told;
    for (unsigned seed = 1; seed <= 1500; ++seed) Case(seed).check(told);
    if (told.places < 200000 || told.crossed < 50000 || told.passed < 500000) {
        std::printf("only %ld places, %ld strips crossed, %ld passed were told\n", told.places,
                    told.crossed, told.passed);
        return 1;
    }
    return 0;
}
