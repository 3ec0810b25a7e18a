#include "engine/anatomy/grow/preset_builders.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::degree;

// Women's aorta is 0.864 of men's (15.9 ± 1.7 and 18.4 ± 1.8 mm in CT of 3692 adults: Kim 2022, PLoS One
// 17:e0268077), and wider by 1 mm for 0.23 m² of body surface, as the ascending one (Turkbey 2014, PMID
// 23681649). It grows with age (Joh 2013, PMID 23225798): 0.25 % a year (estimate).
const Traits aorta_traits{0.1, {0.864, true, 0.0025, 0.24}};
// 10.9 ± 1.7 mm in both sexes (Kim 2022); men's and women's 9.7 and 8.5 mm.
const Traits common_iliac_traits{0.14, {0.876, true, 0.0025}};
const Traits external_iliac_traits{0.13, {0.92, true, 0.0025}};  // estimate
// 8.5 mm in men, 7.9 in women, larger with age and size of the body (Sandgren 1999, J Vasc Surg 29:503).
const Traits common_femoral_traits{0.13, {0.93, true, 0.002}};
const Traits superficial_femoral_traits{0.12, {0.952, true, 0.001}};  // 6.3 and 6.0 mm
const Traits visceral_traits{0.15, {0.93, false, 0}, 0.1};            // estimate
// Areas of 28.5 and 25.4 mm² in CT angiography of 202 patients: 6.0 and 5.7 mm (PMID 31106842).
const Traits renal_traits{0.12, {0.93, false, 0}, 0.1};

constexpr std::size_t at_bifurcation = 4;  // knot of the aorta that stays where it is

/// Infrarenal aorta 16.5, common iliac 9.7, common femoral 8.5: those of men. External iliac 8.6 (estimate).
std::vector<Stretch> aorta_to_groin() {
    return {
        {"aorta",
         {{{0, 0, 150}, 10.8}, {{0, 0, 130}, 10.5}, {{1, 0, 90}, 9.6}, {{0, -1, 50}, 8.8}, {{0, -2, 8}, 8.2}},
         aorta_traits},
        {"LCIA", {{{5, -1, -8}, 5.4}, {{22, 6, -45}, 4.9}}, common_iliac_traits},
        {"LEIA", {{{40, 16, -80}, 4.35}, {{58, 0, -115}, 4.3}}, external_iliac_traits},
        {"LCFA", {{{66, -24, -150}, 4.25}, {{68, -30, -190}, 4.25}}, common_femoral_traits}};
}

std::vector<Stretch> right_iliac() {
    return {{"RCIA",
             {{{0, 0, 0}, 5.2},
              {{-11, 1.8, -19.2}, 4.9},
              {{-19.2, 6.7, -39.2}, 4.66},
              {{-28.7, 9.9, -58.9}, 4.59}},
             common_iliac_traits},
            {"REIA",
             {{{-39.5, 17.3, -76.8}, 4.4},
              {{-48.4, 11.3, -95.9}, 4.35},
              {{-57.5, 3.3, -114.6}, 4.3},
              {{-65.1, -10.1, -130.3}, 4.3}},
             external_iliac_traits},
            {"RCFA",
             {{{-67.5, -22.2, -148.4}, 4.25}, {{-69, -27.8, -169.9}, 4.25}, {{-70, -30, -192}, 4.25}},
             common_femoral_traits}};
}

/// Both iliac arteries below an aorta that is named after all of the left leg's. Internal iliac 5.4 to 4
/// (estimate); the common iliac's length differs by 8 mm (estimate).
void add_iliac(Variation& v, VesselTreeSpec& spec) {
    const std::string aorta = spec.branches[0].name;
    spec.branches.push_back(v.branch(right_iliac(), {aorta, 144.4}));
    spec.branches.push_back(v.branch("LIIA", visceral_traits, {aorta, 245, 8, 10 * degree},
                                     {{{0, 0, 0}, 2.7},
                                      {{-0.7, 8.1, -7.5}, 2.46},
                                      {{0.1, 14.8, -16.3}, 2.34},
                                      {{-0.9, 19.3, -26.4}, 2.13},
                                      {{-4, 24, -36}, 2}}));
    spec.branches.push_back(v.branch("RIIA", visceral_traits, {"RCIA+REIA+RCFA", 96.1, 8, 10 * degree},
                                     {{{0, 0, 0}, 2.7},
                                      {{0.3, 5.9, -8.3}, 2.48},
                                      {{2.3, 11.8, -17.5}, 2.34},
                                      {{3.7, 17.4, -27}, 2.13},
                                      {{4.9, 23.2, -36.4}, 2}}));
}

/// Renal arteries at the lower third of L1, 17 mm below the superior mesenteric (J Vasc Surg, Pennington and
/// Soames; the spread of 5 mm is an estimate), take-off angle ± 10° (estimate). Mouths of the coeliac and
/// superior mesenteric arteries 5.9, of the inferior one 3.1, at the lower third of L3. From the coeliac to
/// the superior mesenteric artery 0.78 of the aorta's 20.1 mm (PMID 23262554). Angle of the superior
/// mesenteric artery 50 ± 16° (Jang 2002, J Korean Soc Med Inform 8(1)). Common hepatic 5, splenic 5
/// (estimates).
void add_visceral(Variation& v, VesselTreeSpec& spec) {
    const std::string aorta = spec.branches[0].name;
    spec.branches.push_back(v.branch("LRA", renal_traits, {aorta, 50, 5, 10 * degree},
                                     {{{0, 0, 0}, 2.8},
                                      {{11.9, 2.4, -4.3}, 2.67},
                                      {{23.8, 7, -6.3}, 2.58},
                                      {{35.4, 12.4, -7.6}, 2.51},
                                      {{48, 14, -10}, 2.4}}));
    spec.branches.push_back(v.branch("RRA", renal_traits, {aorta, 56.3, 5, 10 * degree},
                                     {{{0, 0, 0}, 2.7},
                                      {{-10.7, 0.3, -3.8}, 2.58},
                                      {{-21, 3.9, -6.1}, 2.53},
                                      {{-30.2, 10.1, -8.6}, 2.43},
                                      {{-40.8, 13.1, -11}, 2.38},
                                      {{-52, 14, -12}, 2.3}}));
    spec.branches.push_back(v.branch("SMA", visceral_traits, {aorta, 42.4, 2, 16 * degree},
                                     {{{0, 0, 0}, 2.95},
                                      {{-0.6, -11.5, -9}, 2.95},
                                      {{-1.1, -18.5, -22}, 2.85},
                                      {{0.1, -23.5, -35.9}, 2.75},
                                      {{-1.7, -25, -50.5}, 2.65},
                                      {{-3.2, -24.5, -65.2}, 2.47},
                                      {{-3, -26, -80}, 2.4}}));
    spec.branches.push_back(v.branch(
        {{"coeliac", {{{0, 0, 0}, 2.95}, {{0, -12, -4}, 2.95}, {{-1, -21, -6}, 2.85}}, visceral_traits},
         {"CHA",
          {{{-7, -28, -5}, 2.5}, {{-17, -31, -2}, 2.4}, {{-28, -29, 2}, 2.3}, {{-37, -24, 8}, 2.2}},
          visceral_traits}},
        {aorta, 26.7, 2, 10 * degree}));
    spec.branches.push_back(v.branch("splenic", visceral_traits, {"coeliac+CHA", 22},
                                     {{{0, 0, 0}, 2.5},
                                      {{7, -2, 2}, 2.5},
                                      {{17, 0, 6}, 2.45},
                                      {{28, 7, 6}, 2.4},
                                      {{39, 14, 10}, 2.3},
                                      {{50, 21, 10}, 2.2}}));
    spec.branches.push_back(v.branch("IMA", visceral_traits, {aorta, 105, 5, 8 * degree},
                                     {{{0, 0, 0}, 1.55},
                                      {{3, -9.5, -5}, 1.55},
                                      {{9, -12.5, -16}, 1.52},
                                      {{16, -13.5, -32}, 1.5},
                                      {{22, -13, -50}, 1.5}}));
}

}  // namespace

VesselTreeSpec iliac_renal(Variation& v) {
    VesselTreeSpec spec;
    spec.branches = {v.branch(aorta_to_groin(), {}, at_bifurcation)};
    add_iliac(v, spec);
    add_visceral(v, spec);
    spec.body = {geometry::Landmark::AorticBifurcation, Vec3::Zero()};
    spec.targets = {v.target("LRA", "LRA", 38.5), v.target("RRA", "RRA", 42), v.target("SMA", "SMA", 60)};
    return spec;
}

/// Superficial femoral 6.3 (men), deep femoral 5.2 (estimate). The common femoral artery divides 4 cm below
/// the inguinal ligament; mid-thigh is 20 cm below it (estimates).
VesselTreeSpec femoral(Variation& v) {
    std::vector<Stretch> stretches = aorta_to_groin();
    stretches.push_back(
        {"LSFA",
         {{{68, -30, -215}, 3.15}, {{64, -25, -260}, 3.15}, {{58, -15, -310}, 3.1}, {{51, -3, -355}, 3.05}},
         superficial_femoral_traits});
    VesselTreeSpec spec;
    spec.branches = {v.branch(stretches, {}, at_bifurcation)};
    add_iliac(v, spec);
    spec.branches.push_back(v.branch("LPFA", {0.15, {0.95, true, 0}},
                                     {spec.branches[0].name, 377, 8, 8 * degree},
                                     {{{0, 0, 0}, 2.6},
                                      {{7, 6, -11}, 2.55},
                                      {{12, 13, -28}, 2.45},
                                      {{15, 20, -55}, 2.3},
                                      {{14, 26, -90}, 2.1},
                                      {{12, 30, -125}, 1.9}}));
    spec.body = {geometry::Landmark::AorticBifurcation, Vec3::Zero()};
    spec.targets = {v.target("LSFA", spec.branches[0].name, 500), v.target("LPFA", "LPFA", 80)};
    return spec;
}

}  // namespace anatomy
