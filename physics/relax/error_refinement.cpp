#include "physics/relax/error_refinement.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/wire/crossings.h"

namespace physics {
namespace {

constexpr double rounded = 1e-6;  // of λ: pieces as long as each other
/// Two halves have a quarter of their whole's error, which is second order.
constexpr double grows = 3;
constexpr int least_merges = 3;
constexpr double whole_fraction = 0.5;  // of the tolerance of crossings, that a merged segment may use

/// [i] = which λ segment i lies in, from 0.
std::vector<int> cells_of(const Chain& chain) {
    const std::vector<bool> within = chain.within_segments();
    std::vector<int> cells(chain.joints.size(), 0);
    for (int i = 2; i <= chain.segments(); ++i) cells[i] = cells[i - 1] + !within[i - 1];
    return cells;
}

/// Absolute parts by λ, each mixed with its neighbours': those cancel where a contact lies between them.
std::vector<double> parts_of_cells(const std::vector<int>& cells, const std::vector<double>& parts) {
    assert(cells.size() == parts.size());
    const int last = cells.back();
    std::vector<double> sums(last + 1, 0.0), mixed(last + 1);
    for (std::size_t i = 1; i < parts.size(); ++i) sums[cells[i]] += parts[i];
    for (int c = 0; c <= last; ++c)
        mixed[c] = 0.25 * std::abs(sums[std::max(0, c - 1)] + 2 * sums[c] + sums[std::min(last, c + 1)]);
    return mixed;
}

/// Two pieces of one λ that a split has made.
struct Pair {
    int joint = 0;     // between them
    double costs = 0;  // what the tip's error grows by without it, at most [mm]
};

std::vector<Pair> pairs_of(const Chain& chain, const std::vector<double>& parts) {
    const std::vector<bool> within = chain.within_segments();
    std::vector<Pair> pairs;
    double whole = 0, place = 0;  // of the last joint between two λ, and of this one [mm]
    for (int j = 1; j < chain.segments(); ++j) {
        place += chain.lengths[j];
        if (!within[j]) {
            whole = place;
            continue;
        }
        const double length = chain.lengths[j], both = length + chain.lengths[j + 1];
        const double before = (place - length - whole) / both;
        if (std::abs(both - 2 * length) > rounded * chain.grid.segment_length ||
            std::abs(before - std::round(before)) > rounded * chain.grid.segment_length / both)
            continue;
        pairs.push_back({j, grows * (std::abs(parts[j]) + std::abs(parts[j + 1]))});
    }
    return pairs;
}

}  // namespace

int ErrorRefinement::split(Chain& chain, std::span<const WallContact> contacts,
                           const std::vector<double>& parts) const {
    const int before = chain.segments();
    const double lambda = chain.grid.segment_length,
                 least_tip = 2 * options_.least_tip * lambda * (1 - rounded);
    if (contacts.back().touches() && chain.lengths.back() >= least_tip) {
        while (chain.lengths.back() >= least_tip) split_segment(chain, chain.segments());
        return chain.segments() - before;
    }
    const std::vector<int> cells = cells_of(chain);
    const std::vector<double> of_cells = parts_of_cells(cells, parts);
    const auto can_be_halved = [&](int i) {
        return chain.lengths[i] >= 2 * options_.least_piece * lambda * (1 - rounded);
    };
    double most = 0;
    for (int i = 1; i <= before; ++i)
        if (can_be_halved(i)) most = std::max(most, of_cells[cells[i]]);
    for (int i = before; i >= 1; --i)
        if (can_be_halved(i) && of_cells[cells[i]] >= options_.worst_part * most) split_segment(chain, i);
    return chain.segments() - before;
}

int ErrorRefinement::merge(Chain& chain, std::span<const WallContact> contacts,
                           const std::vector<double>& parts, double slack) const {
    std::vector<Pair> pairs = pairs_of(chain, parts);
    std::ranges::sort(pairs, [](const Pair& a, const Pair& b) {
        return a.costs < b.costs || (a.costs == b.costs && a.joint < b.joint);
    });
    const auto crosses = [&](int joint) {
        return crossing_between(wall_, chain.joints[joint - 1], chain.joints[joint + 1], contacts[joint - 1],
                                contacts[joint + 1], whole_fraction * crossing_tolerance)
            .has_value();
    };
    std::vector<int> joints;
    for (const Pair& pair : pairs) {
        if (pair.costs >= slack) break;
        if (crosses(pair.joint)) continue;
        slack -= pair.costs;
        joints.push_back(pair.joint);
    }
    const int count = static_cast<int>(joints.size());
    if (count < std::max<double>(least_merges, options_.least_saving * chain.segments())) return 0;
    std::ranges::sort(joints, std::greater());
    for (const int joint : joints) merge_segments(chain, joint);
    return count;
}

ErrorRefinementRound ErrorRefinement::round(Chain& chain, std::span<const WallContact> contacts,
                                            bool may_merge) {
    assert(options_.tolerance > 0 && options_.least_piece > 0 && options_.least_tip > 0);
    ErrorRefinementRound made;
    const auto error = estimator_.of(chain, contacts, true);
    made.updates = estimator_.updates();
    if (!error) return made;
    made.tip = error->tip;
    if (error->tip > options_.tolerance)
        made.split = split(chain, contacts, error->segments);
    else if (may_merge)
        made.merged = merge(chain, contacts, error->segments,
                            options_.part_of_slack * (options_.tolerance - error->tip));
    assert(validate(chain).empty());
    return made;
}

}  // namespace physics
