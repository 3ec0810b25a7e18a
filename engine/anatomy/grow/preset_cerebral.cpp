#include "engine/anatomy/grow/preset_builders.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::degree;

// Men's arteries tend to be a little wider (Rai 2013, PMID 23188788), others found no difference of the sexes
// (Med Imaging Radiat Oncol 2009;53:248); those of the back widen with age (Rai). Lengths hardly follow the
// body's (estimate).
constexpr Trend cerebral_trend{0.97, false, 0.001, 0.1}, basilar_trend{0.97, false, 0.003, 0.1};
constexpr double brain_height = 0.25;
// Cavernous carotid 5.0 ± 0.6, M1 3.1 ± 0.4, M2 2.4 ± 0.4 (Rai 2013, PMID 22490430).
const Traits carotid_siphon{0.12, cerebral_trend, 0.05, brain_height};
const Traits first_middle{0.13, cerebral_trend, 0.07, brain_height};
const Traits second_middle{0.167, cerebral_trend, 0.07, brain_height};
// ACA 2.09 ± 0.27, anterior and posterior communicating 1.5 ± 0.22 and 1.22 ± 0.20, PCA 1.99 ± 0.31 wide;
// A1 14 ± 1.4, anterior communicating 2.7 ± 0.6, posterior communicating 12.9 ± 0.9, P1 6.6 ± 1.1, basilar
// 30.2 ± 1.9 long (MR angiography: Shatri 2017, PMID 29104678).
const Traits anterior{0.13, cerebral_trend, 0.05, brain_height};
const Traits communicating{0.165, cerebral_trend, 0, 0};
const Traits posterior{0.156, cerebral_trend, 0.06, brain_height};
// Intracranial vertebral 3.9 ± 0.8 to 2.8 ± 0.6, basilar 3.6 ± 0.6 to 3.1 ± 0.5 (Rai 2013, PMID 23188788).
const Traits intracranial_vertebral{0.2, cerebral_trend, 0.1, brain_height};
const Traits basilar{0.17, basilar_trend, 0.06, brain_height};
const Traits small_cerebral{0.12, cerebral_trend, 0.08, brain_height};  // estimate

constexpr std::size_t at_terminus = 10;  // knot of the carotid that stays where it is

/// The vessel on the right side, where `side` is −1.
std::vector<VesselKnot> on_side(double side, std::vector<VesselKnot> knots) {
    for (VesselKnot& knot : knots) knot.place.x() *= side;
    return knots;
}

/// Through the siphon into the upper division of the middle cerebral artery. The artery starts `midline` to
/// the side of the midline [mm].
std::vector<Stretch> carotid_to_middle(const std::string& prefix, double side, double midline) {
    const auto placed = [&](std::vector<VesselKnot> knots) {
        for (VesselKnot& knot : knots) knot.place.x() += midline;
        return on_side(side, std::move(knots));
    };
    return {{prefix + "ICA",
             placed({{{0, 0, -40}, 2.5},
                     {{0.8, 0.8, -26.8}, 2.5},
                     {{1, 0.9, -13.6}, 2.5},
                     {{0.3, 0.3, -7.1}, 2.5},
                     {{-3, -1.9, -1.9}, 2.5},
                     {{-6, -7.3, -0.5}, 2.5},
                     {{-7.3, -13.5, 0.8}, 2.45},
                     {{-7, -18.8, 5.2}, 2.3},
                     {{-5.2, -17.8, 11.8}, 2.1},
                     {{-3.2, -11.8, 14.4}, 2},
                     {{-0.2, -7.8, 18.2}, 1.8}}),
             carotid_siphon},
            {prefix + "M1",
             placed({{{4.9, -5.9, 21.3}, 1.6}, {{11.5, -6.1, 21.9}, 1.55}, {{17.8, -4.5, 22.6}, 1.5}}),
             first_middle},
            {prefix + "M2sup",
             placed({{{23, -2, 25.7}, 1.35},
                     {{25.7, 2.2, 29.9}, 1.2},
                     {{26, 7.5, 33.8}, 1.15},
                     {{26.5, 13.7, 36.1}, 1.1},
                     {{27, 20, 38}, 1.05}}),
             second_middle}};
}

Stretch lower_division(const std::string& prefix, double side) {
    return {prefix + "M2inf",
            on_side(side, {{{0, 0, 0}, 1.2},
                           {{2.7, 2, -0.6}, 1.18},
                           {{5.3, 4.4, -0.4}, 1.15},
                           {{6.4, 7.6, -0.2}, 1.1},
                           {{6.4, 11, 0.1}, 1.05},
                           {{6.9, 14.3, 1.1}, 1},
                           {{7.9, 17.3, 2.6}, 1},
                           {{8, 20.6, 3.5}, 0.95},
                           {{8, 24, 4}, 0.95}}),
            second_middle};
}

/// Carotid, middle and anterior cerebral artery of one side of the circle.
void add_anterior_half(Variation& v, VesselTreeSpec& spec, const std::string& prefix, double side) {
    const double midline = 13.6 * length_factor(brain_height, v.patient());  // from the carotid [mm]
    spec.branches.push_back(v.branch(carotid_to_middle(prefix, side, midline), {}, at_terminus));
    const std::string carotid = spec.branches.back().name;
    spec.branches.push_back(v.branch({{prefix + "A1",
                                       on_side(side, {{{0, 0, 0}, 1.1},
                                                      {{-3.2, -2.4, 1.3}, 1.08},
                                                      {{-6.7, -3.6, 2.6}, 1.05},
                                                      {{-9.7, -5.4, 3.3}, 1.05}}),
                                       anterior},
                                      {prefix + "A2",
                                       on_side(side, {{{-11.2, -8.4, 5.6}, 1.05},
                                                      {{-11.7, -9.9, 9.4}, 1.02},
                                                      {{-11.7, -9.6, 13.6}, 1},
                                                      {{-11.6, -10.2, 17.8}, 1},
                                                      {{-11.6, -10, 22}, 0.95}}),
                                       anterior}},
                                     {carotid, 81.7}));
    spec.branches.push_back(v.branch({lower_division(prefix, side)}, {carotid, 106.1, 2, 5 * degree}));
    spec.branches.push_back(v.branch(
        prefix + "ophthalmic", small_cerebral, {carotid, 66.5},
        on_side(
            side,
            {{{0, 0, 0}, 0.7}, {{0.4, -3, 1.6}, 0.68}, {{1.2, -9, 2.4}, 0.65}, {{2.6, -16, 1.6}, 0.62}})));
}

/// Vertebral, basilar and left posterior cerebral artery are one branch, whose knot at the basilar's tip
/// stays where it is.
constexpr std::size_t at_basilar_tip = 8;
const std::string left_posterior = "LVA+BA+LP1+LP2", right_posterior = "RP1+RP2";

void add_posterior_half(Variation& v, VesselTreeSpec& spec) {
    spec.branches.push_back(
        v.branch({{"LVA",
                   {{{14, 28, -66}, 1.95}, {{13, 27, -54}, 1.9}, {{10, 22, -38}, 1.75}, {{5, 17, -25}, 1.6}},
                   intracranial_vertebral},
                  {"BA",
                   {{{0.5, 14, -15}, 1.75},
                    {{0, 11.5, -6}, 1.7},
                    {{0, 8.5, 2}, 1.62},
                    {{0, 5.2, 8.6}, 1.55},
                    {{0.7, 3.3, 12}, 1.4}},
                   basilar},
                  {"LP1", {{{3.2, 1.9, 14.7}, 1.05}, {{7.5, 1, 15.6}, 1.02}}, posterior},
                  {"LP2",
                   {{{12.5, 3.5, 16.2}, 1},
                    {{16, 10, 16.5}, 0.98},
                    {{17.5, 18, 17}, 0.95},
                    {{17, 27, 18}, 0.9},
                    {{15, 36, 19}, 0.85}},
                   posterior}},
                 {}, at_basilar_tip));
    BranchSpec right = v.branch({{"RVA",
                                  {{{-14, 28, -66}, 1.8},
                                   {{-13, 27, -54}, 1.7},
                                   {{-10, 22, -38}, 1.55},
                                   {{-5, 17.4, -25}, 1.45},
                                   {{0.3, 14.2, -16}, 1.4}},
                                  intracranial_vertebral}});
    v.join(right, left_posterior, 61);
    spec.branches.push_back(right);
    spec.branches.push_back(
        v.branch({{"RP1", {{{0, 0, 0}, 1.05}, {{-3, -1, 1.8}, 1.05}, {{-8.2, -1.8, 3}, 1.02}}, posterior},
                  {"RP2",
                   {{{-13.4, 0.7, 3.4}, 1},
                    {{-16.9, 7.2, 3.8}, 0.98},
                    {{-18.4, 15.2, 4.2}, 0.95},
                    {{-17.9, 24.2, 5.2}, 0.9},
                    {{-15.9, 33.2, 6.2}, 0.85}},
                   posterior}},
                 {left_posterior, 86.2}));
    for (const double side : {1.0, -1.0}) {
        const std::string prefix = side > 0 ? "L" : "R";
        spec.branches.push_back(v.branch(prefix + "SCA", small_cerebral,
                                         {left_posterior, side > 0 ? 84.0 : 84.8},
                                         on_side(side, {{{0, 0, 0}, 0.7},
                                                        {{3.5, 0.2, -0.6}, 0.7},
                                                        {{8.5, 3, -1.6}, 0.67},
                                                        {{13, 10, -2.5}, 0.65},
                                                        {{15, 19, -2.5}, 0.6}})));
        spec.branches.push_back(v.branch(
            prefix + "PICA", small_cerebral, {side > 0 ? left_posterior : "RVA", 33, 3, 0},
            on_side(side,
                    {{{0, 0, 0}, 0.7}, {{3.2, 3.2, -1.2}, 0.7}, {{5.5, 9, -4}, 0.66}, {{5, 16, -6}, 0.62}})));
    }
}

}  // namespace

/// Cavernous carotid 5.0, terminus 3.6, M1 3.1, M2 2.4 (Rai); A1 and the communicating artery by Murray's
/// law, exponent 3.
VesselTreeSpec cerebral(Variation& v) {
    VesselTreeSpec spec;
    spec.branches = {
        v.branch(carotid_to_middle("", 1, 0)),
        v.branch({{"A1",
                   {{{0, 0, 0}, 1.28},
                    {{-3.3, -2.4, 1.3}, 1.25},
                    {{-7.1, -3.6, 2.6}, 1.2},
                    {{-10.8, -5.4, 3.3}, 1.15}},
                   anterior},
                  {"A2",
                   {{{-12.6, -8.4, 5.6}, 1.1},
                    {{-13.8, -9.9, 9.4}, 1.05},
                    {{-14.2, -9.6, 13.6}, 1},
                    {{-14, -10.2, 17.8}, 1},
                    {{-14, -10, 22}, 0.95}},
                   anterior}},
                 {"ICA+M1+M2sup", 81.7}),
        v.branch({lower_division("", 1)}, {"ICA+M1+M2sup", 106.1, 2, 5 * degree}),
        v.branch("PCOM", communicating, {"ICA+M1+M2sup", 73.7},
                 {{{0, 0, 0}, 0.7},
                  {{-0.8, 2.4, -0.1}, 0.68},
                  {{-0.7, 4.8, -0.5}, 0.65},
                  {{-0.8, 7.4, -0.3}, 0.64},
                  {{-1.5, 9.7, 0.3}, 0.61},
                  {{-2, 12, 1}, 0.6}}),
    };
    spec.body = {geometry::Landmark::Sella, Vec3(-15, -9, 4)};  // midway between the cavernous carotids
    spec.targets = {v.target("M1", "ICA+M1+M2sup", 95), v.target("M2sup", "ICA+M1+M2sup", 120),
                    v.target("A2", "A1+A2", 25)};
    return spec;
}

/// Both internal carotids and vertebrals, and the circle that they feed, complete as in a quarter of people.
/// Ophthalmic, superior cerebellar and posterior inferior cerebellar 1.4 (estimates). The carotids are 27 mm
/// apart.
VesselTreeSpec circle_of_willis(Variation& v) {
    VesselTreeSpec spec;
    add_anterior_half(v, spec, "L", 1);
    add_anterior_half(v, spec, "R", -1);
    add_posterior_half(v, spec);
    BranchSpec front = v.branch("ACOM", communicating, {"LA1+LA2", 16},
                                {{{0, 0, 0}, 0.75}, {{-3.2, -0.3, 0.3}, 0.73}, {{-6.4, 0, 0}, 0.75}});
    v.join(front, "RA1+RA2", 16);
    spec.branches.push_back(front);
    for (const double side : {1.0, -1.0}) {
        const std::string prefix = side > 0 ? "L" : "R";
        BranchSpec back = v.branch(prefix + "PCOM", communicating,
                                   {prefix + "ICA+" + prefix + "M1+" + prefix + "M2sup", 73.7},
                                   on_side(side, {{{0, 0, 0}, 0.65},
                                                  {{-1.8, 3.6, -0.6}, 0.61},
                                                  {{-3.4, 8.4, 0}, 0.61},
                                                  {{-4.6, 13.4, 1.4}, 0.63}}));
        v.join(back, side > 0 ? left_posterior : right_posterior, side > 0 ? 102 : 9.8);
        spec.branches.push_back(back);
    }
    spec.body = {geometry::Landmark::Sella, Vec3(0, -9, 4)};  // midway between the cavernous carotids
    spec.targets = {v.target("LM1", "LICA+LM1+LM2sup", 95), v.target("RM1", "RICA+RM1+RM2sup", 95),
                    v.target("ACOM", "LA1+LA2", 17), v.target("basilar tip", left_posterior, 88),
                    v.target("RP2", right_posterior, 20)};
    return spec;
}

}  // namespace anatomy
