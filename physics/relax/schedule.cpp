#include "physics/relax/schedule.h"

#include <algorithm>
#include <cassert>

namespace physics {

int CycleWalk::next(int first, int last) {
    assert(first >= 1 && last >= first);
    const int count = last - first + 1;
    if (at_ >= count) {  // the sweep is over, or the wire became shorter
        sweep_ = sweep_ + 1 < count ? sweep_ + 1 : 0;
        at_ = order_ == CycleOrder::Nested ? sweep_ : 0;
    }
    starts_sweep_ = at_ == (order_ == CycleOrder::Nested ? sweep_ : 0);
    assert(at_ >= 0 && at_ < count);
    return first + at_++;
}

Schedule::Turn Schedule::next(int segments, const RelaxBudget& budget) {
    assert(segments >= 1 && budget.distal_fraction >= 0);
    const int window = std::min(segments, budget.distal_segments);
    if (window > 0 && window < segments) {
        owed_ += budget.distal_fraction;
        if (owed_ >= 1) {
            owed_ -= 1;
            return {distal_.next(segments - window + 1, segments), false};
        }
    }
    const int segment = whole_.next(1, segments);
    assert(segment <= segments && owed_ >= 0);
    return {segment, whole_.starts_sweep()};
}

}  // namespace physics
