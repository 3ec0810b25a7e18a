#include <algorithm>
#include <cmath>

#include "engine/anatomy/grow/preset_builders.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::degree;

// The ascending aorta is 1.9 mm wider in men than in women of their size, wider by 1 mm for every ten years
// and for 0.23 m² of body surface (MRI of 3573 adults: Turkbey 2014, PMID 23681649).
constexpr Trend ascending_trend{0.945, false, 0.0029, 0.24};
// Women's common and internal carotid arteries are 6.10 and 4.66 mm wide, men's 6.52 and 5.11 (Krejza 2006,
// Stroke 37:1103); age: estimate.
constexpr Trend trunk_trend{0.936, false, 0.002}, carotid_trend{0.936, false, 0.001},
    subclavian_trend{0.92, false, 0.001};
// Its diameters are drawn with those of the arch.
const Traits drawn{0, {1, false, 0, 0}, 0.06, 0.5};
const Traits internal_carotid{0.15, {0.912, false, 0.001}, 0.06, 0.5};
const Traits external_carotid{0.12, {0.93, false, 0}, 0.08, 0.5};
const Traits vertebral{0.2, {0.95, false, 0}, 0.06, 0.5};  // 3.9 ± 0.8 (Rai 2013, PMID 23188788)

/// Where vessels leave an arch, as arc lengths of its centreline [mm].
class ArchOrigins {
public:
    ArchOrigins(const BranchSpec& aorta, const Vec3& along) : along_(along) {
        VesselTreeSpec alone;
        alone.name = "aorta";
        alone.branches = {aorta};
        aorta_ = grow(alone).branches[0];
    }
    /// The place this far below the highest point, on the way up.
    double below_top(double drop) const {
        const auto higher = [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); };
        const auto top = std::ranges::max_element(aorta_.points, higher);
        auto at = top;
        while (at != aorta_.points.begin() && at->z() > top->z() - drop) --at;
        return static_cast<double>(at - aorta_.points.begin()) * aorta_.step();
    }
    /// The place this far to the left of another and behind it.
    double behind(double origin, double distance) const {
        int at = aorta_.sample_at(origin);
        const int last = static_cast<int>(aorta_.points.size()) - 1;
        const double reached = aorta_.points[at].dot(along_) + distance;
        while (at < last && aorta_.points[at].dot(along_) < reached) ++at;
        return at * aorta_.step();
    }

private:
    Vec3 along_;
    SampledBranch aorta_;
};

/// Where a coronary artery starts along the root of the aorta [mm].
constexpr double mouth = 15;

/// Whether a coronary artery, its knots moved by `shift` from there, passes beside the root, which is
/// extended straight down when it is cut open.
bool passes(const std::vector<VesselKnot>& stem, const Vec3& shift, const BranchSpec& aorta) {
    const VesselKnot& root = aorta.knots[0];
    const Vec3 up = (aorta.knots[1].place - root.place).normalized(), start = root.place + mouth * up;
    constexpr double apart = 1;  // of the walls [mm]
    for (std::size_t i = 3; i < stem.size(); ++i) {
        for (const double part : {0.5, 1.0}) {
            const Vec3 place = start + shift + stem[i - 1].place + part * (stem[i].place - stem[i - 1].place);
            const Vec3 from = place - root.place;
            if ((from - from.dot(up) * up).norm() < root.radius + stem[i - 1].radius + apart) return false;
        }
    }
    return true;
}

/// The diameters of an arch's vessels and the form of its centreline.
struct ArchFigures {
    double ascending, trunk, carotid, subclavian;  // radii [mm]
    double gap_1, gap_2;                           // between the walls of the three branches [mm]
    Vec3 along;                                    // from the ascending to the descending aorta, unit
    double base, bow;  // height of the arch's feet above the valve; radius of its centreline [mm]
    double drop;       // of the trunk's origin below the top [mm]
};

/// Diameters, gaps and the plane of the arch from CT angiography of 217 patients (Yan): ascending aorta
/// 34.6 ± 4.7, brachiocephalic 12.5 ± 2, left common carotid 8.3 ± 1.5, left subclavian 10.4 ± 2.2, gaps 4.4
/// and 6.4, arch 50 ± 14° from sagittal. The ascending aorta lengthens and the arch widens with age
/// (Sugawara 2008, PMID 19356509; Redheuil 2011, PMID 21903054), and the origins of its branches sink: 0.8 %
/// and 0.5 % a year, half a carotid's diameter in forty years (estimates from their pictures).
ArchFigures arch_figures(const Variation& v, const ArchShape& shape) {
    ArchFigures f;
    f.ascending = v.diameter("ascending", 34.6, 4.7, ascending_trend) / 2;
    f.trunk = v.diameter("trunk", 12.5, 2, trunk_trend) / 2;
    f.carotid = v.diameter("carotid", 8.3, 1.5, carotid_trend) / 2;
    f.subclavian = v.diameter("subclavian", 10.4, 2.2, subclavian_trend) / 2;
    f.gap_1 = v.figure("gap 1", 4.4, 0.8, 2.4, 8);
    f.gap_2 = v.figure("gap 2", 6.4, 1.2, 3.4, 12);
    const double plane = v.figure("plane", 50 * degree, 14 * degree);
    f.along = Vec3(geometry::sin(plane), geometry::cos(plane), 0);
    f.base = 60 * v.length("ascending", 0.08, 0.5, 0.008);
    // A wide aorta has a wide arch: with less than this its spline would bend too tightly for the lumen.
    f.bow = std::max(36 * v.length("arch", 0.1, 0.3, 0.005), 1.88 * f.ascending);
    const double sunk = 0.0125 * (v.patient().age - Patient().age);
    f.drop =
        2 * f.carotid * std::clamp(v.figure("drop", shape.drop, 0.2) + sunk, shape.lowest, shape.highest);
    return f;
}

BranchSpec arch_aorta(const Variation& v, const ArchFigures& f) {
    const double descending = v.length("descending", 0.06, 1);
    BranchSpec aorta{"aorta", "", 0, {}, false};
    aorta.knots = {
        {{-2, -8, 0}, 0.92 * f.ascending}, {{-3, -6, 25}, f.ascending}, {{0, 0, f.base}, f.ascending}};
    constexpr double clock[] = {150, 120, 90, 60, 30, 0};
    constexpr double width[] = {0.95, 0.91, 0.86, 0.82, 0.79, 0.77};
    for (int k = 0; k < 6; ++k) {
        const double a = clock[k] * degree;
        aorta.knots.push_back(
            {f.bow * (1 + geometry::cos(a)) * f.along + Vec3(0, 0, f.base + f.bow * geometry::sin(a)),
             width[k] * f.ascending});
    }
    aorta.knots.push_back({2 * f.bow * f.along + Vec3(-4, 4, f.base - 60), 0.73 * f.ascending});
    const Vec3 foot = 2 * f.bow * f.along + Vec3(0, 0, f.base - 60);
    aorta.knots.push_back({foot + Vec3(-12, 9, -70 * descending), 0.70 * f.ascending});
    aorta.knots.push_back({foot + Vec3(-21, 8, -140 * descending), 0.66 * f.ascending});
    smooth_bends(aorta.knots);
    return aorta;
}

std::vector<Stretch> right_arm_root(double trunk) {
    return {{"brachiocephalic",
             {{{0, 0, 0}, trunk},
              {{-3.8, -0.3, 25.3}, 0.96 * trunk},
              {{-13.6, -4.9, 48.2}, 0.84 * trunk},
              {{-30.5, 1.4, 65.1}, 0.74 * trunk}},
             drawn},
            {"RSA", {{{-55, -1, 63}, 0.7 * trunk}, {{-76, -1, 48}, 0.66 * trunk}}, drawn}};
}
std::vector<Stretch> left_arm_root(double subclavian) {
    return {{"LSA",
             {{{0, 0, 0}, subclavian},
              {{3.7, -0.1, 21.1}, 0.96 * subclavian},
              {{4.8, 3.2, 41.9}, 0.92 * subclavian},
              {{20, 0.7, 56.7}, 0.88 * subclavian},
              {{39.5, 3.8, 63.8}, 0.84 * subclavian},
              {{58.6, -0.3, 56.5}, 0.82 * subclavian},
              {{76, 0, 44}, 0.79 * subclavian}},
             drawn}};
}

/// From the shoulder to the wrist of an arm held 20° from the body, after a subclavian artery that ends at
/// `from`. Axillary 6.0 ± 1.1 (CT of 208 patients: Arnett 2018, PMID 29130612); brachial 4.3 in men
/// (estimate), radial 2.68 in men and 2.27 in women (71 studies: Wahood 2022, J NeuroInterv Surg), ± 0.4 (Yoo
/// 2005, Int J Cardiol 101:421). Lengths of 25 cm each (estimate).
void add_arm(std::vector<Stretch>& stretches, const std::string& side, const Vec3& from) {
    const double out = side == "R" ? -1 : 1;
    const auto at = [&](double x, double y, double z) { return Vec3(from + Vec3(out * x, y, z)); };
    stretches.push_back({side + "axillary",
                         {{at(26, 3, -20), 3.1}, {at(48, 6, -46), 3}, {at(66, 8, -82), 2.7}},
                         {0.183, {0.88, false, 0}, 0.06, 0.8}});
    stretches.push_back({side + "brachial",
                         {{at(88, 9, -140), 2.2}, {at(109, 7, -200), 2.15}, {at(128, 2, -262), 2.1}},
                         {0.12, {0.85, true, 0}, 0.06, 1}});
    stretches.push_back({side + "radial",
                         {{at(140, -5, -300), 1.4},
                          {at(158, -12, -365), 1.36},
                          {at(173, -15, -430), 1.34},
                          {at(186, -15, -492), 1.32}},
                         {0.149, {0.847, true, 0}, 0.06, 1}});
}

/// A little narrower than the radial artery, as on average (2.7 and 3.0 mm: J Invasive Cardiol
/// 2023;35:E143); its first six centimetres.
BranchSpec ulnar(Variation& v, const std::string& side, const std::string& parent, double at) {
    const double in = side == "R" ? 1 : -1;
    return v.branch(
        side + "ulnar", {0.149, {0.86, true, 0}, 0.08, 1}, {parent, at, 6, 6 * degree},
        {{{0, 0, 0}, 1.3}, {{in * 6, 2, -14}, 1.27}, {{in * 10, 3, -34}, 1.24}, {{in * 9, 2, -60}, 1.2}});
}

void add_external_carotids(Variation& v, VesselTreeSpec& spec, double left_bifurcation) {
    spec.branches.push_back(v.branch("RECA", external_carotid, {"RCCA+RICA", 99.5, 2, 8 * degree},
                                     {{{0, 0, 0}, 2.2},
                                      {{3, -5.7, 7.3}, 2.04},
                                      {{4.3, -7.2, 17.6}, 1.95},
                                      {{2.6, -10.1, 27.6}, 1.87},
                                      {{2.1, -12.1, 37.9}, 1.77},
                                      {{2.4, -11, 48.3}, 1.7}}));
    spec.branches.push_back(v.branch("LECA", external_carotid, {"LCCA+LICA", left_bifurcation, 2, 8 * degree},
                                     {{{0, 0, 0}, 2.2},
                                      {{-3.6, -2.9, 5.4}, 2.05},
                                      {{-7.3, -5.5, 13}, 2},
                                      {{-7.5, -6.7, 21.8}, 1.88},
                                      {{-4.9, -7.2, 30.3}, 1.85},
                                      {{-2.7, -6.9, 38.9}, 1.75},
                                      {{-3.9, -7.2, 47.7}, 1.7}}));
}

void add_vertebrals(Variation& v, VesselTreeSpec& spec, const std::string& left, const std::string& right) {
    spec.branches.push_back(v.branch("LVA", vertebral, {left, 60.1, 3, 8 * degree},
                                     {{{0, 0, 0}, 1.95},
                                      {{-1.9, 4, 6.8}, 1.87},
                                      {{-1.8, 6.5, 14.8}, 1.83},
                                      {{-2.8, 8.6, 22.9}, 1.78},
                                      {{-4.2, 9.7, 31.1}, 1.74},
                                      {{-4.5, 10, 39.5}, 1.7},
                                      {{-3.6, 9.7, 47.8}, 1.69},
                                      {{-2.7, 9.2, 56.1}, 1.66},
                                      {{-3.1, 8.8, 64.5}, 1.63},
                                      {{-4.3, 9.2, 72.8}, 1.6},
                                      {{-4.4, 9.3, 81.2}, 1.6}}));
    spec.branches.push_back(v.branch("RVA", vertebral, {right, 78.6, 3, 8 * degree},
                                     {{{0, 0, 0}, 1.9},
                                      {{0.5, 0.5, 5.4}, 1.8},
                                      {{1.2, 2, 13.5}, 1.75},
                                      {{0.5, 3.4, 21.6}, 1.7},
                                      {{0.3, 5.1, 29.8}, 1.65},
                                      {{1.3, 6.3, 37.9}, 1.63},
                                      {{2.6, 6.8, 46.1}, 1.6},
                                      {{3.1, 6.6, 54.3}, 1.6},
                                      {{2.4, 6, 62.6}, 1.55},
                                      {{2, 5.6, 70.8}, 1.5},
                                      {{2.5, 5.6, 79.1}, 1.5}}));
}

std::vector<VesselKnot> left_common_carotid(const Variation& v, const ArchFigures& f, bool bovine) {
    const double carotid = f.carotid;
    std::vector<VesselKnot> left = {
        {{2.3, -1.4, 16.4}, 0.95 * carotid},  {{5.5, -2.6, 32.6}, 0.92 * carotid},
        {{7.6, -0.6, 48.9}, 0.89 * carotid},  {{10, -3.7, 65.1}, 0.86 * carotid},
        {{15.1, -1.1, 80.6}, 0.85 * carotid}, {{14.6, 0.9, 96.8}, 0.83 * carotid},
        {{11.3, -0.2, 113}, 0.83 * carotid},  {{13.9, 2.5, 129.2}, 0.83 * carotid}};
    if (bovine) {  // from the trunk across to the left side, then as usual
        for (VesselKnot& knot : left) knot.place += Vec3(13, 3, -22);
        left.erase(left.begin(), left.begin() + 2);
        // Over an aorta that is wider than the mean, for the body's size [mm].
        const double higher = f.ascending / length_factor(drawn.by_height, v.patient()) - 17.3;
        left.insert(left.begin(),
                    {{{8, 2, 6 + 0.8 * higher}, carotid}, {{16, 3, 15 + 1.35 * higher}, 0.95 * carotid}});
    }
    left.insert(left.begin(), {{0, 0, 0}, carotid});
    return left;
}

void add_left_carotid(Variation& v, VesselTreeSpec& spec, const ArchFigures& f, const ArchShape& shape,
                      const Origin& origin) {
    std::vector<Stretch> left = {{"LCCA", left_common_carotid(v, f, shape.bovine), drawn}};
    if (!shape.arms) {
        std::vector<VesselKnot> internal = {{{13.8, 0.7, 145.6}, 3.6},
                                            {{12.6, 4.4, 161.3}, 3.8},
                                            {{13.3, 9.7, 176.8}, 2.6},
                                            {{12.6, 8.9, 193.4}, 2.4},
                                            {{10.7, 10.2, 209.9}, 2.35}};
        if (shape.bovine)
            for (VesselKnot& knot : internal) knot.place += Vec3(13, 3, -22);
        left.push_back({"LICA", internal, internal_carotid});
    }
    spec.branches.push_back(v.branch(left, origin));
}

}  // namespace

/// Cervical internal carotid 4.7, bulb 7.6 (Baz 2021); vertebral 3.9 (Rai). The right common carotid's origin
/// ± 4 mm along the trunk, branches of the arch ± 4° (estimates).
VesselTreeSpec arch(Variation& v, const ArchShape& shape) {
    const ArchFigures f = arch_figures(v, shape);
    const BranchSpec aorta = arch_aorta(v, f);
    // Gaps are between walls on the outer side of the bend, which is longer than the centreline.
    const double inner = f.bow / (f.bow + 0.3 * f.ascending);
    const ArchOrigins origins(aorta, f.along);
    const double at_trunk = origins.below_top(f.drop);
    const double at_carotid = origins.behind(at_trunk, inner * (f.trunk + f.gap_1 + f.carotid));
    const double at_subclavian =
        shape.bovine
            ? origins.behind(at_trunk, inner * (f.trunk + f.gap_1 + f.carotid + f.gap_2 + f.subclavian))
            : origins.behind(at_carotid, inner * (f.carotid + f.gap_2 + f.subclavian));

    std::vector<Stretch> right_arm = right_arm_root(f.trunk), left_arm = left_arm_root(f.subclavian);
    if (shape.arms) {
        add_arm(right_arm, "R", right_arm.back().knots.back().place);
        add_arm(left_arm, "L", left_arm.back().knots.back().place);
    }
    std::vector<Stretch> right_neck = {{"RCCA",
                                        {{{0, 0, 0}, f.carotid},
                                         {{2.5, 2.6, 14.4}, 0.92 * f.carotid},
                                         {{2, 1.1, 30.3}, 0.87 * f.carotid},
                                         {{3.1, 4.8, 45.9}, 0.84 * f.carotid},
                                         {{1.3, 3.8, 61.6}, 0.83 * f.carotid},
                                         {{0, 2.2, 77.4}, 0.83 * f.carotid}},
                                        drawn}};
    if (!shape.arms) {
        right_neck.push_back({"RICA",
                              {{{3, 5.9, 92.7}, 3.6},
                               {{3.3, 7.7, 108.5}, 3.8},
                               {{1.1, 8.9, 124.2}, 2.6},
                               {{2.2, 11.6, 139.7}, 2.4},
                               {{4.7, 11.7, 155.6}, 2.35}},
                              internal_carotid});
    }
    VesselTreeSpec spec;
    spec.branches = {aorta, v.branch(right_arm, {"aorta", at_trunk, 0, 4 * degree})};
    const std::string trunk = spec.branches[1].name;
    spec.branches.push_back(v.branch(right_neck, {trunk, 55.3, 4, 4 * degree}));
    add_left_carotid(
        v, spec, f, shape,
        shape.bovine ? Origin{trunk, 24, 0, 3 * degree} : Origin{"aorta", at_carotid, 0, 4 * degree});
    spec.branches.push_back(v.branch(left_arm, {"aorta", at_subclavian, 0, 4 * degree}));
    const std::string left = spec.branches.back().name;
    if (!shape.arms) add_external_carotids(v, spec, shape.bovine ? 142 : 155);
    add_vertebrals(v, spec, left, trunk);
    spec.body = {geometry::Landmark::AorticValve, aorta.knots[0].place};
    if (shape.arms) {
        spec.branches.push_back(ulnar(v, "R", trunk, 421));
        spec.branches.push_back(ulnar(v, "L", left, 422));
        spec.targets = {v.target("RCCA", "RCCA", 60),
                        v.target("LCCA", "LCCA", 90),
                        {"root", "aorta", 25},
                        {"descending aorta", "aorta", at_subclavian + 90}};
        return spec;
    }
    spec.targets = {v.target("LICA", "LCCA+LICA", shape.bovine ? 188.0 : 201.3),
                    v.target("RICA", "RCCA+RICA", 145.4),
                    {"arch", "aorta", shape.bovine ? at_trunk : at_carotid}};
    return spec;
}

/// The arch above the iliac and renal vessels: an aorta from its root to the left groin.
VesselTreeSpec whole_aorta(Variation& v) {
    VesselTreeSpec spec = arch(v, {0.5, 0.1, 0.9, false}), below = iliac_renal(v);
    BranchSpec &aorta = spec.branches[0], &abdominal = below.branches[0];
    // The abdominal aorta begins below the arch's last knot, without the short piece above the coeliac trunk
    // that it has where it is alone.
    const double left_out = knot_arcs(abdominal.knots)[1];
    abdominal.knots.erase(abdominal.knots.begin());
    // The descending aorta runs from behind on the left to the middle where the renal arteries leave.
    const Vec3 shift = abdominal.knots[0].place + Vec3(8, 12, 45) - aorta.knots.back().place;
    for (VesselKnot& knot : aorta.knots) knot.place += shift;
    const std::size_t joint = aorta.knots.size();
    aorta.knots.insert(aorta.knots.end(), abdominal.knots.begin(), abdominal.knots.end());
    aorta.name = abdominal.name;
    aorta.parts = abdominal.parts;
    for (BranchPart& part : aorta.parts)
        if (part.knot > 0) part.knot += joint - 1;
    smooth_bends(aorta.knots);
    const double above = knot_arcs(aorta.knots)[joint] - left_out;
    for (BranchSpec& child : spec.branches)
        if (child.parent == "aorta") child.parent = abdominal.name;
    for (NamedTarget& target : spec.targets)
        if (target.branch == "aorta") target.branch = abdominal.name;
    for (BranchSpec& child : below.branches)
        if (child.parent == abdominal.name) child.at += above;
    spec.branches.insert(spec.branches.end(), below.branches.begin() + 1, below.branches.end());
    spec.targets.insert(spec.targets.end(), below.targets.begin(), below.targets.end());
    spec.body = below.body;
    return spec;
}

/// An arch with the left coronary artery, whose mouth is in the left sinus, 15 mm above the valve.
VesselTreeSpec arch_with_coronary(Variation& v) {
    VesselTreeSpec spec = arch(v, {0.5, 0.1, 0.9, false}), heart = left_coronary(v);
    // The thinnest vessel determines the grid for all: thin ones that lead nowhere here are left out.
    const auto thin = [](const BranchSpec& branch) {
        return branch.name != "LM+LAD" && branch.name != "LCX";
    };
    std::erase_if(heart.branches, thin);
    std::erase_if(heart.targets, [&](const NamedTarget& target) {
        return std::ranges::none_of(heart.branches,
                                    [&](const BranchSpec& branch) { return branch.name == target.branch; });
    });
    std::vector<VesselKnot>& stem = heart.branches[0].knots;
    const Vec3 direction = (stem[1].place - stem[0].place).normalized();
    const double wall = spec.branches[0].knots[1].radius;
    double lengthened = wall;
    if (!v.is_mean())
        while (lengthened < wall + 12 &&
               !passes(stem, lengthened * direction - stem[0].place, spec.branches[0]))
            lengthened += 0.5;
    const Vec3 shift = lengthened * direction - stem[0].place;
    for (VesselKnot& knot : stem) knot.place += shift;
    stem.insert(stem.begin(), {Vec3::Zero(), stem[0].radius});
    for (BranchPart& part : heart.branches[0].parts)
        if (part.knot > 0) ++part.knot;
    heart.branches[0].parent = "aorta";
    heart.branches[0].at = mouth;
    for (BranchSpec& branch : heart.branches)
        if (branch.parent == heart.branches[0].name) branch.at += lengthened;
    for (NamedTarget& target : heart.targets)
        if (target.branch == heart.branches[0].name) target.at += lengthened;
    spec.branches.insert(spec.branches.end(), heart.branches.begin(), heart.branches.end());
    heart.targets.push_back({"LM", heart.branches[0].name, lengthened + 6});
    spec.targets.insert(spec.targets.end(), heart.targets.begin(), heart.targets.end());
    return spec;
}

}  // namespace anatomy
