#include "engine/anatomy/grow/preset_builders.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::degree;

// Women's coronary arteries are 9 % narrower also for their size of body, and age changes nothing (Dodge
// 1992, Circulation 86:232); the figures are those of men. Lengths go with the heart's size (estimate).
constexpr Trend coronary{0.91, true, 0};
const Traits left_main{0.111, coronary, 0.1, 0.5};
const Traits descending{0.108, coronary, 0.08, 0.5, 0.18};
const Traits circumflex{0.147, coronary, 0.08, 0.5};
const Traits right{0.154, coronary, 0.08, 0.5};
const Traits side_branch{0.15, coronary, 0.12, 0.5};  // estimate

// Angles of forks in CT: LAD and circumflex 63° in 201 patients (Moon 2018, PMID 30212455), 73 ± 19° in 50
// (Heart Res Open J 2016;3(1)); LAD and first diagonal 46 ± 19°, circumflex and first marginal 48 ± 24°,
// posterior descending 53 ± 27° (Pflederer 2006, Invest Radiol 41:793). Of the latter three, two thirds of
// the spread are taken: the rest of their course follows from the heart's shape (estimate).
constexpr double circumflex_tilt = 19 * degree, diagonal_tilt = 13 * degree, marginal_tilt = 16 * degree,
                 septal_tilt = 13 * degree;

}  // namespace

/// Left main 4.5 ± 0.5, LAD 3.7 ± 0.4 to 1.9 ± 0.4, circumflex 3.4 ± 0.5 (Dodge 1992); side branches by
/// Murray's law with the exponent 7/3 where no reference exists. Mouths of side branches ± 4 mm (estimate).
VesselTreeSpec left_coronary(Variation& v) {
    VesselTreeSpec spec;
    spec.branches = {
        v.branch(
            {{"LM", {{{2, -12, 12}, 2.25}, {{7, -20, 13.1}, 2.2}, {{13.3, -26.5, 12.1}, 2.15}}, left_main},
             {"LAD",
              {{{17.4, -33.1, 8.8}, 2},
               {{16.9, -31.8, -0.3}, 1.85},
               {{14.2, -33.6, -9}, 1.75},
               {{13.2, -32.5, -18}, 1.65},
               {{10, -30.6, -26.3}, 1.5},
               {{8.9, -29.5, -35.3}, 1.4},
               {{6.5, -24.5, -42.6}, 1.25},
               {{3.7, -21.1, -50.7}, 1.15},
               {{1.8, -14.3, -56.8}, 1.05},
               {{-0.6, -6.2, -61.1}, 0.95}},
              descending}}),
        v.branch("LCX", circumflex, {"LM+LAD", 22.5, 0, circumflex_tilt},
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
                  {{12.3, 54.4, -18.5}, 0.9}}),
        v.branch("D1", side_branch, {"LM+LAD", 50.2, 3, diagonal_tilt},
                 {{{0, 0, 0}, 1.1},
                  {{1.2, 1.8, -4.4}, 1.07},
                  {{3.1, 2.7, -9.1}, 0.97},
                  {{4.4, 6.3, -12.7}, 0.93},
                  {{7, 8.5, -16.7}, 0.9},
                  {{8.5, 10.2, -21.4}, 0.8},
                  {{7.7, 13.6, -25.4}, 0.77},
                  {{8.1, 16.7, -29.6}, 0.67},
                  {{7.1, 19.3, -34.1}, 0.6}}),
        v.branch("D2", side_branch, {"LM+LAD", 71, 4, diagonal_tilt},
                 {{{0, 0, 0}, 0.9},
                  {{0.4, 0.8, -3.3}, 0.88},
                  {{2, 3.1, -6.4}, 0.8},
                  {{2.2, 6.2, -9.3}, 0.73},
                  {{3.2, 8.3, -12.9}, 0.72},
                  {{4.5, 10, -16.5}, 0.62},
                  {{4.7, 13.4, -19.1}, 0.55}}),
        v.branch("S1", side_branch, {"LM+LAD", 45.9, 3, septal_tilt},
                 {{{0, 0, 0}, 0.75},
                  {{-0.9, 0.1, -2.9}, 0.75},
                  {{-3.5, -0.2, -5.6}, 0.73},
                  {{-5.4, 0.9, -8.6}, 0.69},
                  {{-6.8, 1.3, -12.1}, 0.65},
                  {{-8.1, 0.3, -15.5}, 0.63},
                  {{-10.2, -0.1, -18.5}, 0.62},
                  {{-12.9, 1.4, -20.6}, 0.56},
                  {{-15.5, 2.3, -23.3}, 0.5}}),
        v.branch("OM1", side_branch, {"LCX", 27.4, 4, marginal_tilt},
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
                  {{-7.2, 13, -46}, 0.6}}),
        v.branch("OM2", side_branch, {"LCX", 54.6, 4, marginal_tilt},
                 {{{0, 0, 0}, 0.9},
                  {{-0.2, -0.7, -4.2}, 0.89},
                  {{-0.2, -0.7, -8.5}, 0.82},
                  {{0.9, -1.5, -12.7}, 0.75},
                  {{-0.4, -2.3, -16.7}, 0.73},
                  {{-2.7, -2.8, -20.4}, 0.71},
                  {{-3.3, -2.9, -24.7}, 0.64},
                  {{-3.7, -2.1, -28.9}, 0.57},
                  {{-5.5, -1.8, -32.9}, 0.55}}),
    };
    spec.body = {geometry::Landmark::AorticValve, Vec3(-2, -8, 0)};
    spec.targets = {v.target("LAD", "LM+LAD", 101.7), v.target("LCX", "LCX", 68),
                    v.target("OM1", "OM1", 47.4)};
    return spec;
}

/// Right coronary 3.9 ± 0.6 in right dominance (Dodge 1992), around the right margin to the crux.
VesselTreeSpec right_coronary(Variation& v) {
    VesselTreeSpec spec;
    spec.branches = {
        v.branch({{"RCA",
                   {{{0, 0, 0}, 1.95},
                    {{-9, -9, -2}, 1.95},
                    {{-20, -16, -8}, 1.9},
                    {{-30, -17, -19}, 1.85},
                    {{-36, -12, -32}, 1.8},
                    {{-36, -1, -44}, 1.7},
                    {{-30, 11, -53}, 1.65},
                    {{-20, 21, -58}, 1.6},
                    {{-8, 28, -60}, 1.5}},
                   right},
                  {"PLV", {{{2, 30, -58}, 1.1}, {{12, 29, -55}, 0.9}}, right}}),
        v.branch("conus", side_branch, {"RCA+PLV", 10, 2, diagonal_tilt},
                 {{{0, 0, 0}, 0.7},
                  {{1, -5, 1}, 0.7},
                  {{5, -10, 2}, 0.65},
                  {{10, -14, 0}, 0.6},
                  {{15, -17, -4}, 0.5}}),
        v.branch("AM", side_branch, {"RCA+PLV", 58, 4, diagonal_tilt},
                 {{{0, 0, 0}, 0.9},
                  {{2, -6, -3}, 0.88},
                  {{9, -12, -8}, 0.8},
                  {{17, -16, -15}, 0.7},
                  {{24, -18, -23}, 0.6}}),
        v.branch("PDA", side_branch, {"RCA+PLV", 113, 2, marginal_tilt},
                 {{{0, 0, 0}, 1.1},
                  {{5, -4, -6}, 1.05},
                  {{9, -13, -11}, 0.95},
                  {{13, -23, -16}, 0.8},
                  {{18, -33, -22}, 0.7}}),
    };
    spec.body = {geometry::Landmark::AorticValve, Vec3(8, 8, -15)};
    spec.targets = {v.target("RCA", "RCA+PLV", 90), v.target("PDA", "PDA", 35)};
    return spec;
}

}  // namespace anatomy
