/// What an inflated balloon leaves its catheter of the lumen around it, as devices feel it.

#include <algorithm>
#include <cmath>

#include "engine/exercise/treatment_along.h"

namespace exercise {

/// Of the branch that the balloon's middle lies in: in a wider vessel, beside it, its walls are not felt.
bool Treatment::lay_sleeve(const Along& along, const anatomy::Anatomy& anatomy, int branch) {
    Inflation& now = inflation_.front();
    const std::vector<physics::Narrowing::Sample> before = std::move(now.sleeve);
    now.sleeve.clear();
    const double folded = folded_radius(along.device());
    physics::Bulge bulge;
    bulge.from_tip = along.balloon()->from_tip - along.balloon()->cone;
    bulge.radii = now.radii;
    if (branch < 0 || *std::ranges::max_element(now.radii) < folded + seen_step) return !before.empty();
    constexpr double spacing = physics::Narrowing::spacing;
    constexpr double play = 0.05;    // of an inflated balloon in its vessel [mm]
    constexpr double past_ends = 6;  // [mm]
    constexpr double open = 1.3;     // of the lumen's radius, where a tube touches nothing [-]
    constexpr double funnel = 1;     // by which it widens past the balloon's ends, and in the parent [mm/mm]
    const BranchArc branch_arc(anatomy, branch);
    const double arcs[] = {
        arc_on_branch(anatomy, branch, along.point(std::max(0.0, along.tip() - bulge.from_tip))),
        arc_on_branch(anatomy, branch,
                      along.point(std::max(0.0, along.tip() - bulge.from_tip - bulge.length())))};
    // At whole millimetres, so that it stays where it is while the balloon does.
    const double from = std::max(std::min(arcs[0], arcs[1]), branch_arc.begin()),
                 to = std::max(arcs[0], arcs[1]);
    const double first =
                     std::max(spacing * std::floor((from - past_ends) / spacing), branch_arc.arcs.front()),
                 last = std::min(to + past_ends, branch_arc.length);
    for (double s = first; s <= last + 1e-9; s += spacing) {
        physics::Narrowing::Sample sample;
        sample.at = branch_arc.point(s);
        sample.lumen = branch_arc.radius(s);
        double lumen = sample.lumen;
        for (std::size_t n = 0; n < lesions_.size(); ++n) {
            const std::vector<double>& places = stretches_[n].arc;
            if (lesions_[n].branch != branch || s < places.front() || s > places.back()) continue;
            const auto k =
                std::min(static_cast<std::size_t>((s - places.front()) / spacing), places.size() - 2);
            const double t = std::clamp((s - places[k]) / spacing, 0.0, 1.0);
            const auto& opened = lesions_[n].places;
            lumen = std::min(lumen, (1 - t) * opened[k].radius + t * opened[k + 1].radius);
            sample.aside = aside_of(specs_[n], stretches_[n], k, std::max(0.0, sample.lumen - lumen));
        }
        const double arc = along.arc_of(sample.at, BranchStretch::uneven * sample.lumen);
        const double blown = std::isnan(arc) ? 0.0 : std::max(folded, bulge.radius(along.tip() - arc));
        const double wider = std::max(0.0, blown - folded);
        const double part = std::clamp(wider / std::max(1e-6, lumen - folded), 0.0, 1.0);
        sample.radius = std::max(lumen - wider, folded) + play + (1 - part) * (open - 1) * sample.lumen +
                        funnel * std::max({0.0, from - s, s - to});
        now.sleeve.push_back(sample);
    }
    // Where the branch ends first it is open.
    if (now.sleeve.empty()) return !before.empty();
    for (physics::Narrowing::Sample* end : {&now.sleeve.front(), &now.sleeve.back()})
        end->radius = std::max(end->radius, 3 * end->lumen);
    // A balloon that rests must not chase the tube that it makes.
    constexpr double shows = 0.02;  // [mm]
    for (physics::Narrowing::Sample& sample : now.sleeve)
        for (const physics::Narrowing::Sample& old : before)
            if (old.at == sample.at && (old.aside - sample.aside).norm() < shows &&
                std::abs(old.radius - sample.radius) < shows)
                sample = old;
    return now.sleeve != before;
}

}  // namespace exercise
