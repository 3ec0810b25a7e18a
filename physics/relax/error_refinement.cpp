#include "physics/relax/error_refinement.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "physics/wire/energy.h"

namespace physics {
namespace {

/// Part of the error, without signs, that the segments split in one round cause.
constexpr double part_of_round = 0.25;

/// Quarters the worst ones that together cause that part, or halves them where quarters would be too short.
/// Returns how many joints that makes.
int split_worst(Chain& chain, const std::vector<double>& signed_parts,
                const ErrorRefinementOptions& options) {
    // Those of neighbours cancel where a contact lies between them.
    std::vector<double> parts(signed_parts.size());
    const int n = chain.segments();
    for (int i = 1; i <= n; ++i)
        parts[i] = 0.25 * (signed_parts[std::max(1, i - 1)] + 2 * signed_parts[i] +
                           signed_parts[std::min(n, i + 1)]);

    const double least = 2 * options.least_piece * chain.grid.segment_length * (1 - 1e-9);
    std::vector<int> worst;
    double left = 0;
    for (int i = 1; i <= chain.segments(); ++i) {
        if (chain.lengths[i] < least) continue;
        left += part_of_round * std::abs(parts[i]);
        worst.push_back(i);
    }
    std::ranges::sort(worst, [&](int a, int b) {
        const double first = std::abs(parts[a]), second = std::abs(parts[b]);
        return first > second || (first == second && a < b);
    });
    std::size_t count = 0;
    while (count < worst.size() && left > 0) left -= std::abs(parts[worst[count++]]);
    worst.resize(count);
    std::ranges::sort(worst, std::greater());
    const int before = chain.segments();
    for (const int i : worst) {
        const bool twice = chain.lengths[i] >= 2 * least;
        split_segment(chain, i);
        if (!twice) continue;
        split_segment(chain, i + 1);
        split_segment(chain, i);
    }
    return chain.segments() - before;
}

}  // namespace

ErrorRefinement refine_to_error(Chain& chain, const LumenWall& wall, GlobalRelaxer& relaxer,
                                const ErrorRefinementOptions& options) {
    assert(options.tolerance > 0 && options.least_piece > 0);
    ErrorRefinement made;
    ErrorEstimator estimator(wall);
    for (;; ++made.rounds) {
        const auto error = estimator.of(chain, all_contacts(chain, wall), true);
        made.tip = error ? std::optional(error->tip) : std::nullopt;
        made.updates += 2LL * estimator.segments();
        if (!error || error->tip <= options.tolerance || made.rounds == options.most_rounds) return made;
        const int split = split_worst(chain, error->segments, options);
        if (split == 0) return made;
        made.split += split;
        const RelaxReport report = relaxer.relax(chain, {1'000'000, 0, 0});
        made.updates += report.updates;
        if (!report.strict_minimum()) {
            made.at_rest = false;
            return made;
        }
    }
}

}  // namespace physics
