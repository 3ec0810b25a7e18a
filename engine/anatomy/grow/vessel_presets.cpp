#include "engine/anatomy/grow/vessel_presets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::Vec3;

/// Numbers from a seed, the same on every machine (splitmix64); with seed 0 every draw is the mean.
class Draw {
public:
    Draw(std::uint64_t seed, std::uint64_t attempt)
        : varied_(seed != 0), state_(seed * 0x9e3779b97f4a7c15ull + attempt * 0xd1b54a32d192ed03ull) {}

    /// Approximates a normal number by the sum of twelve uniform ones, within 1.5 standard deviations.
    double normal(double mean, double deviation) {
        if (!varied_) return mean;
        double sum = -6;
        for (int k = 0; k < 12; ++k) sum += uniform();
        return mean + deviation * std::clamp(sum, -1.5, 1.5);
    }

private:
    double uniform() {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ z >> 27) * 0x94d049bb133111ebull;
        return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
    }
    bool varied_;
    std::uint64_t state_;
};

/// A branch whose diameters are those given times a drawn factor, and whose inner knots are displaced at
/// random.
BranchSpec branch(Draw& draw, std::string name, std::string parent, double at, std::vector<VesselKnot> knots,
                  double relative_deviation) {
    const double widening = draw.normal(1, relative_deviation);
    for (std::size_t i = 0; i < knots.size(); ++i) {
        knots[i].radius *= widening;
        if (i == 0 || i + 1 == knots.size()) continue;
        for (int axis = 0; axis < 3; ++axis) knots[i].place[axis] += draw.normal(0, 0.3 * knots[i].radius);
    }
    return {std::move(name), std::move(parent), at, std::move(knots), false};
}

/// Infrarenal aorta 16.5, common iliac 9.7 (men), spread a tenth. Renal arteries 5.6 and 5.4: CT angiography
/// of 202 patients gave areas of 28.5 and 25.4 mm², which are 6.0 and 5.7 mm (PubMed 31106842). Estimated:
/// the superior mesenteric artery 7.2 at its mouth and 4.8 farther on, the internal iliac 5.4 to 4.
VesselTreeSpec iliac_renal(Draw& draw) {
    VesselTreeSpec spec;
    spec.branches = {
        branch(draw, "aorta+LCIA+LEIA+LCFA", "", 0,
               {{{0, 0, 130}, 10.5},
                {{1, 0, 90}, 9.6},
                {{0, -1, 50}, 8.8},
                {{0, -2, 8}, 8.2},
                {{5, -1, -8}, 5.4},
                {{22, 6, -45}, 4.9},
                {{40, 16, -80}, 4},
                {{58, 0, -115}, 3.9},
                {{66, -24, -150}, 3.8},
                {{68, -30, -190}, 3.5}},
               0.1),
        branch(draw, "RCIA+REIA+RCFA", "aorta+LCIA+LEIA+LCFA", 124.4,
               {{{0, 0, 0}, 5.2},
                {{-11, 1.8, -19.2}, 4.9},
                {{-19.2, 6.7, -39.2}, 4.66},
                {{-28.7, 9.9, -58.9}, 4.59},
                {{-39.5, 17.3, -76.8}, 4.36},
                {{-48.4, 11.3, -95.9}, 4.28},
                {{-57.5, 3.3, -114.6}, 4.07},
                {{-65.1, -10.1, -130.3}, 3.98},
                {{-67.5, -22.2, -148.4}, 3.79},
                {{-69, -27.8, -169.9}, 3.66},
                {{-70, -30, -192}, 3.5}},
               0.1),
        branch(draw, "LIIA", "aorta+LCIA+LEIA+LCFA", 225,
               {{{0, 0, 0}, 2.7},
                {{-0.7, 8.1, -7.5}, 2.46},
                {{0.1, 14.8, -16.3}, 2.34},
                {{-0.9, 19.3, -26.4}, 2.13},
                {{-4, 24, -36}, 2}},
               0.1),
        branch(draw, "RIIA", "RCIA+REIA+RCFA", 96.1,
               {{{0, 0, 0}, 2.7},
                {{0.3, 5.9, -8.3}, 2.48},
                {{2.3, 11.8, -17.5}, 2.34},
                {{3.7, 17.4, -27}, 2.13},
                {{4.9, 23.2, -36.4}, 2}},
               0.1),
        branch(draw, "LRA", "aorta+LCIA+LEIA+LCFA", 30,
               {{{0, 0, 0}, 2.8},
                {{11.9, 2.4, -4.3}, 2.67},
                {{23.8, 7, -6.3}, 2.58},
                {{35.4, 12.4, -7.6}, 2.51},
                {{48, 14, -10}, 2.4}},
               0.1),
        branch(draw, "RRA", "aorta+LCIA+LEIA+LCFA", 36.3,
               {{{0, 0, 0}, 2.7},
                {{-10.7, 0.3, -3.8}, 2.58},
                {{-21, 3.9, -6.1}, 2.53},
                {{-30.2, 10.1, -8.6}, 2.43},
                {{-40.8, 13.1, -11}, 2.38},
                {{-52, 14, -12}, 2.3}},
               0.1),
        branch(draw, "SMA", "aorta+LCIA+LEIA+LCFA", 22.4,
               {{{0, 0, 0}, 3.6},
                {{-0.6, -11.5, -9}, 3.2},
                {{-1.1, -18.5, -22}, 2.93},
                {{0.1, -23.5, -35.9}, 2.8},
                {{-1.7, -25, -50.5}, 2.68},
                {{-3.2, -24.5, -65.2}, 2.47},
                {{-3, -26, -80}, 2.4}},
               0.1),
    };
    spec.body = {geometry::Landmark::AorticBifurcation, Vec3::Zero()};
    spec.targets = {{"LRA", "LRA", 38.5}, {"RRA", "RRA", 42}, {"SMA", "SMA", 60}};
    return spec;
}

/// Left main 4.5 ± 0.5, LAD 3.7 to 1.9, circumflex 3.4 (Dodge 1992); side branches by Murray's law with the
/// exponent 7/3 where no reference exists.
VesselTreeSpec left_coronary(Draw& draw) {
    VesselTreeSpec spec;
    spec.branches = {
        branch(draw, "LM+LAD", "", 0,
               {{{2, -12, 12}, 2.25},
                {{7, -20, 13.1}, 2.2},
                {{13.3, -26.5, 12.1}, 2.15},
                {{17.4, -33.1, 8.8}, 2},
                {{16.9, -31.8, -0.3}, 1.85},
                {{14.2, -33.6, -9}, 1.75},
                {{13.2, -32.5, -18}, 1.65},
                {{10, -30.6, -26.3}, 1.5},
                {{8.9, -29.5, -35.3}, 1.4},
                {{6.5, -24.5, -42.6}, 1.25},
                {{3.7, -21.1, -50.7}, 1.15},
                {{1.8, -14.3, -56.8}, 1.05},
                {{-0.6, -6.2, -61.1}, 0.95}},
               0.11),
        branch(draw, "LCX", "LM+LAD", 22.5,
               {{{0, 0, 0}, 1.7},
                {{5.5, -0.1, -5.1}, 1.61},
                {{10.4, 2.6, -9.9}, 1.54},
                {{16.5, 7.3, -9.6}, 1.42},
                {{20.3, 13.7, -9.4}, 1.38},
                {{22.5, 20.7, -11.7}, 1.29},
                {{24.5, 28, -11.7}, 1.22},
                {{23.2, 35.5, -12.2}, 1.17},
                {{21.4, 42.5, -14.8}, 1.06},
                {{17.1, 48.9, -15.6}, 1},
                {{12.3, 54.4, -18.5}, 0.9}},
               0.11),
        branch(draw, "D1", "LM+LAD", 50.2,
               {{{0, 0, 0}, 1.1},
                {{1.2, 1.8, -4.4}, 1.07},
                {{3.1, 2.7, -9.1}, 0.97},
                {{4.4, 6.3, -12.7}, 0.93},
                {{7, 8.5, -16.7}, 0.9},
                {{8.5, 10.2, -21.4}, 0.8},
                {{7.7, 13.6, -25.4}, 0.77},
                {{8.1, 16.7, -29.6}, 0.67},
                {{7.1, 19.3, -34.1}, 0.6}},
               0.1),
        branch(draw, "D2", "LM+LAD", 71,
               {{{0, 0, 0}, 0.9},
                {{0.4, 0.8, -3.3}, 0.88},
                {{2, 3.1, -6.4}, 0.8},
                {{2.2, 6.2, -9.3}, 0.73},
                {{3.2, 8.3, -12.9}, 0.72},
                {{4.5, 10, -16.5}, 0.62},
                {{4.7, 13.4, -19.1}, 0.55}},
               0.1),
        branch(draw, "S1", "LM+LAD", 45.9,
               {{{0, 0, 0}, 0.75},
                {{-0.9, 0.1, -2.9}, 0.75},
                {{-3.5, -0.2, -5.6}, 0.73},
                {{-5.4, 0.9, -8.6}, 0.69},
                {{-6.8, 1.3, -12.1}, 0.65},
                {{-8.1, 0.3, -15.5}, 0.63},
                {{-10.2, -0.1, -18.5}, 0.62},
                {{-12.9, 1.4, -20.6}, 0.56},
                {{-15.5, 2.3, -23.3}, 0.5}},
               0.1),
        branch(draw, "OM1", "LCX", 27.4,
               {{{0, 0, 0}, 1.1},
                {{-0.7, 1.1, -4.6}, 1.09},
                {{0.1, 1.7, -9.5}, 1.01},
                {{-0.9, 3.9, -14}, 0.95},
                {{-0.2, 4.8, -18.9}, 0.93},
                {{0.1, 5.2, -24}, 0.89},
                {{-1.7, 6.9, -28.3}, 0.81},
                {{-2.3, 9.6, -32.6}, 0.77},
                {{-2.3, 11.3, -37.3}, 0.75},
                {{-5.2, 11.8, -41.5}, 0.65},
                {{-7.2, 13, -46}, 0.6}},
               0.1),
        branch(draw, "OM2", "LCX", 54.6,
               {{{0, 0, 0}, 0.9},
                {{-0.2, -0.7, -4.2}, 0.89},
                {{-0.2, -0.7, -8.5}, 0.82},
                {{0.9, -1.5, -12.7}, 0.75},
                {{-0.4, -2.3, -16.7}, 0.73},
                {{-2.7, -2.8, -20.4}, 0.71},
                {{-3.3, -2.9, -24.7}, 0.64},
                {{-3.7, -2.1, -28.9}, 0.57},
                {{-5.5, -1.8, -32.9}, 0.55}},
               0.1),
    };
    spec.body = {geometry::Landmark::AorticValve, Vec3(-2, -8, 0)};
    spec.targets = {{"LAD", "LM+LAD", 101.7}, {"LCX", "LCX", 68}, {"OM1", "OM1", 47.4}};
    return spec;
}

/// Right coronary 3.9 in right dominance (Dodge 1992), around the right margin to the crux.
VesselTreeSpec right_coronary(Draw& draw) {
    VesselTreeSpec spec;
    spec.branches = {
        branch(draw, "RCA+PLV", "", 0,
               {{{0, 0, 0}, 1.95},
                {{-9, -9, -2}, 1.95},
                {{-20, -16, -8}, 1.9},
                {{-30, -17, -19}, 1.85},
                {{-36, -12, -32}, 1.8},
                {{-36, -1, -44}, 1.7},
                {{-30, 11, -53}, 1.65},
                {{-20, 21, -58}, 1.6},
                {{-8, 28, -60}, 1.5},
                {{2, 30, -58}, 1.1},
                {{12, 29, -55}, 0.9}},
               0.15),
        branch(draw, "conus", "RCA+PLV", 10,
               {{{0, 0, 0}, 0.7},
                {{1, -5, 1}, 0.7},
                {{5, -10, 2}, 0.65},
                {{10, -14, 0}, 0.6},
                {{15, -17, -4}, 0.5}},
               0.1),
        branch(draw, "AM", "RCA+PLV", 58,
               {{{0, 0, 0}, 0.9},
                {{2, -6, -3}, 0.88},
                {{9, -12, -8}, 0.8},
                {{17, -16, -15}, 0.7},
                {{24, -18, -23}, 0.6}},
               0.1),
        branch(draw, "PDA", "RCA+PLV", 113,
               {{{0, 0, 0}, 1.1},
                {{5, -4, -6}, 1.05},
                {{9, -13, -11}, 0.95},
                {{13, -23, -16}, 0.8},
                {{18, -33, -22}, 0.7}},
               0.1),
    };
    spec.body = {geometry::Landmark::AorticValve, Vec3(8, 8, -15)};
    spec.targets = {{"RCA", "RCA+PLV", 90}, {"PDA", "PDA", 35}};
    return spec;
}

/// Cavernous ICA 5.0, terminus 3.6, M1 3.1, M2 2.4 (Rai); A1 and the communicating artery by Murray's law,
/// exponent 3.
VesselTreeSpec cerebral(Draw& draw) {
    VesselTreeSpec spec;
    spec.branches = {
        branch(draw, "ICA+M1+M2sup", "", 0,
               {{{0, 0, -40}, 2.5},
                {{0.8, 0.8, -26.8}, 2.5},
                {{1, 0.9, -13.6}, 2.5},
                {{0.3, 0.3, -7.1}, 2.5},
                {{-3, -1.9, -1.9}, 2.5},
                {{-6, -7.3, -0.5}, 2.5},
                {{-7.3, -13.5, 0.8}, 2.45},
                {{-7, -18.8, 5.2}, 2.3},
                {{-5.2, -17.8, 11.8}, 2.1},
                {{-3.2, -11.8, 14.4}, 2},
                {{-0.2, -7.8, 18.2}, 1.8},
                {{4.9, -5.9, 21.3}, 1.6},
                {{11.5, -6.1, 21.9}, 1.55},
                {{17.8, -4.5, 22.6}, 1.5},
                {{23, -2, 25.7}, 1.35},
                {{25.7, 2.2, 29.9}, 1.2},
                {{26, 7.5, 33.8}, 1.15},
                {{26.5, 13.7, 36.1}, 1.1},
                {{27, 20, 38}, 1.05}},
               0.08),
        branch(draw, "A1+A2", "ICA+M1+M2sup", 81.7,
               {{{0, 0, 0}, 1.28},
                {{-3.3, -2.4, 1.3}, 1.25},
                {{-7.1, -3.6, 2.6}, 1.2},
                {{-10.8, -5.4, 3.3}, 1.15},
                {{-12.6, -8.4, 5.6}, 1.1},
                {{-13.8, -9.9, 9.4}, 1.05},
                {{-14.2, -9.6, 13.6}, 1},
                {{-14, -10.2, 17.8}, 1},
                {{-14, -10, 22}, 0.95}},
               0.08),
        branch(draw, "M2inf", "ICA+M1+M2sup", 106.1,
               {{{0, 0, 0}, 1.2},
                {{2.7, 2, -0.6}, 1.18},
                {{5.3, 4.4, -0.4}, 1.15},
                {{6.4, 7.6, -0.2}, 1.1},
                {{6.4, 11, 0.1}, 1.05},
                {{6.9, 14.3, 1.1}, 1},
                {{7.9, 17.3, 2.6}, 1},
                {{8, 20.6, 3.5}, 0.95},
                {{8, 24, 4}, 0.95}},
               0.08),
        branch(draw, "PCOM", "ICA+M1+M2sup", 73.7,
               {{{0, 0, 0}, 0.7},
                {{-0.8, 2.4, -0.1}, 0.68},
                {{-0.7, 4.8, -0.5}, 0.65},
                {{-0.8, 7.4, -0.3}, 0.64},
                {{-1.5, 9.7, 0.3}, 0.61},
                {{-2, 12, 1}, 0.6}},
               0.08),
    };
    spec.body = {geometry::Landmark::Sella, Vec3(-15, -9, 4)};  // midway between the cavernous carotids
    spec.targets = {{"M1", "ICA+M1+M2sup", 95}, {"M2sup", "ICA+M1+M2sup", 120}, {"A2", "A1+A2", 25}};
    return spec;
}

struct ArchShape {
    double drop;  // of the brachiocephalic origin below the arch's top, in LCCA diameters
    bool bovine;  // the left common carotid comes off the brachiocephalic trunk
};

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
        const auto top = std::max_element(aorta_.points.begin(), aorta_.points.end(), higher);
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

/// Diameters, gaps and the plane of the arch from CT angiography of 217 patients (Yan): ascending aorta
/// 34.6 ± 4.7, brachiocephalic 12.5 ± 2, left common carotid 8.3 ± 1.5, left subclavian 10.4 ± 2.2, gaps 4.4
/// and 6.4, arch 50 ± 14° from sagittal. Cervical ICA 4.7, bulb 7.6 (Baz 2021); vertebral 3.9 (Rai).
VesselTreeSpec arch(Draw& draw, const ArchShape& shape) {
    const double ascending = draw.normal(34.6, 4.7) / 2, trunk = draw.normal(12.5, 2) / 2,
                 carotid = draw.normal(8.3, 1.5) / 2, subclavian = draw.normal(10.4, 2.2) / 2,
                 gap_1 = draw.normal(4.4, 0.8), gap_2 = draw.normal(6.4, 1.2),
                 plane = draw.normal(50 * geometry::degree, 14 * geometry::degree);
    const Vec3 along(std::sin(plane), std::cos(plane), 0);
    const double bow = 36;  // radius of the arch's centreline [mm]
    BranchSpec aorta{"aorta", "", 0, {}, false};
    aorta.knots = {{{-2, -8, 0}, 0.92 * ascending}, {{-3, -6, 25}, ascending}, {{0, 0, 60}, ascending}};
    constexpr double clock[] = {150, 120, 90, 60, 30, 0};
    constexpr double width[] = {0.95, 0.91, 0.86, 0.82, 0.79, 0.77};
    for (int k = 0; k < 6; ++k) {
        const double a = clock[k] * geometry::degree;
        aorta.knots.push_back(
            {bow * (1 + std::cos(a)) * along + Vec3(0, 0, 60 + bow * std::sin(a)), width[k] * ascending});
    }
    aorta.knots.push_back({2 * bow * along + Vec3(-4, 4, 0), 0.73 * ascending});
    aorta.knots.push_back({2 * bow * along + Vec3(-12, 9, -70), 0.70 * ascending});
    aorta.knots.push_back({2 * bow * along + Vec3(-21, 8, -140), 0.66 * ascending});

    // Gaps are between walls on the outer side of the bend, which is longer than the centreline.
    const double inner = bow / (bow + 0.3 * ascending);
    const ArchOrigins origins(aorta, along);
    const double at_trunk = origins.below_top(shape.drop * 2 * carotid);
    const double at_carotid = origins.behind(at_trunk, inner * (trunk + gap_1 + carotid));
    const double at_subclavian =
        shape.bovine ? origins.behind(at_trunk, inner * (trunk + gap_1 + carotid + gap_2 + subclavian))
                     : origins.behind(at_carotid, inner * (carotid + gap_2 + subclavian));

    VesselTreeSpec spec;
    spec.branches = {
        aorta,
        branch(draw, "brachiocephalic+RSA", "aorta", at_trunk,
               {{{0, 0, 0}, trunk},
                {{-3.8, -0.3, 25.3}, 0.96 * trunk},
                {{-13.6, -4.9, 48.2}, 0.84 * trunk},
                {{-30.5, 1.4, 65.1}, 0.74 * trunk},
                {{-55, -1, 63}, 0.7 * trunk},
                {{-76, -1, 48}, 0.66 * trunk}},
               0),
        branch(draw, "RCCA+RICA", "brachiocephalic+RSA", 55.3,
               {{{0, 0, 0}, carotid},
                {{2.5, 2.6, 14.4}, 0.92 * carotid},
                {{2, 1.1, 30.3}, 0.87 * carotid},
                {{3.1, 4.8, 45.9}, 0.84 * carotid},
                {{1.3, 3.8, 61.6}, 0.83 * carotid},
                {{0, 2.2, 77.4}, 0.83 * carotid},
                {{3, 5.9, 92.7}, 3.6},
                {{3.3, 7.7, 108.5}, 3.8},
                {{1.1, 8.9, 124.2}, 2.6},
                {{2.2, 11.6, 139.7}, 2.4},
                {{4.7, 11.7, 155.6}, 2.35}},
               0),
    };
    std::vector<VesselKnot> left = {{{2.3, -1.4, 16.4}, 0.95 * carotid},
                                    {{5.5, -2.6, 32.6}, 0.92 * carotid},
                                    {{7.6, -0.6, 48.9}, 0.89 * carotid},
                                    {{10, -3.7, 65.1}, 0.86 * carotid},
                                    {{15.1, -1.1, 80.6}, 0.85 * carotid},
                                    {{14.6, 0.9, 96.8}, 0.83 * carotid},
                                    {{11.3, -0.2, 113}, 0.83 * carotid},
                                    {{13.9, 2.5, 129.2}, 0.83 * carotid},
                                    {{13.8, 0.7, 145.6}, 3.6},
                                    {{12.6, 4.4, 161.3}, 3.8},
                                    {{13.3, 9.7, 176.8}, 2.6},
                                    {{12.6, 8.9, 193.4}, 2.4},
                                    {{10.7, 10.2, 209.9}, 2.35}};
    if (shape.bovine) {  // from the trunk across to the left side, then as usual
        for (VesselKnot& knot : left) knot.place += Vec3(13, 3, -22);
        left.erase(left.begin(), left.begin() + 2);
        left.insert(left.begin(), {{{8, 2, 6}, carotid}, {{16, 3, 15}, 0.95 * carotid}});
    }
    left.insert(left.begin(), {{0, 0, 0}, carotid});
    spec.branches.push_back(shape.bovine ? branch(draw, "LCCA+LICA", "brachiocephalic+RSA", 24, left, 0)
                                         : branch(draw, "LCCA+LICA", "aorta", at_carotid, left, 0));
    const double left_bifurcation = shape.bovine ? 142 : 155;
    spec.branches.push_back(branch(draw, "LSA", "aorta", at_subclavian,
                                   {{{0, 0, 0}, subclavian},
                                    {{3.7, -0.1, 21.1}, 0.96 * subclavian},
                                    {{4.8, 3.2, 41.9}, 0.92 * subclavian},
                                    {{20, 0.7, 56.7}, 0.88 * subclavian},
                                    {{39.5, 3.8, 63.8}, 0.84 * subclavian},
                                    {{58.6, -0.3, 56.5}, 0.82 * subclavian},
                                    {{76, 0, 44}, 0.79 * subclavian}},
                                   0));
    spec.branches.push_back(branch(draw, "RECA", "RCCA+RICA", 99.5,
                                   {{{0, 0, 0}, 2.2},
                                    {{3, -5.7, 7.3}, 2.04},
                                    {{4.3, -7.2, 17.6}, 1.95},
                                    {{2.6, -10.1, 27.6}, 1.87},
                                    {{2.1, -12.1, 37.9}, 1.77},
                                    {{2.4, -11, 48.3}, 1.7}},
                                   0.1));
    spec.branches.push_back(branch(draw, "LECA", "LCCA+LICA", left_bifurcation,
                                   {{{0, 0, 0}, 2.2},
                                    {{-3.6, -2.9, 5.4}, 2.05},
                                    {{-7.3, -5.5, 13}, 2},
                                    {{-7.5, -6.7, 21.8}, 1.88},
                                    {{-4.9, -7.2, 30.3}, 1.85},
                                    {{-2.7, -6.9, 38.9}, 1.75},
                                    {{-3.9, -7.2, 47.7}, 1.7}},
                                   0.1));
    spec.branches.push_back(branch(draw, "LVA", "LSA", 60.1,
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
                                    {{-4.4, 9.3, 81.2}, 1.6}},
                                   0.1));
    spec.branches.push_back(branch(draw, "RVA", "brachiocephalic+RSA", 78.6,
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
                                    {{2.5, 5.6, 79.1}, 1.5}},
                                   0.1));
    spec.body = {geometry::Landmark::AorticValve, aorta.knots[0].place};
    spec.targets = {{"LICA", "LCCA+LICA", shape.bovine ? 188.0 : 201.3},
                    {"RICA", "RCCA+RICA", 145.4},
                    {"arch", "aorta", shape.bovine ? at_trunk : at_carotid}};
    return spec;
}

/// The arch above the iliac and renal vessels: an aorta from its root to the left groin.
VesselTreeSpec whole_aorta(Draw& draw) {
    VesselTreeSpec spec = arch(draw, {0.5, false}), below = iliac_renal(draw);
    BranchSpec &aorta = spec.branches[0], &abdominal = below.branches[0];
    // The descending aorta runs from behind on the left to the middle where the renal arteries leave.
    const Vec3 shift = abdominal.knots[0].place + Vec3(8, 12, 45) - aorta.knots.back().place;
    for (VesselKnot& knot : aorta.knots) knot.place += shift;
    const std::size_t joint = aorta.knots.size();
    aorta.knots.insert(aorta.knots.end(), abdominal.knots.begin(), abdominal.knots.end());
    aorta.name = abdominal.name;

    VesselTreeSpec alone;
    alone.name = aorta.name;
    alone.branches = {aorta};
    const SampledBranch grown = grow(alone).branches[0];
    const auto nearer = [&](const Vec3& a, const Vec3& b) {
        const Vec3& place = aorta.knots[joint].place;
        return (a - place).norm() < (b - place).norm();
    };
    const double above = grown.step() * static_cast<double>(std::min_element(grown.points.begin(),
                                                                             grown.points.end(), nearer) -
                                                            grown.points.begin());
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
VesselTreeSpec arch_with_coronary(Draw& draw) {
    VesselTreeSpec spec = arch(draw, {0.5, false}), heart = left_coronary(draw);
    // The thinnest vessel determines the grid for all: thin ones that lead nowhere here are left out.
    const auto thin = [](const BranchSpec& branch) { return branch.knots.back().radius < 0.85; };
    std::erase_if(heart.branches, thin);
    std::erase_if(heart.targets, [&](const NamedTarget& target) {
        return std::none_of(heart.branches.begin(), heart.branches.end(),
                            [&](const BranchSpec& branch) { return branch.name == target.branch; });
    });
    constexpr double mouth = 15;  // along the aorta [mm]
    std::vector<VesselKnot>& stem = heart.branches[0].knots;
    const Vec3 way = (stem[1].place - stem[0].place).normalized();
    const Vec3 shift = spec.branches[0].knots[1].radius * way - stem[0].place;
    const double lengthened = spec.branches[0].knots[1].radius;
    for (VesselKnot& knot : stem) knot.place += shift;
    stem.insert(stem.begin(), {Vec3::Zero(), stem[0].radius});
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

struct Known {
    VesselPreset preset;
    VesselTreeSpec (*build)(Draw&);
};
// The type of an arch depends on how far the trunk's origin lies below its top: under 1, 1 to 2, over 2
// diameters.
const std::array<Known, 10> known = {{
    {{"arch-1", "aortic arch of type I to both carotid arteries"},
     [](Draw& d) {
         return arch(d, {0.5, false});
     }},
    {{"arch-2", "aortic arch of type II"},
     [](Draw& d) {
         return arch(d, {1.5, false});
     }},
    {{"arch-3", "aortic arch of type III"},
     [](Draw& d) {
         return arch(d, {2.5, false});
     }},
    {{"arch-bovine", "left carotid off the brachiocephalic trunk"},
     [](Draw& d) {
         return arch(d, {0.5, true});
     }},
    {{"aorta", "from both groins to the arch and the carotid arteries"}, whole_aorta},
    {{"arch-lca", "aortic arch with the left coronary artery"}, arch_with_coronary},
    {{"lca", "left coronary artery"}, left_coronary},
    {{"rca", "right coronary artery"}, right_coronary},
    {{"iliac-renal", "from both groins to the renal arteries"}, iliac_renal},
    {{"cerebral", "internal carotid to the middle and anterior cerebral arteries"}, cerebral},
}};

}  // namespace

std::span<const VesselPreset> vessel_presets() {
    static const auto list = [] {
        std::array<VesselPreset, known.size()> result;
        for (std::size_t i = 0; i < known.size(); ++i) result[i] = known[i].preset;
        return result;
    }();
    return list;
}

VesselTreeSpec vessel_preset(std::string_view name, std::uint64_t seed) {
    std::vector<std::string_view> names;
    for (const Known& one : known) {
        names.push_back(one.preset.name);
        if (one.preset.name != name) continue;
        // Some draws intersect themselves; then the next one is taken.
        for (std::uint64_t attempt = 0;; ++attempt) {
            try {
                Draw draw(seed, attempt);
                VesselTreeSpec spec = one.build(draw);
                spec.name = name;
                grow(spec);
                return spec;
            } catch (const io::InputError&) {
                if (seed == 0 || attempt == 50) throw;
            }
        }
    }
    throw io::InputError(fmt::format("'{}' is not a preset{}; presets are: {}", name,
                                     io::suggestion(name, names), io::joined(names)));
}

}  // namespace anatomy
