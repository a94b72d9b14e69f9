// A libFuzzer target: bytes become operations on an object, and whatever came in which way, its
// triangles and its boundary are those of an object made from scratch.
//
// The first byte chooses the subject. "Whole" is Object as Python sees it: points wait, few changes
// are repaired, many are not. "Bare" is a triangulation watched by a constriction, which are told
// of each change at once: there any number of changes to a small set is repaired in one pass.
//
// Every byte after that is an operation, its operands follow. A point is a byte for a place in a
// table of points that like to be cocircular, collinear or a last bit apart, or any 16 bytes.
// With FLINTKNAP_TELL set, operations are printed as they come, as lines of Python.
#include "object.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

using namespace flintknap;

namespace {

[[noreturn]] void fail(const std::string& what) {
    std::fprintf(stderr, "FAILED: %s\n", what.c_str());
    std::abort();
}

void tell(const char* what, Point p) {
    static const bool aloud = std::getenv("FLINTKNAP_TELL") != nullptr;
    if (aloud) std::fprintf(stderr, "(\"%s\", (%.17g, %.17g)),\n", what, p.x, p.y);
}

void nothing_to_poll() {}

// ---------------------------------------------------------------------------------- bytes
struct Feed {
    const std::uint8_t* data;
    std::size_t size, next = 0;

    bool empty() const { return next >= size; }
    std::size_t byte() { return empty() ? 0 : data[next++]; }
};

std::vector<Point> table() {
    std::vector<Point> places;
    for (int x = 0; x < 7; ++x) {  // 49 of a grid
        for (int y = 0; y < 7; ++y) places.push_back({1.0 * x, 1.0 * y});
    }
    for (int x = -65; x <= 65; ++x) {  // 36 on a circle about 0
        for (int y = -65; y <= 65; ++y) {
            if (x * x + y * y == 65 * 65) places.push_back({1.0 * x, 1.0 * y});
        }
    }
    for (int n = -24; n < 24; ++n) places.push_back({1.0 * n, 0});  // 48 on a line, and off it
    for (double y : {-100.0, -1.0, 0.5, 1e-9, 1e9}) places.push_back({0.25, y});
    for (int n = 1; n <= 24; ++n) places.push_back({n / 7.0, 0.1 * (n / 7.0)});  // nearly on a line
    for (int n = 0; n < 25; ++n) {  // a last bit apart; the same at an offset
        places.push_back({1 / 3.0 + n % 5 * 0x1p-54, 1 / 3.0 + n / 5 * 0x1p-54});
    }
    for (int n = 0; n < 25; ++n) {
        places.push_back({1e6 + n % 5 * 0x1p-33, -1e6 + n / 5 * 0x1p-33});
    }
    for (double x : {1e-60, -3.3e-59, 1e-30, 1.0, 7e59, -1e60}) {  // both ends of the range
        for (double y : {0.0, -1e-60, 2e-60, 1 + 0x1p-52, 1e60, -1e60}) places.push_back({x, y});
    }
    return places;
}

// Any double, or the one nearest in spirit that is admissible.
double coordinate(Feed& bytes) {
    std::uint64_t bits = 0;
    for (int n = 0; n < 8; ++n) bits = bits << 8 | bytes.byte();
    double v;
    std::memcpy(&v, &bits, sizeof v);
    double size = std::fabs(v);
    if (size >= 1e-60 && size <= 1e60) return v;
    return size < 1e-60 ? 0 : std::copysign(1.0, v);
}

Point place(Feed& bytes) {
    static const std::vector<Point> places = table();
    std::size_t n = bytes.byte();
    if (n < places.size()) return places[n];
    double x = coordinate(bytes);
    return {x, coordinate(bytes)};
}

// ---------------------------------------------------------------------------------- what there is
// All triangles, each from its smallest corner, and whether it belongs to the object.
using Description = std::vector<std::array<double, 7>>;

Description describe(const Triangulation& t, const Constriction& c) {
    Description rows;
    const Mesh& m = t.mesh();
    for (Index x = 0; x < m.triangles(); ++x) {
        if (m.is_free(x) || m.is_ghost(x)) continue;
        Index h = Mesh::first(x);
        for (int turn = 0; turn < 3; ++turn) {
            if (t.site(m.target(h)) < t.site(m.origin(h))) h = Mesh::next(h);
        }
        if (t.site(m.apex(h)) < t.site(m.origin(h))) h = Mesh::prev(h);
        Point i = t.site(m.origin(h)), j = t.site(m.target(h)), k = t.site(m.apex(h));
        rows.push_back({i.x, i.y, j.x, j.y, k.x, k.y, c.is_inside(x) ? 1.0 : 0.0});
    }
    std::sort(rows.begin(), rows.end());
    return rows;
}

struct Known {
    std::int64_t id;
    int times;
};
struct ByPlace {
    bool operator()(Point a, Point b) const { return a < b; }
};
using Model = std::map<Point, Known, ByPlace>;

Description from_scratch(const Model& model) {
    std::vector<Point> points;
    for (const auto& [p, known] : model) points.push_back(p);
    std::vector<std::int64_t> ids(points.size());
    Object object;
    object.insert(points.size(), [&](std::size_t n) { return points[n]; }, ids.data());
    object.settle(nothing_to_poll);
    return describe(object.triangulation(), object.constriction());
}

// ---------------------------------------------------------------------------------- subjects
class Whole {
   public:
    void insert(const std::vector<Point>& points) {
        std::vector<std::int64_t> ids(points.size());
        if (points.size() == 1) {
            ids[0] = object_->insert(points[0]);
        } else {
            object_->insert(points.size(), [&](std::size_t n) { return points[n]; }, ids.data());
        }
        for (std::size_t n = 0; n < points.size(); ++n) {
            auto [at, is_new] = model_.insert({points[n], {next_id_, 0}});
            ++at->second.times;
            if (is_new) ++next_id_;
            if (ids[n] != at->second.id) fail("insert returned another id");
        }
    }

    void remove(Point p) {
        auto found = model_.find(p);
        object_->remove(handle(found->second.id));
        drop(found);
    }

    void move(Point from, Point to) {
        auto found = model_.find(from);
        Known known = found->second;
        bool keeps = from == to || (known.times == 1 && model_.count(to) == 0);
        std::int64_t id = object_->move(handle(known.id), to);
        drop(found);
        auto [at, is_new] = model_.insert({to, {keeps ? known.id : next_id_, 0}});
        ++at->second.times;
        if (is_new && !keeps) ++next_id_;
        if (id != at->second.id) fail("move returned another id");
    }

    void clear() {
        const Points& points = object_->points();
        object_ = std::make_unique<Object>(Limit{}, points.next_id(), points.revision() + 1);
        model_.clear();
    }

    void look() { object_->place(nothing_to_poll); }
    void settle() { object_->settle(nothing_to_poll); }

    void check() {
        settle();
        const Points& points = object_->points();
        std::string broken = object_->check();
        if (!broken.empty()) fail(broken);
        object_->update_ring();
        broken = object_->ring().check(*object_);
        if (!broken.empty()) fail(broken);
        if (!object_->ring().empty()) {  // the trees go on from one check to the next
            Cut cut = {static_cast<Index>(points.size() % 9), 0};
            for (Hierarchy* tree : {&object_->hierarchy(), &object_->farthest()}) {
                tree->cut(cut, nothing_to_poll, [](const Hierarchy::Edge&) {});
            }
            broken = object_->check();
            if (!broken.empty()) fail(broken);
        }
        if (points.size() != model_.size()) fail("another number of points");
        for (const auto& [p, known] : model_) {
            Index h = points.find(p);
            if (h == kNone || points.id(h) != known.id) fail("a point is not found");
            if (points.multiplicity(h) != known.times) fail("another multiplicity");
            if (points.find(known.id) != h) fail("an id is not found");
        }
        for (std::int64_t id = 0; id < next_id_; id += 7) {
            Index h = points.find(id);
            if (h != kNone && points.id(h) != id) fail("an id that left is found");
        }
    }

    const Model& model() const { return model_; }
    const Triangulation& triangulation() const { return object_->triangulation(); }
    const Constriction& constriction() const { return object_->constriction(); }
    const Ring& ring() const { return object_->ring(); }
    Cells& cells() { return object_->cells(); }

   private:
    Index handle(std::int64_t id) const {
        Index h = object_->points().find(id);
        if (h == kNone) fail("an id is unknown");
        return h;
    }
    void drop(Model::iterator at) {
        if (--at->second.times == 0) model_.erase(at);
    }

    std::unique_ptr<Object> object_ = std::make_unique<Object>();
    Model model_;
    std::int64_t next_id_ = 0;
};

class Bare {
   public:
    void insert(const std::vector<Point>& points) {
        for (Point p : points) {
            if (model_.count(p) > 0) continue;
            bool was_flat = t_->is_flat();
            Nobody nobody;
            Index v = is_built_ ? t_->insert(p, kNone, *c_) : t_->insert(p, kNone, nobody);
            model_.insert({p, {v, 1}});
            if (was_flat) {
                is_built_ = false;
            } else if (is_built_) {
                c_->appeared(v);
                c_->created(t_->created());
            }
        }
    }

    void remove(Point p) {
        auto slot = static_cast<Index>(model_.at(p).id);
        model_.erase(p);
        Nobody nobody;
        if (!is_built_) return t_->remove(slot, nobody);
        t_->remove(slot, *c_);
        if (t_->is_flat()) {
            is_built_ = false;
            return;
        }
        c_->vanished();
        c_->created(t_->created());
    }

    void move(Point from, Point to) {
        remove(from);
        insert({to});
    }

    void clear() {
        t_ = std::make_unique<Triangulation>();
        c_ = std::make_unique<Constriction>(*t_);
        model_.clear();
        is_built_ = false;
    }

    void look() {}
    void settle() {
        if (t_->is_flat()) return;
        if (is_built_ && c_->repair()) {
            c_->forget_changes();
        } else {
            c_->build();
        }
        is_built_ = true;
    }

    void check() {
        settle();
        std::string broken = t_->check();
        if (broken.empty() && !t_->is_flat()) broken = c_->check();
        if (splices_.update(ring_, *this, c_->links())) cells_.follow(splices_);
        if (broken.empty()) broken = ring_.check(*this);
        if (broken.empty()) broken = cells_.check();
        if (!broken.empty()) fail(broken);
        if (at(t_->size()) != model_.size()) fail("another number of sites");
    }

    // What Splices asks of a source.
    Index ring_size() const { return t_->is_flat() ? 0 : t_->size() - c_->left_inside(); }
    Index slots() const { return t_->slots(); }
    Index smallest() const { return t_->smallest(); }
    bool on_ring(Index v) const { return c_->on_ring(v); }
    Index following(Index v) const { return c_->following(v); }
    Point site(Index v) const { return t_->site(v); }
    void prefetch(Index) const {}

    const Model& model() const { return model_; }
    const Triangulation& triangulation() const { return *t_; }
    const Constriction& constriction() const { return *c_; }
    const Ring& ring() const { return ring_; }
    Cells& cells() { return cells_; }

   private:
    std::unique_ptr<Triangulation> t_ = std::make_unique<Triangulation>();
    std::unique_ptr<Constriction> c_ = std::make_unique<Constriction>(*t_);
    Ring ring_;
    Splices splices_;
    Cells cells_{ring_};
    bool is_built_ = false;  // and has been told of every change since
    Model model_;            // its ids are slots
};

// ---------------------------------------------------------------------------------- operations
template <class Subject>
Point one_of(const Subject& subject, Feed& bytes) {
    auto at = subject.model().begin();
    std::advance(at, bytes.byte() % subject.model().size());
    return at->first;
}

template <class Subject>
void compare(Subject& subject) {
    subject.check();
    if (describe(subject.triangulation(), subject.constriction()) != from_scratch(subject.model()))
        fail("an object made from scratch has other triangles");
    for (const auto& [p, known] : subject.model()) {
        int where = side(subject.ring(), p);
        if (subject.cells().side(p) != where) fail("cells tell another side");
        if (subject.triangulation().is_flat() ? where != -1 : where < 0) fail("a point is outside");
    }
}

template <class Subject>
void run(Feed bytes) {
    Subject subject;
    while (!bytes.empty()) {
        std::size_t operation = bytes.byte() % 16;
        bool is_empty = subject.model().empty();
        if (operation < 4) {
            Point p = place(bytes);
            tell("insert", p);
            subject.insert({p});
        } else if (operation < 6) {
            std::vector<Point> batch(2 + bytes.byte() % 24);
            for (Point& p : batch) tell("together", p = place(bytes));
            subject.insert(batch);
        } else if (operation < 10 && !is_empty) {
            Point p = one_of(subject, bytes);
            tell("remove", p);
            subject.remove(p);
        } else if (operation == 10 && !is_empty) {
            Point from = one_of(subject, bytes), to = place(bytes);
            tell("move", from);
            tell("to", to);
            subject.move(from, to);
        } else if (operation == 11) {
            tell("look", {});
            subject.look();
        } else if (operation == 12) {
            tell("settle", {});
            subject.settle();
        } else if (operation == 13) {
            tell("check", {});
            subject.check();
        } else if (operation == 14) {
            tell("compare", {});
            compare(subject);
        } else if (operation == 15 && bytes.byte() < 8) {
            tell("clear", {});
            subject.clear();
        }
    }
    compare(subject);
    while (!subject.model().empty()) {  // and down to nothing
        subject.remove(one_of(subject, bytes));
        subject.check();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Feed bytes{data, size};
    if (bytes.byte() % 2 == 0) {
        run<Whole>(bytes);
    } else {
        run<Bare>(bytes);
    }
    return 0;
}
