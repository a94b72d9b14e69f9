// The timeline against a plain list, through random inserts, removals and moves of runs.
//
// Keys are few, so that they tie, and rise or fall along the list now and then. They are small
// numbers, of either sign and both zeros, or differ by less than 32 bits can tell, or are so large
// or small that these cannot hold them. Prints what broke, and fails if anything did.
#include "timeline.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

using namespace flintknap;

namespace {

[[noreturn]] void fail(const std::string& what) {
    std::printf("%s\n", what.c_str());
    std::exit(1);
}
void expect(bool holds, const char* what) {
    if (!holds) fail(what);
}

struct Keys {
    std::vector<double> keys;
    double key(Index e) const { return keys[at(e)]; }
    bool smaller(Index a, Index b) const { return key(a) != key(b) ? key(a) < key(b) : a < b; }
};

class Model {
   public:
    explicit Model(unsigned seed) : kind_(seed % 4), dice_(seed) {}

    void start(std::size_t n) {
        list_.clear();
        keys_.keys.clear();
        waits_.clear();
        free_.clear();
        for (std::size_t i = 0; i < n; ++i) list_.push_back(new_event(i));
        timeline_.assign(n, [&](std::size_t i) { return list_[i]; });
        begin_time();
    }

    void insert() { put(random(list_.size() + 1)); }
    // Where the last one came, so that labels run out there.
    void insert_again(std::size_t times) {
        std::size_t place = random(list_.size() + 1);
        while (times-- > 0) put(place);
    }
    void put(std::size_t place) {
        Index e = new_event(random(40));
        timeline_.insert(e, keys_.key(e), event(place));
        list_.insert(list_.begin() + std::ptrdiff_t(place), e);
    }
    // Some of those from a place on, given in no order; two are left.
    void erase() {
        std::size_t from = random(list_.size()), dense = 1 + random(3);
        std::size_t most = std::min(1 + random(40), list_.size() - 2);
        std::vector<Index> gone, left;
        for (std::size_t i = 0; i < list_.size(); ++i) {
            bool goes = i >= from && gone.size() < most && random(dense) == 0;
            (goes ? gone : left).push_back(list_[i]);
        }
        std::shuffle(gone.begin(), gone.end(), dice_);
        for (Index e : list_) {  // none may wait then
            waits_[at(e)] = false;
            timeline_.set_waiting(e, false);
        }
        Array<Index> events;
        for (Index e : gone) {
            events.push_back(e);
            free_.push_back(e);
        }
        timeline_.erase(events);
        list_ = left;
        begin_time();
    }
    void move(std::size_t longest) {
        std::size_t n = 1 + random(std::min(longest, list_.size() - 1));
        std::size_t first = random(list_.size() - n + 1), to = random(list_.size() - n + 1);
        if (to > first) to += n;
        if (to == first) return;
        timeline_.move(list_[first], list_[first + n - 1], event(to));
        auto begin = list_.begin();
        auto [a, b, c] =
            to < first ? std::array{to, first, first + n} : std::array{first, first + n, to};
        std::rotate(begin + std::ptrdiff_t(a), begin + std::ptrdiff_t(b),
                    begin + std::ptrdiff_t(c));
    }
    // Some event is the present, through whatever changes, until events are erased.
    void begin_time() { timeline_.set_present(list_[random(list_.size())]); }
    void wait() {
        Index e = list_[random(list_.size())];
        waits_[at(e)] = !waits_[at(e)];
        timeline_.set_waiting(e, waits_[at(e)]);
    }

    void compare() {
        std::size_t i = random(list_.size()), k = random(list_.size());
        expect(timeline_.before(list_[i], list_[k]) == (i < k), "the order is another one");
        auto now = std::find(list_.begin(), list_.end(), timeline_.present()) - list_.begin();
        expect(timeline_.is_past_or_present(list_[i]) == (static_cast<std::ptrdiff_t>(i) <= now),
               "what is past is another one");
        expect(timeline_.next(list_[i]) == event(i + 1), "what is next is another one");
        expect(timeline_.previous(list_[i]) == (i == 0 ? kNone : list_[i - 1]),
               "what was before is another one");
        expect(timeline_.last() == list_.back(), "the last is another one");
        Index wanted = list_[k];
        auto reaches = [&](Index e) { return !keys_.smaller(e, wanted); };
        auto found = std::find_if(list_.begin() + std::ptrdiff_t(i) + 1, list_.end(), reaches);
        Index first = timeline_.first_after(list_[i], keys_.key(wanted), reaches);
        expect(first == (found == list_.end() ? kNone : *found), "the first as large is wrong");
        found = std::find_if(list_.begin(), list_.end(), [&](Index e) { return waits_[at(e)]; });
        expect(timeline_.first_waiting() == (found == list_.end() ? kNone : *found),
               "the first that waits is another one");
        expect(timeline_.waits(list_[i]) == waits_[at(list_[i])], "wrong about who waits");
    }
    void check() const {
        std::string broken = timeline_.check();
        if (!broken.empty()) fail(broken);
        auto cursor = timeline_.cursor(list_.front());
        for (std::size_t i = 0; i < list_.size(); ++i, cursor.advance()) {
            expect(cursor.event() == list_[i], "the list is another one");
            Index ahead = cursor.ahead(3);
            expect(ahead == kNone || ahead == event(i + 3), "what is ahead is another one");
        }
        expect(cursor.event() == kNone, "the list is longer");
    }

    std::size_t random(std::size_t n) { return dice_() % n; }
    std::size_t size() const { return list_.size(); }

   private:
    Index event(std::size_t place) const { return place < list_.size() ? list_[place] : kNone; }
    Index new_event(std::size_t key) {
        Index e = static_cast<Index>(waits_.size());
        if (free_.empty()) {
            keys_.keys.push_back(0);
            waits_.push_back(false);
        } else {
            e = free_.back();
            free_.pop_back();
        }
        keys_.keys[at(e)] = key_of_kind(static_cast<double>(key % 40));
        return e;
    }
    double key_of_kind(double small) const {
        switch (kind_) {
            case 0: return small == 21 ? -0.0 : small - 20;
            case 1: return 1 + small * 0x1p-52;
            case 2: return (small - 20) * 1e300;
            default: return (small - 20) * 0x1p-1074;
        }
    }

    unsigned kind_;
    std::mt19937 dice_;
    Keys keys_;
    std::vector<Index> list_, free_;
    std::vector<bool> waits_;
    Timeline<Keys> timeline_{keys_};
};

}  // namespace

int main(int, char** arguments) {
    unsigned first = static_cast<unsigned>(std::atoi(arguments[1]));
    unsigned count = static_cast<unsigned>(std::atoi(arguments[2]));
    for (unsigned seed = first; seed < first + count; ++seed) {
        Model model(seed);
        model.start(2 + model.random(seed % 3 == 0 ? 20000 : 300));
        std::size_t growth = model.random(3);
        for (int step = 0; step < 600; ++step) {
            if (step % 100 == 0) growth = model.random(3);
            std::size_t what = model.random(5);
            if (what <= growth)
                model.insert();
            else if (what < 3 && model.size() > 2)
                model.erase();
            else if (what == 3)
                model.move(
                    std::array{std::size_t{20}, std::size_t{200}, model.size()}[model.random(3)]);
            else
                model.wait();
            model.compare();
            if (step % 50 == 0) model.check();
        }
        model.check();
        if (seed % 25 != 0) continue;
        model.insert_again(40000);
        model.check();
    }
}
