// From ids, which count up for ever, to the few that are alive.
//
// Theory. Ids are handed out in order and mostly leave in about that order, so an array of pages
// with the empty ones dropped, and the front cut off, stays as small as what is alive. A look-up is
// two loads.
//
// Invariants (check): a page counts its living ids; but for the newest, no page is empty.
// Cost: O(1); 4 bytes an id in a page of 256 that has one alive, 8 bytes a page besides.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "mesh.hpp"

namespace flintknap {

class Ids {
   public:
    // The first id to hand out.
    explicit Ids(std::int64_t next) : Ids(next, next) {}
    // The same, to restore those from `first` on that are alive.
    Ids(std::int64_t first, std::int64_t next) : first_(first - first % kPage), next_(next) {}

    std::int64_t next() const { return next_; }

    // Room for n more, found before anything is changed.
    void make_room(std::size_t n) {
        if (n == 0) return;
        std::size_t last = page(next_ + static_cast<std::int64_t>(n) - 1);
        while (pages_.size() <= last) pages_.push_back(nullptr);
        for (std::size_t p = page(next_); p <= last; ++p) {
            if (pages_[p] == nullptr) pages_[p] = std::make_unique<Page>();
        }
    }

    // Hands out the next id, for `value`. make_room first.
    std::int64_t add(Index value) {
        Page& p = *pages_[page(next_)];
        p.value[slot(next_)] = value;
        ++p.alive;
        return next_++;
    }

    // The value of an id, or kNone if it is not alive.
    Index find(std::int64_t id) const {
        if (id < first_ || page(id) >= pages_.size() || pages_[page(id)] == nullptr) return kNone;
        return pages_[page(id)]->value[slot(id)];
    }

    // Ends an id that is alive; it is never handed out again.
    void remove(std::int64_t id) {
        std::unique_ptr<Page>& p = pages_[page(id)];
        p->value[slot(id)] = kNone;
        if (--p->alive > 0 || page(id) >= page(next_)) return;
        p.reset();
        while (!pages_.empty() && pages_.front() == nullptr) {
            pages_.pop_front();
            first_ += kPage;
        }
    }

    // Brings back an id that had been handed out.
    void restore(std::int64_t id, Index value) {
        while (pages_.size() <= page(id)) pages_.push_back(nullptr);
        std::unique_ptr<Page>& p = pages_[page(id)];
        if (p == nullptr) p = std::make_unique<Page>();
        p->value[slot(id)] = value;
        ++p->alive;
    }

    // All that are alive, ascending.
    std::vector<std::int64_t> all() const {
        std::vector<std::int64_t> out;
        for (std::size_t n = 0; n < pages_.size(); ++n) {
            for (std::size_t i = 0; pages_[n] != nullptr && i < pages_[n]->value.size(); ++i) {
                if (pages_[n]->value[i] == kNone) continue;
                out.push_back(first_ + static_cast<std::int64_t>(n * pages_[n]->value.size() + i));
            }
        }
        return out;
    }

    std::size_t bytes() const {
        std::size_t sum = pages_.size() * sizeof(void*);
        for (const auto& p : pages_) sum += p == nullptr ? 0 : sizeof(Page);
        return sum;
    }

   private:
    static constexpr std::int64_t kPage = 256;

    struct Page {
        std::array<Index, kPage> value;
        std::size_t alive = 0;
        Page() { value.fill(kNone); }
    };

    std::size_t page(std::int64_t id) const {
        return static_cast<std::size_t>((id - first_) / kPage);
    }
    static std::size_t slot(std::int64_t id) { return static_cast<std::size_t>(id % kPage); }

    std::deque<std::unique_ptr<Page>> pages_;
    std::int64_t first_;  // of the front page; a multiple of kPage
    std::int64_t next_;
};

}  // namespace flintknap
