// Events in order of time: which of two comes first, which is the next with a key as large, which
// is the first that waits.
//
// Theory. A B+-tree of blocks (blocks.hpp). The next event with a large key is found by going up to
// where there is one, and down; the first that waits by going down from the root. Where the present
// is, with which many are compared, is looked up once and known until something changes.
//
// Events that follow each other are moved by taking them out of their leaves and putting them into
// others, some at a time. A long run is moved whole: the tree is cut before it, behind it and where
// it goes, and the pieces are glued together:
//
//     [ head | run | middle | tail ]   ==>   [ head | middle | run | tail ]
//            ^     ^        ^
//          first  behind  other            before these the tree was cut
//
// Invariants (check), exceptions: those of blocks.hpp.
// Cost: before, next O(1); all else O(log n), and a label for some thousand events that move.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "blocks.hpp"

namespace flintknap {

template <class Keys>
class Timeline : public Blocks<Keys> {
   public:
    using Blocks<Keys>::Blocks;

    // Whether a comes before b. O(1).
    bool before(Index a, Index b) const {
        Index p = leaf_of(a), q = leaf_of(b);
        return p == q ? before_in_leaf(p, a, b) : orders_[at(p)] < orders_[at(q)];
    }

    // The present, and whether an event comes no later. O(1), less than before(present(), e).
    Index present() const { return present_.event; }
    void set_present(Index e) { present_ = {e, kNone, 0, 0}; }
    bool is_past_or_present(Index e) const {
        if (present_.leaf == kNone) locate_present();
        Index n = leaf_of(e);
        return n == present_.leaf ? is_past_in_leaf(e) : orders_[at(n)] < present_.order;
    }

    // The neighbours of an event, or kNone.
    Index next(Index e) const {
        Index n = leaf_of(e), i = place_in(n, e) + 1;
        if (i < node(n).count) return node(n).items[i];
        n = node_behind(n);
        return n == kNone ? kNone : node(n).items[0];
    }
    Index previous(Index e) const {
        Index n = leaf_of(e), i = place_in(n, e);
        if (i > 0) return node(n).items[i - 1];
        n = node_before(n);
        return n == kNone ? kNone : node(n).items[node(n).count - 1];
    }
    Index last() const {
        Index n = last_in(root_, 0);
        return node(n).items[node(n).count - 1];
    }

    // A place in the sequence, to go along it from an event on; good until something changes.
    class Cursor {
       public:
        Cursor(const Timeline& timeline, Index e)
            : timeline_(&timeline),
              leaf_(timeline.leaf_of(e)),
              place_(timeline.place_in(leaf_, e)) {}
        // The event there, or kNone behind the last one.
        Index event() const {
            return leaf_ == kNone ? kNone : timeline_->node(leaf_).items[place_];
        }
        // One that is some places further on, if it is near, else kNone.
        Index ahead(Index places) const {
            if (leaf_ == kNone || place_ + places >= timeline_->node(leaf_).count) return kNone;
            return timeline_->node(leaf_).items[place_ + places];
        }
        void advance() {
            if (++place_ < timeline_->node(leaf_).count) return;
            leaf_ = timeline_->node_behind(leaf_);
            place_ = 0;
        }

       private:
        const Timeline* timeline_;
        Index leaf_, place_;
    };
    Cursor cursor(Index e) const { return {*this, e}; }

    // The first event after e that `reaches`, or kNone. Those do whose keys are larger than `key`,
    // and of those whose key it is, the larger ones by smaller() may.
    template <class F>
    Index first_after(Index e, double key, F&& reaches) const {
        Index n = leaf_of(e), i = place_in(n, e) + 1;
        Coarse coarse = coarse_key(key);
        while ((i = first_item(n, i, coarse, reaches)) == node(n).count) {
            i = node(n).place + 1;
            n = node(n).parent;
            if (n == kNone) return kNone;
        }
        while (node(n).height > 0) {
            n = node(n).items[i];
            i = first_item(n, 0, coarse, reaches);
        }
        return node(n).items[i];
    }

    // Whether an event waits; the first that does, or kNone. None does at first.
    bool waits(Index e) const { return bit(leaf_of(e), place_in(leaf_of(e), e)); }
    Index first_waiting() const {
        Index n = root_;
        if (node(n).waiting == 0) return kNone;
        while (node(n).height > 0) n = node(n).items[first_bit(node(n).waiting)];
        return node(n).items[first_bit(node(n).waiting)];
    }
    void set_waiting(Index e, bool waits) {
        Index n = leaf_of(e), i = place_in(n, e);
        if (bit(n, i) == waits) return;
        set_bit(n, i, waits);
        tell_who_waits(n);
    }

    // Puts a new event, with its key, before another one, or behind the last (kNone).
    void insert(Index e, double key, Index other) {
        forget_present();
        admit(e);
        Lifted one;
        one.add(e, coarse_key(key));
        put(one, other);
    }

    // Takes events out, those of a leaf at once. Not the whole tree, and not while some wait: those
    // that are to go are noted as such meanwhile.
    void erase(const Array<Index>& events) {
        forget_present();
        leaves_.clear();
        for (std::size_t i = 0; i < events.size(); ++i) {
            fetch_ahead(events, i);
            Index e = events[i], n = leaf_of(e);
            if (node(n).waiting == 0) leaves_.push_back(n);
            set_bit(n, place_in(n, e), true);
            unseat(e);
        }
        for (Index& n : leaves_) {
            sift(n);
            n = correct(n);
        }
        for (Index n : leaves_) {
            if (!is_free(n)) join_up(n);
        }
    }

    // Moves the run of events from `first` to `last` before another one that is not in it, or
    // behind all (kNone). Not the whole tree.
    void move(Index first, Index last, Index other) {
        forget_present();
        if (is_short(first, last)) {
            while (first != kNone) {
                Lifted some;
                first = lift(some, first, last);
                put(some, other);
            }
            return;
        }
        Index behind = next(last);
        auto [head, run] = cut_before(first);
        if (behind != kNone) {
            auto [middle, tail] = cut_before(behind);
            run = middle;
            head = glue(head, tail);
        }
        if (other == kNone) {
            head = glue(head, run);
        } else {
            auto [left, right] = cut_before(other);
            head = glue(glue(left, run), right);
        }
        set_root(head);
        if (node(root_).height == 0) return;
        for (Index n = twig_of(first), end = node_behind(twig_of(last)); n != end;
             n = node_behind(n)) {
            nodes_[at(n)].label = 0;
        }
        for (Index e : {first, behind, other}) {  // before each the tree was cut
            if (e == kNone) continue;
            Index twig = twig_of(e), after = node_behind(twig);
            label(twig);
            if (after != kNone) label(after);
        }
    }

   private:
    using Base = Blocks<Keys>;
    using Base::admit;
    using Base::as_bits;
    using Base::bit;
    using Base::bits_below;
    using Base::close;
    using Base::cut_before;
    using Base::first_bit;
    using Base::glue;
    using Base::halve;
    using Base::has_seat;
    using Base::is_free;
    using Base::join_with_next;
    using Base::key_of;
    using Base::keys_;
    using Base::kRoom;
    using Base::label;
    using Base::largest_in;
    using Base::last_in;
    using Base::leaf_of;
    using Base::node;
    using Base::node_before;
    using Base::node_behind;
    using Base::nodes_;
    using Base::open;
    using Base::orders_;
    using Base::place_in;
    using Base::pull;
    using Base::release;
    using Base::root_;
    using Base::set_bit;
    using Base::set_root;
    using Base::settle;
    using Base::tell_parent;
    using Base::tell_who_waits;
    using Base::twig_of;
    using Base::unseat;

    Array<Index> leaves_;  // of those that are taken out

    // This one and others stand by themselves, so that what is done mostly, which is short, needs
    // no registers saved.
    [[gnu::noinline]] bool before_in_leaf(Index n, Index a, Index b) const {
        return place_in(n, a) < place_in(n, b);
    }
    // Where the present is; its leaf is kNone until that is asked for, and after every change.
    struct Present {
        Index event, leaf, place;
        std::uint64_t order;
    };
    [[gnu::noinline]] void locate_present() const {
        Index n = leaf_of(present_.event);
        present_.place = place_in(n, present_.event);
        present_.order = orders_[at(n)];
        present_.leaf = n;
    }
    [[gnu::noinline]] bool is_past_in_leaf(Index e) const {
        return place_in(present_.leaf, e) <= present_.place;
    }
    void forget_present() { present_.leaf = kNone; }
    mutable Present present_ = {kNone, kNone, 0, 0};

    static constexpr Index kFew = kRoom / 2;   // events that are moved at once
    static constexpr Index kShort = 4 * kFew;  // so many are, one after the other

    // Some events that were one after the other, and as bits which of them wait.
    struct Lifted {
        Lifted() {}  // and arrays are left as they are

        Index events[kFew];
        Coarse keys[kFew];
        Index count = 0;
        std::uint64_t waiting = 0;

        void add(Index e, Coarse key) {
            keys[count] = key;
            events[count++] = e;
        }
    };

    // The first item from the i-th on that is or has an event that reaches, or the count.
    template <class F>
    Index first_item(Index n, Index i, Coarse key, F&& reaches) const {
        const auto& x = node(n);
        for (; i < x.count; i += 16) {
            Index first = std::min(i, kRoom - 16);
            std::uint64_t large = ~std::uint64_t{Sixteen(x.keys + first).less(key)};
            large &= bits_below(std::min(x.count - first, 16)) & ~bits_below(i - first);
            for (; large != 0; large &= large - 1) {
                Index found = first + first_bit(large);
                if (x.keys[found] > key || reaches(largest_in(n, found))) return found;
            }
        }
        return x.count;
    }

    // Whether a run has no more than kShort events, about.
    bool is_short(Index first, Index last) const {
        Index n = leaf_of(first), end = leaf_of(last), seen = -place_in(n, first);
        for (; n != end; n = node_behind(n)) {
            seen += node(n).count;
            if (seen > kShort) return false;
        }
        return true;
    }

    // Takes out the first events of a run, as many as fit; not the whole tree. Returns the first of
    // the others, or kNone.
    Index lift(Lifted& some, Index first, Index last) {
        while (first != kNone && some.count < kFew) {
            Index n = leaf_of(first), i = place_in(n, first), end = node(n).count;
            Index behind = kNone;
            if (n == leaf_of(last)) {
                end = place_in(n, last) + 1;
            } else {
                behind = node(node_behind(n)).items[0];
            }
            if (end - i > kFew - some.count) {
                end = i + kFew - some.count;
                behind = node(n).items[end];
            }
            some.waiting |= (node(n).waiting >> i & bits_below(end - i)) << some.count;
            for (Index k = i; k < end; ++k) {
                some.add(node(n).items[k], node(n).keys[k]);
                unseat(node(n).items[k]);
            }
            remove(n, i, end - i);
            first = behind;
        }
        return first;
    }
    // Of a leaf k events, from the i-th on, which have no seats any more.
    void remove(Index n, Index i, Index k) {
        close(n, i, k);
        join_up(correct(n));
    }
    // Fetches what will be asked for of those events of which the i-th is next.
    [[gnu::always_inline]] void fetch_ahead(const Array<Index>& events, std::size_t i) const {
        constexpr std::size_t ahead = 8;
        if (i + 2 * ahead < events.size()) this->prefetch(events[i + 2 * ahead]);
        if (i + ahead < events.size()) this->prefetch_place(events[i + ahead]);
    }
    // Of a leaf those that are noted, in one pass.
    void sift(Index n) {
        auto& x = nodes_[at(n)];
        std::uint64_t gone = std::exchange(x.waiting, 0);
        Index kept = first_bit(gone);
        for (Index i = kept; i < x.count; ++i) {
            x.items[kept] = x.items[i];
            x.keys[kept] = x.keys[i];
            kept += static_cast<Index>(~gone >> i & 1);
        }
        x.count = static_cast<std::int8_t>(kept);
    }
    // Tells those above a leaf what has left it, and removes what is empty. Returns the lowest of
    // them that is not.
    Index correct(Index n) {
        while (node(n).count == 0) {
            Index p = node(n).parent;
            close(p, node(n).place, 1);
            release(std::exchange(n, p));
        }
        tell_who_waits(n);
        for (Index p = n; p != kNone && !has_seat(node(p).largest); p = node(p).parent) {
            pull(p);
            tell_parent(p);
        }
        return n;
    }
    // Joins what has become small, from a node upwards.
    void join_up(Index n) {
        for (; n != kNone; n = node(n).parent) join_with_next(n);
    }

    // Puts what was lifted before another event, or behind the last (kNone).
    void put(const Lifted& run, Index other) {
        Index neighbour = other == kNone ? last() : other, n = leaf_of(neighbour);
        if (node(n).count + run.count > kRoom) {
            halve(n);
            n = leaf_of(neighbour);
        }
        Index i = place_in(n, neighbour) + (other == kNone ? 1 : 0), best = 0;
        open(n, i, run.count);
        nodes_[at(n)].waiting |= run.waiting << i;
        for (Index k = 0; k < run.count; ++k) {
            nodes_[at(n)].items[i + k] = run.events[k];
            nodes_[at(n)].keys[i + k] = run.keys[k];
            settle(n, i + k);
            if (k > 0 && is_smaller(run.events[best], run.keys[best], run.events[k], run.keys[k])) {
                best = k;
            }
        }
        tell_who_waits(n);
        for (; n != kNone; n = node(n).parent) {
            Index p = node(n).parent, largest = node(n).largest;
            Coarse key = p == kNone ? key_of(n) : node(p).keys[node(n).place];
            if (!is_smaller(largest, key, run.events[best], run.keys[best])) return;
            nodes_[at(n)].largest = run.events[best];
            tell_parent(n);
        }
    }

    // By coarse keys, which are at hand, if they tell.
    bool is_smaller(Index a, Coarse key_of_a, Index b, Coarse key_of_b) const {
        return key_of_a != key_of_b ? key_of_a < key_of_b : keys_.smaller(a, b);
    }
};

}  // namespace flintknap
