// Marked parts of rasters against brute force: simple polygons whose vertices lie at the corners of
// parts, or a few margins beside, so that edges end just before a part or pass it by a hair.
//
// Prints what broke, and fails if anything did.
#include "marks.hpp"

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

    // How many marks were right.
    int check() {
        Ring::Leaf leaf = {};
        Raster raster;
        Sketch sketch;
        Marks marks;
        std::size_t n = corners_.size();
        for (std::size_t i = 0; i <= n; ++i) {
            leaf.x[i] = corners_[i % n].x;
            leaf.y[i] = corners_[i % n].y;
        }
        raster.clear();
        for (std::size_t i = 0; i < n; ++i) {
            raster.add(corners_[i], corners_[(i + 1) % n],
                       [&](int row, std::uint32_t near, std::uint32_t met) {
                           sketch.add(Mark(0, int(i)), row, near, met);
                       });
        }
        raster.settle([&](int x, int y) { return expected({x + 0.5, y + 0.5}); });
        sketch.finish(raster, marks, 1, [](std::size_t) { return 7; });
        int count = 0;
        for (int y = 0; y < Raster::kSide; ++y) {
            for (int x = 0; x < Raster::kSide; ++x) {
                int told = raster.side(x, y);
                if (told == 0) continue;
                Mark mark = told == Raster::kMarked ? marks.find(raster, x, y) : Mark::none();
                count += told == Raster::kMarked;
                if (mark.is_edges() && marks.leaf(mark) != 7) fail("another leaf");
                for (int i = 0; i < 12; ++i) {
                    Point q = {x + share(i, 0), y + share(i, 1)};
                    int found = mark.is_edges() ? side(leaf, mark, q) : told;
                    if (found != expected(q)) fail("another side");
                }
                for (Point q : corners_) {
                    bool is_there = x <= q.x && q.x <= x + 1 && y <= q.y && q.y <= y + 1;
                    if (is_there && (!mark.is_edges() || side(leaf, mark, q) != 0))
                        fail("a vertex that is not on the boundary");
                }
            }
        }
        return count;
    }

   private:
    [[noreturn]] static void fail(const char* what) {
        std::printf("%s\n", what);
        std::exit(1);
    }

    std::size_t random(std::size_t n) { return dice_() % n; }

    double near_a_line() {
        double beside = Raster::kMargin * (double(random(25)) - 12) / 4;
        return double(random(34)) - 1 + (random(4) == 0 ? double(random(8)) / 8 : beside);
    }

    // Of a part: its corners, and places anywhere.
    double share(int i, int axis) { return i < 4 ? i >> axis & 1 : double(random(1025)) / 1024; }

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
    std::vector<Point> corners_;
};

}  // namespace

int main() {
    long marks = 0;
    for (unsigned seed = 1; seed <= 1500; ++seed) marks += Case(seed).check();
    if (marks < 50000) {
        std::printf("only %ld parts were marked\n", marks);
        return 1;
    }
    return 0;
}
