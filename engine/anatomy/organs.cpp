#include "engine/anatomy/organs.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <numbers>
#include <span>
#include <vector>

#include "engine/io/text.h"

namespace anatomy {
namespace {

struct Name {
    std::string_view short_form, whole;
};

constexpr Name names[] = {
    {"start", "start of the tube"},
    {"end", "end of the tube"},
    {"arch", "aortic arch"},
    {"brachiocephalic", "brachiocephalic trunk"},
    {"coeliac", "coeliac trunk"},
    {"CHA", "common hepatic artery"},
    {"splenic", "splenic artery"},
    {"SMA", "superior mesenteric artery"},
    {"IMA", "inferior mesenteric artery"},
    {"ICA", "internal carotid artery"},
    {"A1", "anterior cerebral artery (A1)"},
    {"A2", "anterior cerebral artery (A2)"},
    {"M1", "middle cerebral artery (M1)"},
    {"M2sup", "superior division of the middle cerebral artery (M2)"},
    {"M2inf", "inferior division of the middle cerebral artery (M2)"},
    {"PCOM", "posterior communicating artery"},
    {"LM", "left main coronary artery"},
    {"LAD", "left anterior descending artery"},
    {"LCX", "left circumflex artery"},
    {"D1", "first diagonal branch"},
    {"D2", "second diagonal branch"},
    {"S1", "first septal branch"},
    {"OM1", "first obtuse marginal branch"},
    {"OM2", "second obtuse marginal branch"},
    {"RCA", "right coronary artery"},
    {"conus", "conus branch"},
    {"AM", "acute marginal branch"},
    {"PDA", "posterior descending artery"},
    {"PLV", "posterior left ventricular branch"},
};

/// Of both sides: L or R stands before them.
constexpr Name sided[] = {
    {"RA", "renal artery"},
    {"CIA", "common iliac artery"},
    {"EIA", "external iliac artery"},
    {"IIA", "internal iliac artery"},
    {"CFA", "common femoral artery"},
    {"SA", "subclavian artery"},
    {"VA", "vertebral artery"},
    {"CCA", "common carotid artery"},
    {"ICA", "internal carotid artery"},
    {"ECA", "external carotid artery"},
};

std::string_view whole_form(std::span<const Name> table, std::string_view of) {
    const auto found = std::ranges::find(table, of, &Name::short_form);
    return found == table.end() ? std::string_view() : found->whole;
}

std::string part_name(std::string_view part) {
    if (const std::string_view whole = whole_form(names, part); !whole.empty()) return std::string(whole);
    if (part.size() > 1 && (part[0] == 'L' || part[0] == 'R'))
        if (const std::string_view whole = whole_form(sided, part.substr(1)); !whole.empty())
            return (part[0] == 'L' ? "left " : "right ") + std::string(whole);
    return std::string(part);
}

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
            if (std::ranges::find(names, part) != names.end()) return static_cast<Organ>(i);
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

constexpr double blood_density = 1060;  // [kg/m³]

/// A kind of vessel, by where it is in the body and how wide it is.
struct Kind {
    double support;     // force of the tissue per area of vessel and way [N/mm³]
    double wave_speed;  // of the pulse [m/s]

    /// Of a vessel of this radius [mm]: k_f = 2πR · support, as the tissue holds it all round, and
    /// E h/R = 2 ρ c² (Moens and Korteweg).
    physics::Tissue tissue(double radius) const {
        constexpr double per_pascal = 1e-6;  // [N/mm²]
        return {2 * std::numbers::pi * radius * support,
                2 * blood_density * wave_speed * wave_speed * per_pascal};
    }
};

/// Aorta, iliac and other arteries of 3.5 mm radius and more: pulse wave 6 to 8 m/s in healthy adults
/// (Reference Values for Arterial Stiffness' Collaboration, Eur Heart J 2010). Support: estimate, 5e5 Pa/m;
/// models of vessels and heart have 1e5 (cerebral arteries, VaSP), 2e5 (epicardium, Pfaller et al. 2019) to
/// 1e7 Pa/m (in tissue, Shidhore et al. 2023); the iliac arteries then have the k_f of 0.01 to 0.03 N/mm² at
/// which a soft wire leaves their bends and a Lunderquist wire straightens them.
constexpr Kind great = {5e-4, 7};
/// Muscular arteries of the limbs, the neck and the organs: pulse wave 8 to 10 m/s from carotid to radial and
/// from femoral to ankle artery; support as above.
constexpr Kind muscular = {5e-4, 9};
/// Pulse wave about 8.6 m/s in the left coronary artery (Aguado-Sierra et al. 2006); support: estimate, 1e6
/// Pa/m, above the epicardium's for they lie on muscle.
constexpr Kind coronary = {1e-3, 8.6};
/// Arteries of the head: pulse wave as of muscular arteries: estimate; support: estimate between 1e5 (VaSP)
/// and 1e7 Pa/m.
constexpr Kind cerebral = {1e-3, 9};

constexpr double great_radius = 3.5;  // [mm]

double median_radius(const CentrelineBranch& branch) {
    std::vector<double> radii = branch.radii;
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    return *middle;
}

Kind kind_of(const Anatomy& anatomy, const CentrelineBranch& branch) {
    const double radius = median_radius(branch);
    if (anatomy.body && anatomy.body->landmark == geometry::Landmark::Sella) return cerebral;
    const bool heart = anatomy.body && anatomy.body->landmark == geometry::Landmark::AorticValve;
    if (radius >= great_radius) return great;
    // Of what leaves the aorta near the valve only the coronary arteries are this narrow.
    constexpr double neck_radius = 2.6;
    return heart && radius < neck_radius ? coronary : muscular;
}

}  // namespace

std::string clinical_name(std::string_view branch) {
    const std::size_t first = branch.find('+'), last = branch.rfind('+');
    if (first == std::string_view::npos) return part_name(branch);
    return part_name(branch.substr(0, first)) + " to " + part_name(branch.substr(last + 1));
}

std::string clinical_end(std::string_view end) {
    const std::size_t dot = end.rfind('.');
    if (dot == std::string_view::npos) return clinical_name(end);
    const std::string_view branch = end.substr(0, dot), side = end.substr(dot + 1);
    const std::size_t first = branch.find('+'), last = branch.rfind('+');
    if (side == "in") return part_name(branch.substr(0, first));
    if (side == "out") return part_name(last == std::string_view::npos ? branch : branch.substr(last + 1));
    return clinical_name(end);
}

std::vector<std::string> brain_territories(std::string_view branch, bool on_left) {
    while (!branch.empty()) {
        const std::size_t plus = branch.rfind('+');
        std::string_view part = plus == std::string_view::npos ? branch : branch.substr(plus + 1);
        branch = plus == std::string_view::npos ? std::string_view() : branch.substr(0, plus);
        const auto known = [&](std::string_view name) {
            return std::ranges::find(cerebral_arteries, name, &CerebralArtery::name);
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

std::vector<physics::Tissue> tissues_of(const Anatomy& anatomy) {
    std::vector<physics::Tissue> tissues;
    for (const CentrelineBranch& branch : anatomy.branches)
        tissues.push_back(kind_of(anatomy, branch).tissue(median_radius(branch)));
    return tissues;
}

}  // namespace anatomy
