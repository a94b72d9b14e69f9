// Rows of ids against a plain sort of the same: ids without gaps, with some, and too far apart for
// numbers of 31 bits.
#include "rows.hpp"

#include <algorithm>
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

using namespace flintknap;

static bool agrees(std::mt19937_64& rng, Index sites, std::int64_t gap, std::size_t pairs) {
    std::vector<std::int64_t> ids(at(sites));
    std::int64_t id = static_cast<std::int64_t>(rng() % 1000);
    for (std::int64_t& each : ids) {
        each = id;
        id += 1 + static_cast<std::int64_t>(rng() % static_cast<std::uint64_t>(gap));
    }
    std::vector<std::int64_t> id_in_slot = ids;
    std::shuffle(id_in_slot.begin(), id_in_slot.end(), rng);
    auto slot_of = [&](std::int64_t wanted) {
        return static_cast<Index>(std::find(id_in_slot.begin(), id_in_slot.end(), wanted) -
                                  id_in_slot.begin());
    };
    Large<Couple> couples;
    std::vector<std::pair<std::int64_t, std::int64_t>> expected;
    for (std::size_t n = 0; n < pairs; ++n) {
        auto any = [&] { return static_cast<Index>(rng() % at(sites)); };
        Couple c{any(), any()};
        couples.push_back(c);
        expected.push_back(std::minmax({id_in_slot[at(c.first)], id_in_slot[at(c.second)]}));
    }
    std::sort(expected.begin(), expected.end());
    Large<std::int64_t> rows = sorted_rows(std::move(couples), Numbers(ids, sites, slot_of));
    bool is_same = rows.size() == 2 * pairs;
    for (std::size_t n = 0; n < pairs && is_same; ++n) {
        is_same = std::pair{rows[2 * n], rows[2 * n + 1]} == expected[n];
    }
    if (!is_same) {
        std::printf("%d sites, gaps up to %lld, %zu pairs: wrong\n", sites,
                    static_cast<long long>(gap), pairs);
    }
    return is_same;
}

int main() {
    std::mt19937_64 rng(1);
    bool all = sorted_rows({}, Numbers({}, 0, [](std::int64_t) { return 0; })).empty();
    for (Index sites : {1, 2, 3, 2047, 2048, 2049, 3000}) {
        for (std::int64_t gap : {1, 3, 1400, 100000, 3000000}) {
            for (std::size_t pairs : {0, 1, 5000}) all = agrees(rng, sites, gap, pairs) && all;
        }
    }
    return all ? 0 : 1;
}
