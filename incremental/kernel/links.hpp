// Which vertices may have got another place on the ring since somebody last looked.
//
// Whoever changes the ring says so here: every vertex on it whose following() has changed, and
// every slot that a new site has got. (Of one that left nothing need be said: who came before it is
// followed by another one now.) Saying too much does no harm, saying too little does. When there
// is more to say than is worth following, or nobody follows, all counts as changed.
#pragma once

#include <vector>

#include "mesh.hpp"

namespace flintknap {

class Links {
   public:
    void touch(Index v) {
        if (touched_.size() == limit_) return touch_all();
        touched_.push_back(v);
    }
    void touch_all() {
        touched_.clear();
        limit_ = 0;
    }

    // All may have changed, and touched() tells nothing.
    bool all() const { return limit_ == 0; }
    bool none() const { return limit_ > 0 && touched_.empty(); }
    const std::vector<Index>& touched() const { return touched_; }

    // Hands over what was said; until restart all counts as changed.
    void take(std::vector<Index>& touched) {
        touched.swap(touched_);
        touch_all();
    }
    // From here on, up to `limit` touches are kept apart.
    void restart(std::size_t limit) { limit_ = limit; }

    std::size_t bytes() const { return touched_.capacity() * sizeof(Index); }

   private:
    std::vector<Index> touched_;
    std::size_t limit_ = 0;
};

}  // namespace flintknap
