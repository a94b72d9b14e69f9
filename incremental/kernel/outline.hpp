// The ring as results hold it: it never changes, and shares with others what they have in common.
//
// Theory. An outline is a row of pieces, each a stretch of some hundred vertices that never
// changes. When the ring has changed, a new outline takes over all whole pieces between the runs
// that differ (notes.hpp) and makes anew those in which runs begin or end:
//
//      then    [ A ][ B ][ C ][ D ][ E ]          the run that differs lies in C, say:
//      now     [ A ][ B ][ C'][ D ][ E ]          four of five pieces are the same objects
//
// Who holds an outline holds its pieces; they go with the last one. Arrays are made of them when
// somebody asks. Where runs put stretches of the ring in another order, pieces are taken in that
// order. Old positions follow from ranks now: a stretch is as long as it was, and how many vertices
// stood between the end of one and the beginning of another, the links tell that there were.
//
// Pieces also carry what was derived from their vertices (curve.hpp), as long as they live.
//
// Invariants (check): an outline brought up to date is the one made from scratch.
// Cost: from scratch O(n), 24 bytes a vertex; after a change O(changed + n / 128), a pointer each.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "array.hpp"
#include "notes.hpp"

namespace flintknap {

struct Arcs;

// Vertices in memory; pieces lie in it.
struct Stretch {
    Array<Id> ids;
    Array<Point> xy;

    void add(Id id, Point p) {
        ids.push_back(id);
        xy.push_back(p);
    }
};

struct Piece {
    Piece(std::shared_ptr<const Stretch> stretch, std::size_t from, std::size_t vertices)
        : in(std::move(stretch)),
          begin(from),
          count(vertices),
          first(in->xy[from]),
          last(in->xy[from + vertices - 1]) {}

    std::shared_ptr<const Stretch> in;
    std::size_t begin, count;
    Point first, last;                         // at hand for its neighbours
    mutable std::shared_ptr<const Arcs> arcs;  // in the turn of whose object it is

    const Id* ids() const { return in->ids.data() + begin; }
    const Point* xy() const { return in->xy.data() + begin; }
};

class Outline {
   public:
    using Pieces = std::vector<std::shared_ptr<const Piece>>;

    // From scratch.
    explicit Outline(Stretch&& all) {
        auto in = std::make_shared<const Stretch>(std::move(all));
        std::size_t n = in->ids.size(), parts = (n + kFill - 1) / kFill;
        for (std::size_t i = 0; i < parts; ++i) {
            std::size_t begin = i * n / parts, end = (i + 1) * n / parts;
            add(std::make_shared<Piece>(in, begin, end - begin));
        }
    }

    std::size_t size() const { return starts_.back(); }
    const Pieces& pieces() const { return pieces_; }
    // Where a piece begins along the ring.
    std::size_t start(std::size_t piece) const { return starts_[piece]; }
    // The memory that all vertices lie in, in order, or null if they lie in several.
    std::shared_ptr<const Stretch> whole() const {
        if (pieces_.empty()) return nullptr;
        const std::shared_ptr<const Stretch>& in = pieces_[0]->in;
        auto is_in = [&](const std::shared_ptr<const Piece>& p) { return p->in == in; };
        bool is_one =
            in->ids.size() == size() && std::all_of(pieces_.begin(), pieces_.end(), is_in);
        return is_one ? in : nullptr;
    }

    std::size_t bytes() const {
        return pieces_.size() * (sizeof(Piece) + sizeof(pieces_[0]) + sizeof(std::size_t)) +
               size() * (sizeof(Id) + sizeof(Point));
    }

    bool operator==(const Outline& other) const { return vertices() == other.vertices(); }

   private:
    friend class OutlineUpdate;
    static constexpr std::size_t kMost = 512, kFill = 384, kLeast = 128;  // vertices of a piece

    Outline() = default;

    void add(std::shared_ptr<const Piece> piece) {
        starts_.push_back(starts_.back() + piece->count);
        pieces_.push_back(std::move(piece));
    }
    void drop_last() {
        starts_.pop_back();
        pieces_.pop_back();
    }

    std::vector<std::pair<Id, std::pair<double, double>>> vertices() const {
        std::vector<std::pair<Id, std::pair<double, double>>> all;
        for (const auto& p : pieces_) {
            for (std::size_t i = 0; i < p->count; ++i)
                all.push_back({p->ids()[i], {p->xy()[i].x, p->xy()[i].y}});
        }
        return all;
    }

    Pieces pieces_;
    std::vector<std::size_t> starts_{0};  // of each piece, and the end
};

// Makes an outline of an older one and of what has changed since.
class OutlineUpdate {
   public:
    // The ring is up to date and not empty. Source: id(v), site(v), slot_of(id), on_ring(v).
    template <class Source>
    static std::shared_ptr<const Outline> make(const Outline& old, const Notes::Difference& changes,
                                               const Ring& ring, const Source& source) {
        OutlineUpdate update(old, changes);
        update.find_stretches(ring, source);
        update.put_in_order(ring);
        for (Part part : update.parts_) update.append(part, source);
        return update.finish();
    }

   private:
    // Vertices in order, of the outline there was or of the fresh ones.
    struct Part {
        bool is_fresh;
        std::size_t begin, count;
    };

    OutlineUpdate(const Outline& old, const Notes::Difference& changes)
        : old_(old), changes_(changes), made_(new Outline) {}

    // Of the stretch behind each run, from the run's end to the next run, length and old position.
    //
    //      now     a0 [run 0] b0 ==== a1 [run 1] b1 ==== a0 ...      stretches 0: b0 .. a1, 1: ...
    //      then    a0 - gap - b1 ==== ...                            behind a0 came stretch 1
    //
    template <class Source>
    void find_stretches(const Ring& ring, const Source& source) {
        const std::vector<Notes::Run>& runs = changes_.runs;
        std::size_t k = runs.size(), n = at(ring.size()), m = old_.size();
        std::vector<std::size_t> ranks(k);
        std::vector<std::pair<Id, std::size_t>> begins;  // of stretches, by id
        for (std::size_t i = 0; i < k; ++i) {
            ranks[i] = at(ring.rank(runs[i].before));
            begins.push_back({source.id(runs[i].before), i});
        }
        std::sort(begins.begin(), begins.end());
        for (std::size_t i = 0; i < k; ++i) {
            std::size_t end = at(ring.rank(runs[(i + 1) % k].after));
            lengths_.push_back((end + n - ranks[i]) % n + 1);
        }
        // The first vertex there was is at 0: it was in a gap, or is in a stretch.
        Id first = old_.pieces()[0]->ids()[0];
        std::size_t known = k, place = 0;
        std::vector<std::size_t> next(k), gaps(k, 0);  // behind the stretch before run i
        for (std::size_t i = 0; i < k; ++i) {
            Id id = changes_.follower(source.id(runs[i].after));
            auto begin =
                std::lower_bound(begins.begin(), begins.end(), std::pair{id, std::size_t{0}});
            for (; begin == begins.end() || begin->first != id; ++gaps[i]) {
                if (id == first) known = (i + k - 1) % k, place = 2 * m - gaps[i] - lengths_[known];
                id = changes_.follower(id);
                begin =
                    std::lower_bound(begins.begin(), begins.end(), std::pair{id, std::size_t{0}});
            }
            next[i] = begin->second;
        }
        if (known == k) {
            std::size_t rank = at(ring.rank(source.slot_of(first)));
            for (std::size_t i = 0; i < k; ++i) {
                std::size_t within = (rank + n - ranks[i]) % n;
                if (within < lengths_[i]) known = i, place = m - within;
            }
        }
        places_.resize(k);
        for (std::size_t i = 0, s = known; i < k; ++i) {
            places_[s] = place % m;
            std::size_t run = (s + 1) % k;
            place = places_[s] + lengths_[s] + gaps[run];
            s = next[run];
        }
    }

    // All parts from the smallest vertex on.
    void put_in_order(const Ring& ring) {
        const std::vector<Notes::Run>& runs = changes_.runs;
        std::size_t n = at(ring.size()), skip = n - at(ring.rank(runs[0].after)) - 1;
        std::vector<Part> all;
        for (std::size_t i = 0; i < runs.size(); ++i) {
            all.push_back({true, runs[i].begin, runs[i].end - runs[i].begin});
            std::size_t here = std::min(lengths_[i], old_.size() - places_[i]);
            all.push_back({false, places_[i], here});
            all.push_back({false, 0, lengths_[i] - here});
        }
        std::vector<Part> last;
        for (Part part : all) {
            std::size_t cut = std::min(skip, part.count);
            skip -= cut;
            last.push_back({part.is_fresh, part.begin, cut});
            parts_.push_back({part.is_fresh, part.begin + cut, part.count - cut});
        }
        parts_.insert(parts_.end(), last.begin(), last.end());
    }

    template <class Source>
    void append(Part part, const Source& source) {
        if (part.is_fresh) {
            for (std::size_t i = part.begin; i < part.begin + part.count; ++i) {
                Index v = changes_.fresh[i];
                loose_.add(source.id(v), source.site(v));
            }
            return;
        }
        std::size_t end = part.begin + part.count;
        auto after = std::upper_bound(old_.starts_.begin(), old_.starts_.end(), part.begin);
        std::size_t p = static_cast<std::size_t>(after - old_.starts_.begin()) - 1;
        for (std::size_t i = part.begin; i < end; i = old_.start(++p)) {
            const std::shared_ptr<const Piece>& piece = old_.pieces()[p];
            std::size_t from = i - old_.start(p);
            std::size_t to = std::min(end - old_.start(p), piece->count);
            bool is_whole = from == 0 && to == piece->count;
            if (is_whole && (loose_.ids.empty() || loose_.ids.size() >= Outline::kLeast)) {
                gather();
                made_->add(piece);
            } else {
                for (; from < to; ++from) loose_.add(piece->ids()[from], piece->xy()[from]);
            }
        }
    }

    // Makes pieces of what is loose.
    void gather() {
        std::size_t n = loose_.ids.size();
        if (n == 0) return;
        auto in = std::make_shared<const Stretch>(std::exchange(loose_, {}));
        std::size_t parts = n <= Outline::kMost ? 1 : (n + Outline::kFill - 1) / Outline::kFill;
        for (std::size_t i = 0; i < parts; ++i) {
            std::size_t begin = i * n / parts, end = (i + 1) * n / parts;
            made_->add(std::make_shared<Piece>(in, begin, end - begin));
        }
    }

    std::shared_ptr<const Outline> finish() {
        if (loose_.ids.size() < Outline::kLeast && !loose_.ids.empty() && !made_->pieces_.empty()) {
            std::shared_ptr<const Piece> piece = made_->pieces_.back();
            made_->drop_last();
            Stretch end = std::exchange(loose_, {});
            for (std::size_t i = 0; i < piece->count; ++i)
                loose_.add(piece->ids()[i], piece->xy()[i]);
            for (std::size_t i = 0; i < end.ids.size(); ++i) loose_.add(end.ids[i], end.xy[i]);
        }
        gather();
        return std::move(made_);
    }

    const Outline& old_;
    const Notes::Difference& changes_;
    std::vector<std::size_t> lengths_, places_;  // of the stretch behind each run, then
    std::vector<Part> parts_;
    Stretch loose_;
    std::shared_ptr<Outline> made_;
};

}  // namespace flintknap
