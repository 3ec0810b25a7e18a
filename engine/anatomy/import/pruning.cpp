#include "engine/anatomy/import/pruning.h"

#include <fmt/format.h>

#include "engine/io/text.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::CentrelineBranch;

/// The first sample that is too thin; the number of samples when none is.
std::size_t first_thin(const CentrelineBranch& branch, double least) {
    std::size_t i = 1;
    while (i < branch.points.size() && branch.radii[i] >= least) ++i;
    return i;
}

double length_between(const CentrelineBranch& branch, std::size_t from, std::size_t to) {
    double length = 0;
    for (std::size_t i = from + 1; i < to && i < branch.points.size(); ++i)
        length += (branch.points[i] - branch.points[i - 1]).norm();
    return length;
}

}  // namespace

Pruning prune_thin(TracedLumen& traced, double least) {
    Pruning pruning;
    std::vector<CentrelineBranch>& branches = traced.branches;
    const int count = static_cast<int>(branches.size());
    std::vector<std::size_t> kept(branches.size());  // samples of each
    std::vector<int> cause(branches.size(), -1);     // the line that reports the loss of a branch
    std::vector<int> beyond;                         // branches lost with that of a line
    for (int b = 0; b < count; ++b) {
        CentrelineBranch& branch = branches[b];
        const bool lost = branch.parent >= 0 && cause[branch.parent] >= 0 &&
                          static_cast<std::size_t>(branch.parent_sample) >= kept[branch.parent];
        if (lost) {
            cause[b] = cause[branch.parent];
            kept[b] = 0;
            ++beyond[cause[b]];
            pruning.length += geometry::length_of(branch.points);
        } else {
            kept[b] = first_thin(branch, least);
            if (kept[b] == branch.points.size()) continue;
            const std::size_t thin = kept[b];
            if (branch.parent >= 0) {
                const double wide = branches[branch.parent].radii[branch.parent_sample];
                if (kept[b] < 3 || length_between(branch, 0, kept[b]) < 2 * wide) kept[b] = 0;
            } else if (kept[b] < 2) {
                kept[b] = branch.points.size();  // refused by the check of the smallest radius
                continue;
            }
            const double length = length_between(branch, kept[b], branch.points.size());
            cause[b] = static_cast<int>(pruning.lines.size());
            beyond.push_back(0);
            pruning.length += length;
            pruning.lines.push_back(fmt::format("radius {:.3f} at {}, {:.1f} mm", branch.radii[thin],
                                                io::place_text(branch.points[thin]), length));
        }
        if (const int end = traced.end_of_branch[b]; end >= 0) pruning.closed.push_back(end);
        traced.end_of_branch[b] = -1;
    }
    for (std::size_t line = 0; line < pruning.lines.size(); ++line)
        if (beyond[line] > 0)
            pruning.lines[line] +=
                fmt::format(" and {} branch{} beyond", beyond[line], beyond[line] == 1 ? "" : "es");

    std::vector<int> place(branches.size(), -1);
    std::vector<CentrelineBranch> left;
    std::vector<int> ends;
    for (int b = 0; b < count; ++b) {
        if (kept[b] == 0) continue;
        CentrelineBranch& branch = branches[b];
        branch.points.resize(kept[b]);
        branch.radii.resize(kept[b]);
        if (branch.parent >= 0) branch.parent = place[branch.parent];
        place[b] = static_cast<int>(left.size());
        left.push_back(std::move(branch));
        ends.push_back(traced.end_of_branch[b]);
    }
    branches = std::move(left);
    traced.end_of_branch = std::move(ends);
    std::erase_if(traced.tips, [&](const VesselTip& tip) { return cause[tip.branch] >= 0; });
    for (VesselTip& tip : traced.tips) tip.branch = place[tip.branch];
    return pruning;
}

}  // namespace anatomy
