/// Parts of branches: names and places that authors use.

#include <algorithm>

#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/io/error.h"

namespace anatomy {
namespace {

/// First and last part that the name stands for.
std::optional<std::pair<std::size_t, std::size_t>> parts_named(std::string_view name,
                                                               const std::vector<BranchPart>& parts) {
    for (std::size_t first = 0; first < parts.size(); ++first) {
        std::string joined = parts[first].name;
        for (std::size_t last = first;;) {
            if (joined == name) return std::pair(first, last);
            if (++last == parts.size() || joined.size() >= name.size()) break;
            joined += "+" + parts[last].name;
        }
    }
    return std::nullopt;
}

/// The branch that has these parts and whose own name is another; null where there is none, or several.
const BranchSpec* branch_with(std::string_view part, const std::vector<BranchSpec>& branches) {
    const BranchSpec* found = nullptr;
    for (const BranchSpec& branch : branches) {
        if (branch.name == part) return nullptr;
        if (!parts_named(part, branch.parts)) continue;
        if (found) return nullptr;
        found = &branch;
    }
    return found;
}

/// The branches that are grown so far, and what is placed on their parts.
class PlacedParts {
public:
    explicit PlacedParts(const VesselTreeSpec& spec) : branches_(spec.branches), tree_(seedling(spec)) {}

    /// The branches must come in the order of the spec.
    void add(const BranchSpec& branch, const std::vector<Tortuosity>& waves) {
        add_branch(tree_, branch, waves);
    }
    void place(std::string& name, double& at, const std::string& what) const {
        const BranchSpec* spec = branch_with(name, branches_);
        if (!spec) return;
        const auto grown = std::ranges::find(tree_.branches, spec->name, &SampledBranch::name);
        if (grown == tree_.branches.end()) return;  // listed later, for problems() to say
        const auto [start, end] = *extent_of(name, *spec, *grown);
        if (at > end - start)
            throw io::InputError("{} is {:.4g} mm along '{}'; expected 0 to {:.1f} mm", what, at, name,
                                 end - start);
        name = spec->name;
        at += start;
    }

private:
    std::vector<BranchSpec> branches_;  // as they were named
    VesselTree tree_;
};

/// Whether all can be sampled; problems() says why not.
bool can_be_grown(VesselTreeSpec spec) {
    const std::vector<BranchSpec> named = spec.branches;
    for (BranchSpec& branch : spec.branches)
        for (std::string* name : {&branch.parent, &branch.joins})
            if (const BranchSpec* whole = branch_with(*name, named)) *name = whole->name;
    spec.targets.clear();
    spec.stenoses.clear();
    spec.aneurysms.clear();
    spec.fusiform.clear();
    spec.occlusions.clear();
    spec.dissections.clear();
    return problems(spec).empty();
}

}  // namespace

std::optional<std::pair<double, double>> extent_of(std::string_view part, const BranchSpec& spec,
                                                   const SampledBranch& branch) {
    const auto span = parts_named(part, spec.parts);
    if (!span) return std::nullopt;
    const std::size_t after = span->second + 1;
    return std::pair(branch.part_starts[span->first],
                     after < spec.parts.size() ? branch.part_starts[after] : branch.length());
}

std::vector<PartPlace> parts_of(const VesselTreeSpec& spec) {
    VesselTree tree = seedling(spec);
    std::vector<PartPlace> places;
    for (const BranchSpec& branch : spec.branches) {
        add_branch(tree, branch, spec.tortuosities);
        for (const BranchPart& part : branch.parts) {
            const auto [start, end] = *extent_of(part.name, branch, tree.branches.back());
            places.push_back({part.name, branch.name, start, end});
        }
    }
    return places;
}

void complete_branch_names(VesselTreeSpec& spec) {
    for (Tortuosity& waves : spec.tortuosities)
        if (const BranchSpec* branch = branch_with(waves.branch, spec.branches)) {
            waves.part = waves.branch;
            waves.branch = branch->name;
        }
    if (!can_be_grown(spec)) return;
    PlacedParts parts(spec);
    for (BranchSpec& branch : spec.branches) {
        parts.place(branch.parent, branch.at, "the start of branch '" + branch.name + "'");
        parts.place(branch.joins, branch.joins_at, "the end of branch '" + branch.name + "'");
        parts.add(branch, spec.tortuosities);
    }
    for (NamedTarget& target : spec.targets)
        parts.place(target.branch, target.at, "the target '" + target.name + "'");
    const auto place_all = [&](auto& list, const char* what) {
        for (auto& one : list) parts.place(one.branch, one.at, what);
    };
    place_all(spec.stenoses, "the stenosis");
    place_all(spec.aneurysms, "the aneurysm");
    place_all(spec.fusiform, "the fusiform aneurysm");
    place_all(spec.occlusions, "the occlusion");
    place_all(spec.dissections, "the dissection");
}

}  // namespace anatomy
