#include "engine/exercise/wrong_turns.h"

#include <algorithm>
#include <limits>

namespace exercise {
namespace {

constexpr double clearly_outside = 1;  // of the right branches [mm]

}  // namespace

WrongTurns::WrongTurns(const anatomy::Anatomy& anatomy, const geometry::Vec3& start,
                       const geometry::Vec3& target) {
    const auto to_the_root = [&](const geometry::Vec3& from) {
        std::vector<int> path;
        for (int b = anatomy::nearest_place(anatomy, from).branch; b >= 0; b = anatomy.branches[b].parent)
            path.push_back(b);
        return path;
    };
    std::vector<int> there = to_the_root(start), back = to_the_root(target);
    // What both have in common beyond the fork is on neither's way.
    while (there.size() > 1 && back.size() > 1 && there[there.size() - 2] == back[back.size() - 2]) {
        if (there.back() != back.back()) break;
        there.pop_back();
        back.pop_back();
    }
    right_.assign(anatomy.branches.size(), false);
    for (const auto* path : {&there, &back})
        for (const int b : *path) right_[b] = true;
}

void WrongTurns::observe(const anatomy::Anatomy& anatomy, const geometry::Vec3& tip, double seconds) {
    double of_right = std::numeric_limits<double>::infinity(), of_wrong = of_right;  // outside of them [mm]
    int nearest = -1;                                                                // of the wrong ones
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        const geometry::CentrelineBranch& branch = anatomy.branches[b];
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const double outside = (tip - branch.points[i]).norm() - branch.radii[i];
            if (right_[b]) {
                of_right = std::min(of_right, outside);
            } else if (outside < of_wrong) {
                of_wrong = outside;
                nearest = static_cast<int>(b);
            }
        }
    }
    const bool in = nearest >= 0 && of_wrong < of_right && of_right > (inside_ >= 0 ? 0 : clearly_outside);
    if (!in) {
        inside_ = -1;
        return;
    }
    const std::string& name = anatomy.branches[nearest].name;
    auto known = std::find_if(found_.begin(), found_.end(), [&](const auto& f) { return f.name == name; });
    if (known == found_.end()) known = found_.insert(found_.end(), WrongBranch{name, 0, 0});
    const bool came_back = inside_ >= 0 && anatomy.branches[inside_].parent == nearest;
    if (nearest != inside_ && !came_back) ++known->entries;
    known->seconds += seconds;
    inside_ = nearest;
}

}  // namespace exercise
