/// Figures of treatments: against closed forms, and finite whatever hands do.

#include "engine/exercise/treatment_score.h"

#include <algorithm>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "engine/blood/pressure.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/score_file.h"
#include "engine/run/truth_files.h"
#include "tests/cases.h"
#include "tests/engine/exercise/treated.h"
#include "tests/engine/vessels.h"

namespace exercise {
namespace {

using geometry::Vec3;
using Commands = std::vector<script::Command>;
using physics::OpenedPlace;

/// A stent along a line, a sample every millimetre, in a vessel of `wall` radius.
PlacedStent stent_along(const Vec3& distal, const Vec3& proximal, double stent, double wall,
                        double reference) {
    PlacedStent made;
    made.device = "test stent";
    const int steps = static_cast<int>(std::lround((proximal - distal).norm()));
    for (int k = 0; k <= steps; ++k) {
        PlacedStent::Sample sample;
        sample.at = distal + (proximal - distal) * k / steps;
        sample.place.reference = reference;
        sample.place.before = sample.place.radius = sample.place.largest = wall;
        sample.place.stent = stent;
        made.samples.push_back(sample);
    }
    return made;
}

StentedLesion against(const anatomy::Anatomy& anatomy, const LesionExtent& lesion,
                      const std::vector<PlacedStent>& stents, const Ballooned& ballooned = {}) {
    std::vector<const PlacedStent*> all;
    for (const PlacedStent& stent : stents) all.push_back(&stent);
    return stents_against(anatomy, lesion, all, ballooned).value();
}

void run_on(Exercise& exercise, const script::Command& first, int frames) {
    exercise.next_frame(Commands{first});
    for (int k = 1; k < frames; ++k) exercise.next_frame(Commands{});
}

/// Predilated, stented and left.
Exercise stented_tube(const std::string& lesion = "stent_from_mm = 46\nstent_to_mm = 60\n") {
    Exercise exercise(test::scenario_to_treat(test::balloon_catheter(true), lesion), false);
    run_on(exercise, script::Inflate{13}, 160);
    run_on(exercise, script::Deflate{}, 120);
    return exercise;
}

void expect_sound(const TreatmentScore& score) {
    const auto finite = [](const std::optional<double>& value) { return !value || std::isfinite(*value); };
    for (const LesionScore& lesion : score.lesions) {
        for (const LesionState& s : {lesion.before, lesion.after}) {
            ASSERT_TRUE(std::isfinite(s.lumen) && s.lumen > 0 && s.reference > 0 && s.residual <= 100);
            ASSERT_TRUE(finite(s.proximal) && finite(s.distal) && finite(s.ratio) && finite(s.hyperaemic));
            ASSERT_GE(*s.ratio, 0);
            ASSERT_LE(*s.ratio, 1 + 1e-12);
            ASSERT_LE(*s.hyperaemic, *s.ratio + 1e-9);
            ASSERT_GE(*s.gradient(), -1e-9);
        }
        if (!lesion.stented) continue;
        const StentedLesion& s = *lesion.stented;
        ASSERT_TRUE(s.covered >= 0 && s.covered <= 100);
        ASSERT_TRUE(s.missed_proximal >= 0 && s.missed_proximal <= lesion.length + 1e-9);
        ASSERT_TRUE(s.missed_distal >= 0 && s.missed_distal <= lesion.length + 1e-9);
        ASSERT_LE(s.covered, 100 * (1 - (s.missed_proximal + s.missed_distal) / lesion.length) + 1e-6);
        ASSERT_TRUE(std::isfinite(s.proximal_end) && s.proximal_end <= s.distal_end);
        ASSERT_TRUE(finite(s.proximal_off) && finite(s.distal_off));
        ASSERT_FALSE(s.protrusion) << "the tube leaves no vessel";
        ASSERT_TRUE(s.apposed && *s.apposed >= 0 && *s.apposed <= 100);
        ASSERT_TRUE(s.gap && *s.gap >= 0 && std::isfinite(*s.gap));
        ASSERT_TRUE(s.expansion && *s.expansion > 0 && *s.expansion < 300);
        ASSERT_TRUE(!s.beyond_proximal || *s.beyond_proximal >= 0);
        ASSERT_TRUE(!s.beyond_distal || *s.beyond_distal >= 0);
    }
    for (const StentScore& stent : score.stents) {
        ASSERT_TRUE(stent.length >= 0 && stent.length < 30 && stent.diameter >= 0 && stent.diameter < 12);
        ASSERT_LT(stent.lesion, static_cast<int>(score.lesions.size()));
    }
    const InflationTally& t = score.tally;
    ASSERT_TRUE(t.longest <= t.occluded + 1e-9 && t.beyond_rated <= t.seconds + 1e-9);
    ASSERT_LE(score.dissections_left, score.dissections);
}

}  // namespace

TEST(TreatmentScore, CoverageIsTheUnionOfIntervals) {
    EXPECT_DOUBLE_EQ(part_covered(10, 20, {}), 0);
    EXPECT_DOUBLE_EQ(part_covered(10, 20, {{0, 30}}), 1);
    EXPECT_DOUBLE_EQ(part_covered(10, 20, {{12, 14}, {18, 30}, {13, 15}}), 0.5);
    EXPECT_DOUBLE_EQ(part_covered(10, 20, {{0, 5}, {25, 30}}), 0);
    EXPECT_DOUBLE_EQ(part_covered(10, 10, {{0, 30}}), 0);
}

TEST(TreatmentScore, TheNarrowestPlaceIsThatWithTheLeastOfItsVessel) {
    const anatomy::Anatomy vessel = test::straight_vessel(100, 2);
    const BranchStretch stretch = stretch_of(vessel, 0, 50, 10);
    std::vector<OpenedPlace> places(stretch.axis.size());
    for (OpenedPlace& place : places) place.reference = 2, place.before = 1.5, place.radius = 2.2;
    // Past its end it does not count.
    places[0].radius = 0.1;
    places[places.size() / 2].before = 0.5;
    places[places.size() / 2 + 1].reference = 4;  // a wide vessel: 1.4 of 4 is less than 1 of 2
    places[places.size() / 2 + 1].radius = 1.4;
    places[places.size() / 2 - 1].radius = 1;
    const LesionState before = lumen_of(stretch, places, &OpenedPlace::before),
                      after = lumen_of(stretch, places, &OpenedPlace::radius);
    EXPECT_DOUBLE_EQ(before.lumen, 1);
    EXPECT_DOUBLE_EQ(before.residual, 75);
    EXPECT_DOUBLE_EQ(after.lumen, 2.8);
    EXPECT_DOUBLE_EQ(after.reference, 8);
    EXPECT_DOUBLE_EQ(after.residual, 65);
    for (OpenedPlace& place : places) place.reference = 2, place.radius = 2.2;
    EXPECT_NEAR(lumen_of(stretch, places, &OpenedPlace::radius).residual, -10, 1e-9);
}

TEST(TreatmentScore, EndsCoverageAndAppositionOfAStentOnALine) {
    const anatomy::Anatomy vessel = test::straight_vessel(100, 2);
    // The lesion from 40 to 60; the stent from 45 to 65, off the axis by 0.5, with a gap of 0.2.
    const LesionExtent lesion{0, 40, 60, std::pair(38.0, 62.0)};
    const PlacedStent one = stent_along({0.5, 0, -65}, {0.5, 0, -45}, 1.7, 1.9, 2);
    StentedLesion s = against(vessel, lesion, {one}, {35, 70});
    EXPECT_NEAR(s.covered, 75, 1e-9);
    EXPECT_NEAR(s.missed_proximal, 5, 1e-9);
    EXPECT_NEAR(s.missed_distal, 0, 1e-9);
    EXPECT_NEAR(s.proximal_end, 45, 1e-9);
    EXPECT_NEAR(s.distal_end, 65, 1e-9);
    EXPECT_NEAR(*s.proximal_off, 7, 1e-9);
    EXPECT_NEAR(*s.distal_off, 3, 1e-9);
    EXPECT_NEAR(*s.beyond_proximal, 10, 1e-9);
    EXPECT_NEAR(*s.beyond_distal, 5, 1e-9);
    EXPECT_NEAR(*s.gap, 0.2, 1e-9);
    EXPECT_EQ(*s.apposed, 100);
    EXPECT_NEAR(*s.expansion, 85, 1e-9);
    EXPECT_FALSE(s.protrusion);
    EXPECT_TRUE(s.jailed.empty());
    // A second one, half of whose samples stand off, leaves a gap of 3 mm between them.
    PlacedStent two = stent_along({0, 0, -42}, {0, 0, -33}, 1.4, 1.5, 2);
    for (std::size_t k = 0; k < 5; ++k) two.samples[k].place.radius = 2;
    s = against(vessel, lesion, {one, two});
    EXPECT_NEAR(s.covered, 85, 1e-9);
    EXPECT_EQ(s.missed_proximal, 0);
    EXPECT_NEAR(s.proximal_end, 33, 1e-9);
    EXPECT_NEAR(*s.gap, 0.6, 1e-9);
    EXPECT_NEAR(*s.apposed, 100.0 * 26 / 31, 1e-9);
    EXPECT_NEAR(*s.expansion, 70, 1e-9);
    EXPECT_FALSE(s.beyond_distal);
    // One that misses it by all.
    s = against(vessel, lesion, {stent_along({0, 0, -30}, {0, 0, -20}, 2, 2, 2)});
    EXPECT_EQ(s.covered, 0);
    EXPECT_EQ(s.missed_proximal, 0);
    EXPECT_NEAR(s.missed_distal, 20, 1e-9);
    EXPECT_NEAR(*s.distal_off, -32, 1e-9);
    // Where the wall lies on the stent, that is as wide as the lumen.
    s = against(vessel, lesion, {stent_along({0, 0, -60}, {0, 0, -40}, 2, 1.8, 2)});
    EXPECT_EQ(*s.gap, 0);
    EXPECT_NEAR(*s.expansion, 90, 1e-9);
    EXPECT_FALSE(stents_against(vessel, lesion, {}));
}

/// The renal artery of 3 mm leaves an aorta of 9 mm, so that its origin is 9 mm along its centreline.
TEST(TreatmentScore, AStentInAnOriginStandsOutOfItAndJailsWhatLiesBesideIt) {
    anatomy::Anatomy abdomen = test::small_abdomen();
    test::add_branch(abdomen, "early", 1, {20, 0, 50}, {20, 20, 50}, 1);  // of the renal artery
    test::add_branch(abdomen, "late", 1, {40, 0, 50}, {40, 20, 50}, 1);
    const int renal = 1;
    const double origin = anatomy::origin_of(abdomen, renal);
    EXPECT_NEAR(origin, 9, 1.01);
    // From 4 mm in the aorta to 12 mm in the artery.
    const PlacedStent stent = stent_along({origin + 12, 0, 50}, {origin - 4, 0, 50}, 3, 3, 3);
    const StentedLesion s = against(abdomen, {renal, 2, 10, std::pair(-2.0, 12.0)}, {stent});
    EXPECT_NEAR(s.proximal_end, -4, 1e-6);
    EXPECT_NEAR(s.distal_end, 12, 1e-6);
    EXPECT_NEAR(*s.proximal_off, -2, 1e-6);
    EXPECT_NEAR(*s.distal_off, 0, 1e-6);
    EXPECT_NEAR(*s.protrusion, 4, 1e-6);
    EXPECT_NEAR(s.covered, 100, 1e-9);
    EXPECT_EQ(s.jailed, std::vector<std::string>{"early"});
    // In the artery alone.
    const StentedLesion within = against(abdomen, {renal, 2, 10, {}},
                                         {stent_along({origin + 9, 0, 50}, {origin + 1, 0, 50}, 3, 3, 3)});
    EXPECT_EQ(*within.protrusion, 0);
    EXPECT_FALSE(within.proximal_off);
    EXPECT_TRUE(within.jailed.empty());
    // Wholly in the aorta: no part of it is in the branch.
    const StentedLesion astray =
        against(abdomen, {renal, 2, 10, {}}, {stent_along({0, 0, 30}, {0, 0, 70}, 3, 9, 9)});
    EXPECT_FALSE(astray.protrusion);
    EXPECT_FALSE(astray.gap);
    EXPECT_FALSE(astray.apposed);
    EXPECT_EQ(astray.covered, 0);
    EXPECT_LT(astray.distal_end, 0);
    // Arcs are continuous along the artery and its way out of the aorta.
    double last = signed_arc(abdomen, renal, {0.1, 0.3, 50});
    for (double x = 0.2; x < 49; x += 0.1) {
        const double arc = signed_arc(abdomen, renal, {x, 0.3, 50});
        EXPECT_NEAR(arc - last, 0.1, 0.06) << x;
        last = arc;
    }
}

TEST(TreatmentScore, BeforeATreatmentALesionIsWhatTheFileSays) {
    Exercise exercise(test::scenario_to_treat(), false);
    exercise.next_frame(Commands{});
    const TreatmentScore score = exercise.finish().treatment.value();
    ASSERT_EQ(score.lesions.size(), 1u);
    const LesionScore& lesion = score.lesions[0];
    EXPECT_EQ(lesion.branch, "tube");
    EXPECT_NEAR(lesion.at, 54, 1e-9);
    EXPECT_NEAR(lesion.length, 12, 1e-9);
    EXPECT_NEAR(lesion.before.residual, 60, 1e-9);
    EXPECT_NEAR(lesion.before.lumen, 1.6, 1e-9);
    EXPECT_NEAR(lesion.before.reference, 4, 1e-9);
    EXPECT_EQ(lesion.after.residual, lesion.before.residual);
    EXPECT_FALSE(lesion.stented);
    EXPECT_NEAR(*lesion.before.proximal, 93, 1e-9);
    EXPECT_GT(*lesion.before.gradient(), 1);
    EXPECT_EQ(*lesion.before.ratio, *lesion.after.ratio);
    EXPECT_LT(*lesion.before.hyperaemic, *lesion.before.ratio);
    // By hand: the bed's R with the flow, and the lesion's a and b in series.
    const BranchStretch& stretch =
        exercise.simulation().treatment().stretch_of(exercise.simulation().treatment().lesions()[0]);
    std::vector<double> radii;
    double a = 0;
    for (std::size_t k = 0; k < stretch.axis.size(); ++k) {
        radii.push_back(2 * (1 - 0.6 * stretch.shape[k]));
        a += 8 * 3.5e-3 * 1e-3 * (1 / std::pow(radii.back() * 1e-3, 4) - 1 / std::pow(2e-3, 4)) /
             std::numbers::pi * 1e-6;
    }
    const double b = 1.52 * 530 * std::pow(1 / 0.16 - 1, 2) / std::pow(std::numbers::pi * 4e-6, 2) * 1e-12;
    const double flow = exercise.simulation().contrast().unobstructed().sources[0].inflow;
    const double pressure = 93 * 133.322, bed = pressure / flow;
    const auto ratio = [&](double r) {
        return r * (-(r + a) + std::sqrt((r + a) * (r + a) + 4 * b * pressure)) / (2 * b) / pressure;
    };
    EXPECT_NEAR(*lesion.before.ratio, ratio(bed), 1e-6);
    EXPECT_NEAR(*lesion.before.hyperaemic, ratio(bed / 3), 1e-6);
    fmt::print("60 % of 4 mm: Pd/Pa {:.3f} at rest, {:.3f} in hyperaemia, flow {:.2f} ml/s\n",
               *lesion.before.ratio, *lesion.before.hyperaemic, flow);
}

TEST(TreatmentScore, AStentedTubeHasTheFiguresOfItsGeometry) {
    const Exercise exercise = stented_tube();
    const TreatmentScore score = exercise.finish().treatment.value();
    const LesionScore& lesion = score.lesions.at(0);
    const StentedLesion& s = lesion.stented.value();
    ASSERT_EQ(score.stents.size(), 1u);
    EXPECT_EQ(score.stents[0].lesion, 0);
    EXPECT_FALSE(score.stents[0].attached);
    const double length = score.stents[0].length;
    // The catheter's tip is at 66, the stent's middle 7 mm and half of its crimped length before that.
    const double middle = 66 - 7 - 0.5 * 14 / 0.95;
    EXPECT_NEAR(length, 14, 0.4);
    // The devices take the bend of 40 degrees on its inner side, where the way is up to 0.7 mm shorter.
    EXPECT_NEAR(s.proximal_end, middle - length / 2 + 0.35, 0.35);
    EXPECT_NEAR(s.distal_end, middle + length / 2 + 0.35, 0.35);
    EXPECT_NEAR(*s.proximal_off, s.proximal_end - 46, 1e-9);
    EXPECT_NEAR(*s.distal_off, s.distal_end - 60, 1e-9);
    EXPECT_EQ(s.missed_proximal, 0);
    EXPECT_NEAR(s.missed_distal, 60 - s.distal_end, 1e-9);
    EXPECT_NEAR(s.covered, 100 * (s.distal_end - 48) / 12, 1e-6);
    EXPECT_TRUE(s.beyond_proximal && s.beyond_distal);
    EXPECT_LT(*s.beyond_distal, 3);
    EXPECT_LT(lesion.after.residual, 20);
    EXPECT_LT(*lesion.after.gradient(), 0.2 * *lesion.before.gradient());
    EXPECT_GT(*s.expansion, 80);
    EXPECT_EQ(score.tally.inflations, 1);
    EXPECT_NEAR(score.tally.highest, 13, 1e-9);
    EXPECT_EQ(score.dissections_left, 0);
    expect_sound(score);
    fmt::print(
        "stented tube: lumen {:.2f} -> {:.2f} mm, residual {:.1f} -> {:.1f} %, Pd/Pa {:.3f} -> {:.3f}, in "
        "hyperaemia {:.3f} -> {:.3f}; stent {:.2f} to {:.2f} mm ({:+.2f}, {:+.2f}), covered {:.1f} %, beyond "
        "{:.2f} and {:.2f} mm, gap {:.2f} mm, apposed {:.0f} %, expansion {:.1f} %, balloon to artery "
        "{:.3f}\n",
        lesion.before.lumen, lesion.after.lumen, lesion.before.residual, lesion.after.residual,
        *lesion.before.ratio, *lesion.after.ratio, *lesion.before.hyperaemic, *lesion.after.hyperaemic,
        s.proximal_end, s.distal_end, *s.proximal_off, *s.distal_off, s.covered, *s.beyond_proximal,
        *s.beyond_distal, *s.gap, *s.apposed, *s.expansion, score.tally.largest_ratio);
    // The trace's quantities, and the truth.
    const Observation now = Reader(exercise.simulation()).read(exercise);
    EXPECT_EQ(now.balloon_pressure, 0);
    EXPECT_NEAR(now.balloon_diameter, 1.3, 1e-6);
    EXPECT_NEAR(now.lumen, lesion.after.lumen, 1e-9);
    EXPECT_TRUE(now.gradient >= *lesion.after.gradient() - 1e-9);  // with devices in it
}

TEST(TreatmentScore, ABalloonThatFillsTheVesselTakesThePressureBehindIt) {
    Exercise exercise(test::scenario_to_treat(), false);
    run_on(exercise, script::Inflate{10}, 120);
    const Observation now = Reader(exercise.simulation()).read(exercise);
    EXPECT_NEAR(now.balloon_pressure, 10, 1e-9);
    EXPECT_NEAR(now.balloon_diameter, 4, 0.35);
    EXPECT_NEAR(now.gradient, 93 - blood::collateral_pressure, 1);
    // The figures of the lesion have no balloon in them.
    const TreatmentScore score = exercise.score().treatment.value();
    EXPECT_LT(*score.lesions[0].after.gradient(), *score.lesions[0].before.gradient());
    EXPECT_GT(score.tally.occluded, 1);
}

TEST(TreatmentScore, ATearOfTheBalloonIsNoEventOfTheTeacher) {
    scenario::Device large = test::balloon_catheter();
    for (auto& row : large.balloon->law.table) row.diameter *= 1.6;
    Exercise exercise(test::scenario_to_treat(large), false);
    run_on(exercise, script::Inflate{12}, 200);
    run_on(exercise, script::Deflate{}, 100);
    const Score score = exercise.finish();
    EXPECT_GE(score.treatment->dissections, 1);
    EXPECT_EQ(score.treatment->dissections_left, 1);
    EXPECT_TRUE(score.set_by_teacher.empty());
    exercise.next_frame(Commands{script::Complicate{script::ComplicationKind::Spasm, "tube", 20, 10, 30}});
    EXPECT_EQ(exercise.finish().set_by_teacher.size(), 1u);
    // The next attempt begins anew, and what was is kept.
    exercise.next_frame(Commands{script::Reset{}});
    EXPECT_EQ(exercise.finish().treatment->dissections, 0);
    EXPECT_EQ(exercise.finish().treatment->tally.inflations, 0);
    EXPECT_NEAR(exercise.finish().treatment->lesions[0].after.residual, 60, 1e-9);
    ASSERT_EQ(exercise.earlier_attempts().size(), 1u);
    EXPECT_EQ(exercise.earlier_attempts()[0].treatment->dissections_left, 1);
}

TEST(TreatmentScore, WithoutALesionThereIsNone) {
    Exercise exercise(test::small_scenario(), false);
    exercise.next_frame(Commands{script::Advance{2}});
    EXPECT_FALSE(exercise.finish().treatment);
    EXPECT_EQ(to_json({"test 1", "", exercise.finish(), {}, {}}).find("treatment"), std::string::npos);
    const Observation now = Reader(exercise.simulation()).read(exercise);
    for (const double value : {now.balloon_pressure, now.balloon_diameter, now.lumen, now.gradient})
        EXPECT_TRUE(std::isnan(value));
}

TEST(TreatmentScore, TheTruthOfAnImageHasLesionsAndStents) {
    Exercise exercise(test::scenario_to_treat(test::balloon_catheter(true)), true);
    run_on(exercise, script::Beam{true}, 2);
    const auto truth = [&] { return nlohmann::json::parse(run::to_json(exercise.truth(), exercise.time())); };
    EXPECT_FALSE(truth().contains("stents"));
    run_on(exercise, script::Inflate{11}, 120);
    const nlohmann::json json = truth();
    const nlohmann::json& lesion = json.at("lesions").at(0);
    EXPECT_EQ(lesion["branch"], "tube");
    const auto& places = exercise.simulation().treatment().lesions()[0].places;
    for (const char* key : {"along_mm", "radius_mm", "reference_radius_mm", "stent_radius_mm"})
        EXPECT_EQ(lesion.at(key).size(), places.size()) << key;
    EXPECT_NEAR(lesion["along_mm"][4].get<double>(), 48, 1e-9);
    EXPECT_EQ(lesion["radius_mm"][10].get<double>(), places[10].radius);
    const nlohmann::json& stent = json.at("stents").at(0);
    EXPECT_EQ(stent["device"], "test balloon");
    EXPECT_EQ(stent["attached"], true);
    const auto& samples = exercise.simulation().treatment().stents()[0].samples;
    EXPECT_EQ(stent["radii_mm"].size(), samples.size());
    EXPECT_NEAR(stent["distal_mm"][0].get<double>(), samples.front().at.x(), 1e-9);
    EXPECT_NEAR(stent["proximal_mm"][1].get<double>(), samples.back().at.y(), 1e-9);
}

TEST(TreatmentScore, SnapshotsKeepIt) {
    Exercise exercise(test::scenario_to_treat(test::balloon_catheter(true)), false);
    run_on(exercise, script::Inflate{9}, 80);
    const Exercise::Snapshot snapshot = exercise.snapshot();
    const auto text = [&] {
        return to_json({"test 1", "", exercise.finish(), exercise.earlier_attempts(), {}});
    };
    const std::string then = text();
    run_on(exercise, script::Deflate{}, 60);
    const std::string later = text();
    EXPECT_NE(later, then);
    exercise.restore(snapshot);
    EXPECT_EQ(text(), then);
    run_on(exercise, script::Deflate{}, 60);
    EXPECT_EQ(text(), later);
}

/// Whatever is inflated and deployed wherever.
TEST(TreatmentScore, OfWildTreatmentsIsSound) {
    int stented = 0, burst = 0, torn = 0, ruptured = 0;
    double widest = 0, least_covered = 100, most_covered = 0;
    const int seeds = test::cases(500);
    for (int seed = 1; seed <= seeds; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(static_cast<unsigned>(seed));
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        const auto pick = [&](unsigned n) { return random() % n; };
        scenario::Device device = test::balloon_catheter(pick(3) > 0, false);
        if (device.kind == scenario::DeviceKind::Stent && pick(3) == 0)
            device = test::balloon_catheter(true, true);
        if (device.balloon) {
            const double scale = 0.7 + 0.9 * unit();
            for (auto& row : device.balloon->law.table) row.diameter *= scale;
        }
        const char* const plaques[] = {"soft", "fibrous", "calcified"};
        std::string lesion = fmt::format("plaque = \"{}\"\n", plaques[pick(3)]);
        if (pick(2))
            lesion += fmt::format("stent_from_mm = {:.1f}\nstent_to_mm = {:.1f}\n", 40 + 5 * unit(),
                                  58 + 5 * unit());
        Exercise exercise(test::scenario_to_treat(device, lesion, 35 + 38 * unit()), false);
        for (int action = 0; action < 4; ++action) {
            script::Command command = script::Deflate{};
            if (pick(3))
                command = device.balloon ? script::Command(script::Inflate{2 + 22 * unit()})
                                         : script::Command(script::RetrieveSheath{20 * unit()});
            run_on(exercise, command, static_cast<int>(5 + pick(pick(4) == 0 ? 180 : 30)));
            const TreatmentScore score = exercise.score().treatment.value();
            ASSERT_NO_FATAL_FAILURE(expect_sound(score));
            const Observation now = Reader(exercise.simulation()).read(exercise);
            ASSERT_TRUE(std::isfinite(now.lumen) && std::isfinite(now.gradient)) << now.gradient;
            ASSERT_EQ(std::isfinite(now.balloon_diameter), device.balloon.has_value());
        }
        const TreatmentScore score = exercise.finish().treatment.value();
        burst += score.bursts > 0, torn += score.dissections > 0, ruptured += score.ruptures > 0;
        widest = std::max(widest, score.tally.largest_ratio);
        if (const auto& s = score.lesions[0].stented) {
            ++stented;
            least_covered = std::min(least_covered, s->covered);
            most_covered = std::max(most_covered, s->covered);
        }
    }
    EXPECT_GT(stented, seeds / 5);
    fmt::print(
        "seeds 1 to {}: {} stented, covered {:.0f} to {:.0f} %, {} burst, {} torn, {} ruptured, balloon to "
        "artery up to {:.2f}\n",
        seeds, stented, least_covered, most_covered, burst, torn, ruptured, widest);
}

}  // namespace exercise
