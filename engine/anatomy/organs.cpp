#include "engine/anatomy/organs.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <vector>

#include "engine/io/text.h"

namespace anatomy {
namespace {

struct OrganNames {
    std::string_view organ;
    bool shows;         // the patient has it as a part of its own, in which contrast blushes
    const char* whose;  // "a kidney"
    std::array<std::string_view, 24> branches;
};
constexpr std::array<OrganNames, 7> all_organs = {{
    {"arm", false, "an arm", {"LSA", "RSA", "LECA", "RECA"}},
    {"leg", false, "a leg", {"LCFA", "RCFA", "LIIA", "RIIA", "LSFA", "LPFA"}},
    {"kidney", true, "a kidney", {"LRA", "RRA"}},
    {"brain",
     true,
     "the brain",
     {"ICA", "LICA", "RICA", "M1", "A1", "A2", "P1", "P2", "PCOM", "M2sup", "M2inf", "LVA", "RVA", "BA"}},
    {"gut", false, "the gut", {"SMA", "IMA", "coeliac", "CHA", "splenic"}},
    {"heart",
     true,
     "the heart",
     {"LM", "LAD", "LCX", "RCA", "PLV", "PDA", "conus", "AM", "D1", "D2", "S1", "OM1", "OM2"}},
    {"trunk", false, "the trunk", {"aorta"}},
}};

std::optional<Organ> organ_named_by(std::string_view branch) {
    while (!branch.empty()) {
        const std::size_t plus = branch.rfind('+');
        const std::string_view part = plus == std::string_view::npos ? branch : branch.substr(plus + 1);
        for (std::size_t i = 0; i < all_organs.size(); ++i) {
            const auto& names = all_organs[i].branches;
            if (std::find(names.begin(), names.end(), part) != names.end()) return static_cast<Organ>(i);
        }
        branch = plus == std::string_view::npos ? std::string_view() : branch.substr(0, plus);
    }
    return std::nullopt;
}

/// Arteries of the brain without their side, and whether they supply each kind of territory.
struct CerebralArtery {
    std::string_view name;
    bool anterior, middle, posterior, below;  // below the tentorium
    bool both_sides;
};
constexpr std::array<CerebralArtery, 15> cerebral_arteries = {{
    {"ICA", true, true, false, false, false},
    {"A1", true, false, false, false, false},
    {"A2", true, false, false, false, false},
    {"M1", false, true, false, false, false},
    {"M2sup", false, true, false, false, false},
    {"M2inf", false, true, false, false, false},
    {"PCOM", false, false, true, false, false},
    {"P1", false, false, true, false, false},
    {"P2", false, false, true, false, false},
    {"VA", false, false, true, true, true},
    {"BA", false, false, true, true, true},
    {"SCA", false, false, false, true, false},
    {"AICA", false, false, false, true, false},
    {"PICA", false, false, false, true, false},
    {"ACOM", true, false, false, false, true},
}};

}  // namespace

std::vector<std::string> brain_territories(std::string_view branch, bool on_left) {
    while (!branch.empty()) {
        const std::size_t plus = branch.rfind('+');
        std::string_view part = plus == std::string_view::npos ? branch : branch.substr(plus + 1);
        branch = plus == std::string_view::npos ? std::string_view() : branch.substr(0, plus);
        const auto known = [&](std::string_view name) {
            return std::find_if(cerebral_arteries.begin(), cerebral_arteries.end(),
                                [&](const CerebralArtery& artery) { return artery.name == name; });
        };
        auto artery = known(part);
        if (artery == cerebral_arteries.end() && (part.starts_with('L') || part.starts_with('R'))) {
            on_left = part.starts_with('L');
            artery = known(part.substr(1));
        }
        if (artery == cerebral_arteries.end()) continue;
        std::vector<std::string> territories;
        for (const bool left : {true, false}) {
            if (left != on_left && !artery->both_sides) continue;
            const std::string side = left ? "left " : "right ";
            if (artery->anterior) territories.push_back(side + "ACA");
            if (artery->middle) territories.push_back(side + "MCA");
            if (artery->posterior) territories.push_back(side + "PCA");
        }
        if (artery->below) territories.emplace_back("cerebellum and stem");
        return territories;
    }
    return {};
}

std::string_view name_of(Organ organ) {
    return all_organs[static_cast<std::size_t>(organ)].organ;
}

Organ organ_behind(const Anatomy& anatomy, int branch) {
    for (int b = branch; b >= 0; b = anatomy.branches[b].parent)
        if (const auto organ = organ_named_by(anatomy.branches[b].name)) return *organ;
    return Organ::Arm;
}

std::string organs_text(const Anatomy& anatomy) {
    std::array<std::vector<std::string>, all_organs.size()> ends;
    for (const VesselEnd& end : anatomy.ends) {
        if (end.role == EndRole::Inlet) continue;
        const VesselPlace place = nearest_place(anatomy, end.opening.centre);
        if (place.branch >= 0)
            ends[static_cast<std::size_t>(organ_behind(anatomy, place.branch))].push_back(end.opening.name);
    }
    std::string text, names;
    for (std::size_t i = 0; i < all_organs.size(); ++i) {
        const OrganNames& organ = all_organs[i];
        if (!organ.shows) continue;
        if (!ends[i].empty())
            text += fmt::format("contrast that leaves by {} shows in {}, with a patient around the vessels\n",
                                io::joined(ends[i]), organ.whose);
        std::vector<std::string_view> branches;
        for (const std::string_view branch : organ.branches)
            if (!branch.empty()) branches.push_back(branch);
        names +=
            fmt::format("{}{} for {}", names.empty() ? "" : "; ", io::joined(branches, " "), organ.whose);
    }
    if (text.empty()) text = "contrast shows in no organ, with a patient around the vessels\n";
    return text + "  it goes by the branches' names, which may be changed in the file: " + names + "\n";
}

}  // namespace anatomy
