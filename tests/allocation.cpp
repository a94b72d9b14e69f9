// The end of memory in the middle of a call leaves the object as before the call.
//
// operator new fails at the k-th allocation of a call, for k = 0, 1, 2, ... until the call gets by
// without it. After each failure the object is sound and has the points it had; the call made
// again, with memory, succeeds. The same with a second failure when the call is made again, for the
// first may have left some of the room that was to be made, and not all.
//
// Prints what broke, and fails if anything did.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <new>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "object.hpp"

namespace {

long countdown = -1;  // allocations until one fails; negative: never
unsigned rain = 0;    // if not 0, one allocation in so many fails, at random
std::minstd_rand dice;

void* allocate(std::size_t size) {
    if (countdown >= 0 && countdown-- == 0) throw std::bad_alloc();
    if (rain > 0 && dice() % rain == 0) throw std::bad_alloc();
    void* p = std::malloc(size);
    if (p == nullptr) throw std::bad_alloc();
    return p;
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
    std::free(allocate(1));  // counts, and may fail
    std::size_t unit = std::size_t(alignment);
    void* p = std::aligned_alloc(unit, (size + unit - 1) / unit * unit);
    if (p == nullptr) throw std::bad_alloc();
    return p;
}
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

using namespace flintknap;

namespace {

using Places = std::vector<Point>;
using Call = std::function<void(Object&)>;

void nothing_to_poll() {}

void insert(Object& object, const Places& points) {
    std::vector<std::int64_t> ids(points.size());
    object.insert(points.size(), [&](std::size_t n) { return points[n]; }, ids.data());
}

void remove(Object& object, Point p) { object.remove(object.points().find(p)); }

// All that users see: id, place and multiplicity of every point, and how often the set changed.
std::vector<double> state(const Object& object) {
    const Points& points = object.points();
    std::vector<double> seen;
    for (std::int64_t id : points.ids()) {
        Index h = points.find(id);
        Point p = points.point(h);
        seen.insert(seen.end(), {double(id), p.x, p.y, double(points.multiplicity(h))});
    }
    seen.push_back(double(points.size()));
    seen.push_back(double(points.revision()));
    seen.push_back(double(points.next_id()));
    return seen;
}

int broken = 0;

bool report(const std::string& name, long first, long second, const std::string& what) {
    ++broken;
    std::printf("%s, failing at allocation %ld", name.c_str(), first);
    if (second >= 0) std::printf(" and then %ld", second);
    std::printf(": %s\n", what.c_str());
    return true;
}

// Whether the call ran out of memory at its k-th allocation; false if it got by without it.
bool fails_at(long k, Object& object, const Call& call) {
    countdown = k;
    try {
        call(object);
    } catch (const std::bad_alloc&) {
        countdown = -1;
        return true;
    }
    countdown = -1;
    return false;
}

void settle(Object& object) {
    object.settle(nothing_to_poll);
    object.update_ring();
}

std::string settled_and_checked(Object& object) {
    settle(object);
    return object.check();
}

// `prepare` makes the object, `call` is watched: it fails at `first`, and made again at `second`
// if that is not negative, and made again succeeds. False if it got by without a first failure.
bool watch(const std::string& name, const Call& prepare, const Call& call, long first,
           long second) {
    Object expected, object;
    prepare(expected);
    std::vector<double> before = state(expected);
    call(expected);
    prepare(object);
    if (!fails_at(first, object, call)) return false;
    if (second >= 0 && !fails_at(second, object, call)) return true;
    if (state(object) != before) return report(name, first, second, "the set has changed");
    Object asked;
    prepare(asked);
    fails_at(first, asked, call);
    if (second >= 0) fails_at(second, asked, call);
    std::string wrong = settled_and_checked(asked);
    if (!wrong.empty()) return report(name, first, second, "asked at once: " + wrong);
    call(object);
    wrong = settled_and_checked(object);
    if (!wrong.empty()) return report(name, first, second, "made again: " + wrong);
    if (state(object) != state(expected)) return report(name, first, second, "made again: another");
    return true;
}

void watch_all(const std::string& name, const Call& prepare, const Call& call) {
    int before = broken;  // what is broken may crash
    for (long k = 0; broken == before && watch(name, prepare, call, k, -1); ++k) {
        for (long again = 0; broken == before && again < 3; ++again)
            watch(name, prepare, call, k, again);
    }
}

// ---------------------------------------------------------------------------------- sets
// The same on every run, and in no order.
Places scattered(std::size_t n) {
    Places points;
    for (std::size_t i = 0; i < n; ++i) {
        points.push_back({double(mix(2 * i) >> 40), double(mix(2 * i + 1) >> 40)});
    }
    return points;
}

Places line(int n) {
    Places points;
    for (int i = 0; i < n; ++i) points.push_back({double(i * 7 % n), 0});
    return points;
}

Call settled_set(const Places& points) {
    return [=](Object& object) {
        insert(object, points);
        settle(object);
    };
}

// Placed one by one, so that no array has more room than it had to have.
Call grown_set(const Places& points) {
    return [=](Object& object) {
        for (Point p : points) {
            object.insert(p);
            settle(object);
        }
    };
}

// Both trees, down to a level or to no error.
Call approximate(Index level) {
    return [=](Object& object) {
        settle(object);
        if (object.ring().empty()) return;
        for (Hierarchy* tree : {&object.hierarchy(), &object.farthest()}) {
            tree->cut({level, 0}, nothing_to_poll, [](const Hierarchy::Edge&) {});
        }
    };
}

// Where some places lie, by cells that are made for them.
void ask(Object& object) {
    settle(object);
    for (Point p : {Point{0, 0}, Point{0.3, 0.2}, Point{0.1, -0.4}}) object.cells().side(p);
}

Places with(Places points, const Places& more) {
    points.insert(points.end(), more.begin(), more.end());
    return points;
}

// Calls again until it gets by without memory at its k-th allocation, k = 0, 1, 2, ...
bool insist(Object& object, const Call& call) {
    std::vector<double> before = state(object);
    for (long k = 0; fails_at(k, object, call); ++k) {
        if (state(object) != before) return false;
    }
    return true;
}

// Every allocation of every call fails once while a set grows and while it shrinks again: room that
// a failed call left half made is not missed later.
void grow_and_shrink(const Places& points) {
    Object object;
    auto place = [](Object& o) { o.place(nothing_to_poll); };
    for (Point p : points) {
        insist(object, [=](Object& o) { o.insert(p); });
        if (!insist(object, place)) report("grow", 0, -1, "the set has changed");
    }
    std::string wrong = settled_and_checked(object);
    for (Point p : points) {
        if (!wrong.empty()) break;
        if (!insist(object, [=](Object& o) { remove(o, p); })) wrong = "the set has changed";
    }
    if (wrong.empty()) wrong = settled_and_checked(object);
    if (!wrong.empty()) report("grow and shrink", 0, -1, wrong);
}

// The ring as results hold it, followed.
void outline(Object& object) {
    settle(object);
    object.follow();
    object.update_outline();
}

// Who follows a ring by what is told of it.
struct Follower {
    std::int64_t revision = -1;
    std::map<Id, Id> next;

    void ask(Object& object) {
        outline(object);
        Notes::Difference found = object.changes(revision);
        if (!found.is_known) {
            next = links(object);
        } else {
            std::map<Id, Id> told = next;
            for (Id id : found.left) told.erase(id);
            for (const Notes::Run& run : found.runs) {
                Id last = object.id(run.after);
                for (std::size_t i = run.begin; i < run.end; ++i) {
                    Id id = object.id(found.fresh[i]);
                    told[last] = id;
                    last = id;
                }
                told[last] = object.id(run.before);
            }
            next.swap(told);
        }
        revision = object.points().revision();
    }
    static std::map<Id, Id> links(const Object& object) {
        std::map<Id, Id> all;
        Index v = object.smallest();
        for (Index i = 0; i < object.ring_size(); ++i, v = object.following(v)) {
            all[object.id(v)] = object.id(object.following(v));
        }
        return all;
    }
};

// Whatever comes, with any allocation failing: a call that failed has not changed the set.
void storm(std::uint64_t seed) {
    std::string name = "storm " + std::to_string(seed);
    std::size_t most = seed % 3 == 0 ? 1200 : 40;
    std::uint64_t next = mix(seed);
    auto random = [&](std::size_t n) { return at(Index((next = mix(next)) % n)); };
    auto anywhere = [&] {
        return Point{double(random(40)), double(random(seed % 2 == 0 ? 2 : 40))};
    };
    Object object;
    insert(object, scattered(most));
    Follower follower;
    for (int step = 0; step < 600; ++step) {
        const Points& points = object.points();
        std::vector<std::int64_t> ids = points.ids();
        Index some = ids.empty() ? kNone : points.find(ids[random(ids.size())]);
        Point to = anywhere();
        Places batch(random(8));
        for (Point& p : batch) p = anywhere();
        bool shrinks = step / 150 % 2 == 0;
        std::size_t what = random(10);
        std::vector<double> before = state(object);
        rain = 1 + unsigned(random(12));
        dice.seed(unsigned(next));
        bool failed = false;
        try {
            if (what == 0) settle(object);
            if (what == 1) object.place(nothing_to_poll);
            if (what == 2) insert(object, batch);
            if (what == 3 && some != kNone) object.move(some, to);
            if (what == 4 || (what > 4 && what < 8 && !shrinks)) object.insert(to);
            if (what == 8) approximate(Index(random(12)))(object);
            if (what == 9) follower.ask(object);
            if (what > 4 && what < 8 && shrinks && some != kNone) object.remove(some);
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        rain = 0;
        if (failed && state(object) != before) {
            report(name, step, -1, "the set has changed by operation " + std::to_string(what));
            return;
        }
        std::string wrong = step % 7 == 0 ? settled_and_checked(object) : "";
        if (what == 9 && !failed && follower.next != Follower::links(object))
            wrong = "wrong changes";
        if (!wrong.empty()) {
            report(name, step, -1, wrong);
            return;
        }
    }
}

}  // namespace

int main() {
    std::setvbuf(stdout, nullptr, _IOLBF, 1024);  // what broke is seen before what crashed
    Places some = scattered(60), many = scattered(2200), far = {{-1, -1}};
    Places circle;
    for (int x = -65; x <= 65; ++x) {
        for (int y = -65; y <= 65; ++y) {
            if (x * x + y * y == 65 * 65) circle.push_back({double(x), double(y)});
        }
    }
    auto insert_far = [=](Object& object) { insert(object, far); };
    auto remove_one = [](Point p) { return [=](Object& object) { remove(object, p); }; };

    // recording
    for (std::size_t n : {0U, 1U, 5U, 11U, 12U, 23U, 24U, 48U, 60U}) {
        std::string name = "insert on top of " + std::to_string(n);
        Places first(some.begin(), some.begin() + std::ptrdiff_t(n));
        watch_all(name, settled_set(first), [](Object& o) { o.insert({-1, -1}); });
        watch_all(name + ", many", grown_set(first), [=](Object& o) { insert(o, many); });
    }

    // settling: from scratch, by repair, on a line, off it
    watch_all("settle a set", [=](Object& o) { insert(o, some); }, settle);
    watch_all("settle one more", [=](Object& o) { settled_set(some)(o), insert_far(o); }, settle);
    for (int n = 1; n <= 20; ++n) {
        Places more(many.begin() + 2000, many.begin() + 2000 + n);
        Places base(many.begin(), many.begin() + 1500);
        if (n <= 2) {
            watch_all(
                "repair " + std::to_string(n),
                [=](Object& o) { settled_set(base)(o), insert(o, more); }, settle);
        }
        watch_all(
            "settle off a line of " + std::to_string(n),
            [=](Object& o) { grown_set(line(n))(o), o.insert({1, 1}); }, settle);
    }

    // places: the first questions, and changes after them
    watch_all("ask a few", grown_set(some), ask);
    watch_all("ask many", settled_set(many), ask);
    watch_all(
        "change what was asked",
        [=](Object& o) { settled_set(many)(o), ask(o), insert(o, {{9, 9}, {0.3, 0.2}}); }, ask);

    // removal: waiting, inside, of the hull, of a high degree, back to a line, on a line
    watch_all("remove one that waits", [=](Object& o) { insert(o, some); }, remove_one(some[3]));
    for (std::size_t n : {0U, 1U, 7U, 30U, 59U}) {
        watch_all("remove " + std::to_string(n), grown_set(some), remove_one(some[n]));
        watch_all("remove " + std::to_string(n) + " of many", settled_set(many),
                  remove_one(many[n]));
    }
    watch_all("remove a centre", settled_set(with(circle, {{0, 0}})), remove_one({0, 0}));
    watch_all("remove a grown centre", grown_set(with({{0, 0}}, circle)), remove_one({0, 0}));
    for (int n : {2, 3, 5, 9, 20, 40}) {
        std::string name = "remove the apex over a line of " + std::to_string(n);
        Places apex = {{0.5, 9}}, beyond = {{0.5, -9}};
        watch_all(name, grown_set(with(apex, line(n))), remove_one(apex[0]));
        watch_all(name + ", settled", settled_set(with(apex, line(n))), remove_one(apex[0]));
        watch_all(name + ", with one beyond", grown_set(with(with(apex, beyond), line(n))),
                  remove_one(apex[0]));
        watch_all("remove from a line of " + std::to_string(n), grown_set(line(n)),
                  remove_one({1, 0}));
    }

    // moves
    for (std::size_t n : {0U, 11U, 23U, 47U}) {
        Places first(some.begin(), some.begin() + std::ptrdiff_t(n + 1));
        auto move = [=](Object& o) { o.move(o.points().find(some[n]), {-1, -1}); };
        auto onto = [=](Object& o) { o.move(o.points().find(some[n]), some[0]); };
        std::string name = "move the last of " + std::to_string(n + 1);
        watch_all(name, grown_set(first), move);
        watch_all(name + ", waiting", [=](Object& o) { insert(o, first); }, move);
        watch_all(name + ", there twice", [=](Object& o) { insert(o, with(first, first)); }, move);
        watch_all(name + " onto another", grown_set(first), onto);
    }

    // changes that wait for a repair, and then one more
    watch_all(
        "settle after a removal",
        [=](Object& o) { settled_set(many)(o), remove(o, many[5]), remove(o, many[9]); }, settle);
    watch_all(
        "settle after one came and one left",
        [=](Object& o) { settled_set(many)(o), remove(o, many[5]), insert_far(o); }, settle);
    watch_all(
        "remove after a removal", [=](Object& o) { settled_set(many)(o), remove(o, many[5]); },
        remove_one(many[9]));

    // approximations: of a set, and after changes to one
    Places enough(many.begin(), many.begin() + 1100);
    watch_all("approximate", settled_set(some), approximate(99));
    watch_all(
        "approximate after one came and one left",
        [=](Object& o) {
            settled_set(enough)(o), approximate(99)(o);
            remove(o, enough[5]), insert_far(o);
        },
        approximate(4));

    // the ring as results hold it
    watch_all("outline", settled_set(enough), outline);
    watch_all(
        "outline after one came and one left",
        [=](Object& o) {
            settled_set(enough)(o), outline(o), outline(o);
            remove(o, enough[5]), insert_far(o);
        },
        outline);

    // slots and hints are used again
    watch_all(
        "remove the last of all",
        [=](Object& o) {
            grown_set(some)(o);
            for (std::size_t n = 1; n < some.size(); ++n) remove(o, some[n]);
        },
        remove_one(some[0]));
    watch_all(
        "insert where all have left",
        [=](Object& o) {
            grown_set(some)(o);
            for (Point p : some) remove(o, p);
        },
        [=](Object& o) { insert(o, some); });
    grow_and_shrink(many);
    for (std::uint64_t seed = 0; seed < 24; ++seed) storm(seed);
    return broken == 0 ? 0 : 1;
}
