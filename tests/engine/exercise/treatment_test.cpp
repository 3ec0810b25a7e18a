/// Balloons and stents: what they do to a lesion, to devices, blood and image, and what they refuse.

#include "engine/exercise/treatment.h"

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/script/recording.h"
#include "physics/wire/energy.h"
#include "tests/cases.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/exercise/treated.h"
#include "tests/engine/exercise/wild_exercise.h"

namespace exercise {
namespace {

using Commands = std::vector<script::Command>;
using script::DeviceRole;

void wait(Exercise& exercise, int frames) {
    for (int k = 0; k < frames; ++k) exercise.next_frame(Commands{});
}

const physics::OpenedPlace& narrowest(const Simulation& simulation) {
    const auto& places = simulation.treatment().lesions()[0].places;
    return *std::ranges::min_element(places, {}, &physics::OpenedPlace::radius);
}

double residual(const Simulation& simulation) {
    const physics::OpenedPlace& place = narrowest(simulation);
    return 1 - place.radius / place.reference;
}

double flow_beyond(const Simulation& simulation) {
    return simulation.contrast().blood().resting().back();
}

std::string denied(Exercise& exercise, const script::Command& command) {
    const Frame frame = exercise.next_frame(Commands{command});
    return frame.motion.denied;
}

/// A balloon 1.6 times as wide as the vessel.
scenario::Device large_balloon(bool stented = false) {
    scenario::Device large = test::balloon_catheter(stented);
    for (auto& row : large.balloon->law.table) row.diameter *= 1.6;
    return large;
}

/// The dissections that are set.
std::vector<Complication> flaps(const Exercise& exercise) {
    std::vector<Complication> set;
    for (const Complication& c : exercise.simulation().complications())
        if (c.kind == script::ComplicationKind::Dissection && c.set()) set.push_back(c);
    return set;
}

void inflate_and_deflate(Exercise& exercise, double pressure) {
    exercise.next_frame(Commands{script::Inflate{pressure}});
    wait(exercise, 200);
    exercise.next_frame(Commands{script::Deflate{}});
    wait(exercise, 200);
}

}  // namespace

TEST(Treatment, ABalloonOpensALesionThatRecoilsAndAStentKeepsItOpen) {
    for (const bool stented : {false, true}) {
        Exercise exercise(test::scenario_to_treat(test::balloon_catheter(stented)), false);
        EXPECT_NEAR(residual(exercise.simulation()), 0.6, 0.03);
        exercise.next_frame(Commands{script::Inflate{13}});  // a stent resists, too
        wait(exercise, 160);
        EXPECT_NEAR(exercise.simulation().treatment().inflation()->pressure, 13, 1e-9);
        EXPECT_LT(residual(exercise.simulation()), 0.1);
        exercise.next_frame(Commands{script::Deflate{}});
        wait(exercise, 120);
        EXPECT_EQ(exercise.simulation().treatment().inflation()->pressure, 0);
        const double left = residual(exercise.simulation());
        if (stented) {
            EXPECT_LT(left, 0.15);
            ASSERT_EQ(exercise.simulation().treatment().stents().size(), 1u);
            EXPECT_FALSE(exercise.simulation().treatment().stents()[0].attached);
        } else {
            EXPECT_GT(left, 0.15);
            EXPECT_LT(left, 0.35);
        }
    }
}

TEST(Treatment, TheFlowBeyondALesionFollowsItsOpening) {
    Exercise exercise(test::scenario_to_treat(), false);
    const double narrow = flow_beyond(exercise.simulation());
    exercise.next_frame(Commands{script::Inflate{10}});
    wait(exercise, 120);
    EXPECT_TRUE(exercise.simulation().treatment().occluded());
    EXPECT_EQ(flow_beyond(exercise.simulation()), 0);
    exercise.next_frame(Commands{script::Deflate{}});
    wait(exercise, 120);
    EXPECT_FALSE(exercise.simulation().treatment().occluded());
    EXPECT_GT(flow_beyond(exercise.simulation()), narrow);
    const InflationTally& tally = exercise.simulation().treatment().tally();
    EXPECT_EQ(tally.inflations, 1);
    EXPECT_NEAR(tally.highest, 10, 1e-9);
    EXPECT_GT(tally.occluded, 3);
    EXPECT_LT(tally.occluded, tally.seconds + 4);
    EXPECT_EQ(tally.beyond_rated, 0);
}

/// The balloon is a dogbone until the plaque yields.
TEST(Treatment, ABalloonShowsAWaistUntilThePlaqueYields) {
    Exercise exercise(test::scenario_to_treat(test::balloon_catheter(), "plaque = \"calcified\"\n"), false);
    exercise.next_frame(Commands{script::Inflate{6}});
    wait(exercise, 120);
    const auto waist = [&] {
        const std::vector<double>& radii = exercise.simulation().treatment().inflation()->radii;
        return *std::min_element(radii.begin() + 5, radii.end() - 5) / *std::ranges::max_element(radii);
    };
    EXPECT_LT(waist(), 0.6);
    EXPECT_GT(residual(exercise.simulation()), 0.45);
    exercise.next_frame(Commands{script::Inflate{16.5}});
    wait(exercise, 120);
    EXPECT_GT(waist(), 0.85);
    EXPECT_GT(exercise.simulation().treatment().tally().beyond_rated, 1);
}

TEST(Treatment, WhatCannotBeDoneIsSaidAndChangesNothing) {
    Exercise exercise(test::scenario_to_treat(), false);
    test::expect_said(denied(exercise, script::Deploy{}), "has no stent");
    test::expect_said(denied(exercise, script::RetrieveSheath{5}), "no stent in a sheath");
    exercise.next_frame(Commands{script::Inflate{8}});
    wait(exercise, 60);
    test::expect_said(denied(exercise, script::Withdraw{5, DeviceRole::Balloon}), "deflate it first");
    EXPECT_DOUBLE_EQ(exercise.simulation().inserted(DeviceRole::Balloon), 66);
    // Not inside yet.
    Exercise out(test::scenario_to_treat(test::balloon_catheter(), "", 12), false);
    test::expect_said(denied(out, script::Inflate{8}), "not inside yet");
    // At the end of its wire.
    Exercise ahead(test::scenario_to_treat(test::balloon_catheter(), "", 73.5), false);
    ahead.next_frame(Commands{script::Advance{5, DeviceRole::Balloon}});
    wait(ahead, 3);
    test::expect_said(denied(ahead, script::Advance{5, DeviceRole::Balloon}), "end of the wire");
    // Commands that no balloon takes.
    const script::CommandScript script = script::parse_commands("3 inflate 8 atm\n", "x.gw");
    test::expect_refusal([&] { Exercise(test::small_scenario(), Pictures::None, {}, &script); },
                         "x.gw:1:3: 'inflate 8 atm' asks for a balloon, and the scenario has none");
    for (const char* wrong :
         {"3 inflate nan atm\n", "3 inflate -1 atm\n", "3 inflate 8 mmHg\n", "3 inflate\n"})
        test::expect_refusal([&] { script::parse_commands(wrong, "x.gw"); }, "x.gw:1:");
}

TEST(Treatment, ABalloonBurstsBeyondItsRatedPressureAndSaysSo) {
    Exercise exercise(test::scenario_to_treat(), false);
    exercise.next_frame(Commands{script::Inflate{30}});
    std::vector<TreatmentEvent> events;
    for (int k = 0; k < 300; ++k) {
        const Frame frame = exercise.next_frame(Commands{});
        events.insert(events.end(), frame.motion.treated.begin(), frame.motion.treated.end());
    }
    const auto burst = std::ranges::find(events, TreatmentEvent::Kind::Burst, &TreatmentEvent::kind);
    ASSERT_NE(burst, events.end());
    EXPECT_NEAR(burst->pressure, 14 * Treatment::bursts_at, 0.2);
    EXPECT_GT(burst->volume, 0.1);
    test::expect_said(sentence(*burst, exercise.simulation().anatomy()), "The balloon has burst at 17.");
    EXPECT_GT(exercise.simulation().contrast().injected(), 0);
    test::expect_said(denied(exercise, script::Inflate{4}), "has burst");
    EXPECT_EQ(exercise.simulation().treatment().inflation()->pressure, 0);
}

TEST(Treatment, ABalloonThatIsTooLargeTearsTheWall) {
    Exercise exercise(test::scenario_to_treat(large_balloon()), false);
    exercise.next_frame(Commands{script::Inflate{12}});
    wait(exercise, 200);
    exercise.next_frame(Commands{script::Deflate{}});
    wait(exercise, 200);
    const auto events = exercise.simulation().treatment().events();
    ASSERT_TRUE(std::ranges::any_of(
        events, [](const TreatmentEvent& e) { return e.kind == TreatmentEvent::Kind::Dissection; }));
    EXPECT_TRUE(std::ranges::any_of(exercise.simulation().complications(), [](const Complication& c) {
        return c.kind == script::ComplicationKind::Dissection && c.set() && c.come == 1;
    }));
    EXPECT_GE(exercise.simulation().treatment().tally().largest_ratio, Treatment::dissects_at);
}

TEST(Treatment, ASecondTearInABranchLeavesTheFirst) {
    Exercise exercise(test::scenario_to_treat(large_balloon()), false);
    inflate_and_deflate(exercise, 12);
    const std::vector<Complication> first = flaps(exercise);
    ASSERT_GE(first.size(), 1u);
    for (int k = 0; k < 15; ++k) exercise.next_frame(Commands{script::Withdraw{2, DeviceRole::Balloon}});
    wait(exercise, 20);
    inflate_and_deflate(exercise, 12);
    const std::size_t torn = flaps(exercise).size();
    ASSERT_GT(torn, first.size());
    for (std::size_t k = 0; k < first.size(); ++k) {
        EXPECT_EQ(flaps(exercise)[k].at, first[k].at);
        EXPECT_EQ(flaps(exercise)[k].come, 1);
    }
    const TreatmentScore score = exercise.score().treatment.value();
    EXPECT_EQ(score.dissections, static_cast<int>(torn));
    EXPECT_EQ(score.dissections_left, static_cast<int>(torn));
    // A teacher's dissection replaces a teacher's alone; relief takes them all.
    for (const double at : {15.0, 20.0}) {
        exercise.next_frame(
            Commands{script::Complicate{script::ComplicationKind::Dissection, "tube", at, 12, 30}});
        EXPECT_EQ(flaps(exercise).size(), torn + 1);
    }
    exercise.next_frame(Commands{script::Relieve{script::ComplicationKind::Dissection, "tube"}});
    EXPECT_TRUE(flaps(exercise).empty());
}

TEST(Treatment, AStentHoldsTheFlapThatItLiesOverAndNoOther) {
    scenario::Device device = large_balloon(true);
    const double gently = device.stent->law.opens_at - 0.1;  // tears, and leaves the stent on the balloon
    Exercise exercise(test::scenario_to_treat(device, "", 28), false);
    inflate_and_deflate(exercise, gently);
    const std::vector<Complication> first = flaps(exercise);
    ASSERT_GE(first.size(), 1u);
    for (int k = 0; k < 11; ++k) exercise.next_frame(Commands{script::Advance{2, DeviceRole::Balloon}});
    wait(exercise, 20);
    inflate_and_deflate(exercise, gently);
    ASSERT_GT(flaps(exercise).size(), first.size());
    ASSERT_TRUE(exercise.simulation().treatment().stents().empty());
    inflate_and_deflate(exercise, 10);
    ASSERT_EQ(exercise.simulation().treatment().stents().size(), 1u);
    const std::vector<Complication> left = flaps(exercise);
    ASSERT_EQ(left.size(), first.size());
    for (std::size_t k = 0; k < left.size(); ++k) EXPECT_EQ(left[k].at, first[k].at);
    EXPECT_EQ(exercise.score().treatment->dissections_left, static_cast<int>(left.size()));
}

TEST(Treatment, BalloonToArteryIsOfInflatedBalloonsThatPressOnSomething) {
    const auto largest = [](const scenario::Device& balloon, double pressure) {
        Exercise exercise(test::scenario_to_treat(balloon), false);
        exercise.next_frame(Commands{script::Inflate{pressure}});
        bool touched = false;
        for (int k = 0; k < 100; ++k) {
            exercise.next_frame(Commands{});
            touched = touched || narrowest(exercise.simulation()).contact > 0;
        }
        return std::pair(touched, exercise.simulation().treatment().tally().largest_ratio);
    };
    // Unfolded against the lesion, but not inflated yet.
    EXPECT_EQ(largest(test::balloon_catheter(), 0.9), (std::pair(true, 0.0)));
    // Inflated, and free in the lesion.
    scenario::Device thin = test::balloon_catheter();
    thin.balloon->law.table = {{4, 1.4}, {14, 1.5}};
    EXPECT_EQ(largest(thin, 8), (std::pair(false, 0.0)));
    const auto [touched, ratio] = largest(test::balloon_catheter(), 12);
    EXPECT_TRUE(touched);
    EXPECT_NEAR(ratio, 1, 0.07);
}

TEST(Treatment, ASelfExpandingStentComesOutOfItsSheathFromItsDistalEnd) {
    Exercise exercise(test::scenario_to_treat(test::balloon_catheter(true, true)), false);
    test::expect_said(denied(exercise, script::Inflate{8}), "has no balloon");
    exercise.next_frame(Commands{script::RetrieveSheath{6}});
    wait(exercise, 60);
    const auto stents = [&] { return exercise.simulation().treatment().stents(); };
    ASSERT_EQ(stents().size(), 1u);
    EXPECT_EQ(stents()[0].samples.size(), 7u);
    EXPECT_TRUE(stents()[0].attached);
    test::expect_said(denied(exercise, script::Withdraw{5, DeviceRole::Balloon}), "half out");
    const geometry::Vec3 distal = stents()[0].samples[0].at;
    exercise.next_frame(Commands{script::Deploy{}});
    wait(exercise, 100);
    EXPECT_FALSE(stents()[0].attached);
    EXPECT_EQ(stents()[0].samples.size(), 15u);
    EXPECT_LT((stents()[0].samples[0].at - distal).norm(), 1e-9);
    EXPECT_NEAR((stents()[0].samples[0].at - stents()[0].samples[14].at).norm(), 14 * 0.95, 0.05);
    test::expect_said(denied(exercise, script::Deploy{}), "has left its sheath");
    exercise.next_frame(Commands{script::Remove{DeviceRole::Balloon}});
    wait(exercise, 40);
    EXPECT_EQ(exercise.simulation().inserted(DeviceRole::Balloon), 0);
    EXPECT_EQ(stents().size(), 1u);
}

/// Every frame on the way is an equilibrium within the solver's tolerance and a strict minimum, while the
/// balloon grows by 10 µm at most.
TEST(Treatment, InflationInStepsOfTenMicrometresGoesThroughCertifiedEquilibria) {
    scenario::Scenario scenario = test::scenario_to_treat();
    scenario.frame_rate = 120;
    Exercise exercise(scenario, false);
    double largest = 0, last = 0;
    int frames = 0;
    double pressure = 0;
    int on_the_way = 0;
    for (; frames < 4000 && pressure < 10; ++frames) {
        // So little more pressure that no wall moves farther.
        pressure += pressure < 1.2 ? 0.004 : 0.02;
        exercise.next_frame(Commands{script::Inflate{pressure}});
        const Simulation& simulation = exercise.simulation();
        // Where the device snaps, the work of a frame may not do.
        if (simulation.readings().motion.settling) {
            ++on_the_way;
        } else {
            ASSERT_TRUE(simulation.readings().at_rest) << frames;
            ASSERT_TRUE(simulation.readings().strict_minimum) << frames;
        }
        ASSERT_LT(physics::relative_gradient(simulation.wire(), simulation.contacts()), 1e-6) << frames;
        const double r = *std::ranges::max_element(simulation.treatment().inflation()->radii);
        largest = std::max(largest, frames > 0 ? r - last : 0.0);
        last = r;
    }
    EXPECT_LT(largest, 0.0101);
    EXPECT_GT(last, 1.9);
    EXPECT_LE(on_the_way, frames / 100);
}

TEST(Treatment, EveryPhaseIsTheSameAgainFromASnapshotAndAfterAReset) {
    for (const bool self : {false, true}) {
        Exercise exercise(test::scenario_to_treat(test::balloon_catheter(true, self)), false);
        const std::string text =
            self ? "2 retrieve sheath 4 mm\n40 deploy\n140 withdraw balloon 5 mm\n"
                   "150 advance balloon 3 mm\n170 remove balloon\n200 end\n"
                 : "2 inflate 5 atm\n40 inflate 12 atm\n110 deflate\n190 withdraw balloon 8 mm\n"
                   "200 advance balloon 6 mm\n220 inflate 9 atm\n260 deflate\n300 end\n";
        const script::CommandScript script = script::parse_commands(text, "x.gw");
        std::vector<Exercise::Snapshot> snapshots;
        std::vector<std::uint64_t> hashes;
        for (int frame = 0; frame <= script.last_frame(0); ++frame) {
            if (frame % 30 == 0) snapshots.push_back(exercise.snapshot());
            exercise.next_frame(test::commands_of(script, frame));
            hashes.push_back(exercise.simulation().state_hash());
        }
        for (std::size_t n = 0; n < snapshots.size(); ++n) {
            exercise.restore(snapshots[n]);
            for (std::size_t frame = 30 * n; frame < std::min(hashes.size(), 30 * n + 35); ++frame) {
                exercise.next_frame(test::commands_of(script, static_cast<int>(frame)));
                ASSERT_EQ(exercise.simulation().state_hash(), hashes[frame])
                    << "self " << self << " " << frame;
            }
        }
        exercise.next_frame(Commands{script::Reset{}});
        EXPECT_TRUE(exercise.simulation().treatment().stents().empty());
        EXPECT_NEAR(residual(exercise.simulation()), 0.6, 0.03);
    }
}

/// Whatever a hand does with a balloon or a stent: no NaN, no wire out of shape, no frame that never comes to
/// rest.
struct Wild {
    int frames = 0, stuck = 0;
};
void treat_wildly(unsigned seed, Wild& all) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const char* const plaques[] = {"soft", "fibrous", "calcified"};
    scenario::Device device = test::balloon_catheter(pick(2) == 0, pick(4) == 0);
    if (device.kind == scenario::DeviceKind::Balloon && !device.balloon) device = test::balloon_catheter();
    if (device.balloon)
        for (auto& row : device.balloon->law.table) row.diameter *= 0.7 + 0.8 * unit();
    if (device.balloon) std::ranges::sort(device.balloon->law.table, {}, &physics::BalloonLaw::Row::diameter);
    if (device.balloon) std::ranges::sort(device.balloon->law.table, {}, &physics::BalloonLaw::Row::pressure);
    Exercise exercise(
        test::scenario_to_treat(
            device, fmt::format("plaque = \"{}\"\neccentricity = {:.2f}\n", plaques[pick(3)], unit()),
            30 + 40 * unit()),
        false);
    int unsettled = 0;
    bool shown_at_rest = true;
    for (int frame = 0; frame < 90; ++frame) {
        Commands commands;
        switch (pick(7)) {
            case 0:
                commands.push_back(script::Inflate{25 * unit()});
                break;
            case 1:
                commands.push_back(script::Deflate{});
                break;
            case 2:
                commands.push_back(script::Deploy{});
                break;
            case 3:
                commands.push_back(script::RetrieveSheath{8 * unit()});
                break;
            case 4:
                commands.push_back(
                    script::Advance{6 * unit(), pick(2) == 0 ? DeviceRole::Balloon : DeviceRole::Wire});
                break;
            case 5:
                commands.push_back(
                    script::Withdraw{6 * unit(), pick(2) == 0 ? DeviceRole::Balloon : DeviceRole::Wire});
                break;
            default:
                break;
        }
        const Frame made = exercise.next_frame(commands);
        const physics::Chain& wire = made.simulation.wire();
        ASSERT_TRUE(physics::validate(wire).empty()) << frame;
        for (const Lesion& lesion : made.simulation.treatment().lesions())
            for (const physics::OpenedPlace& place : lesion.places)
                ASSERT_TRUE(std::isfinite(place.radius) && place.radius > 0) << frame;
        unsettled = made.motion.settling ? unsettled + 1 : 0;
        ASSERT_LT(unsettled, 45) << frame;
        ++all.frames;
        if (!made.motion.settling) shown_at_rest = made.simulation.readings().at_rest;
        if (!made.motion.settling && !shown_at_rest) ++all.stuck;
        ASSERT_LT(physics::relative_gradient(wire, made.simulation.contacts()), shown_at_rest ? 1e-6 : 1e-3)
            << frame;
    }
    // It comes to rest when hands do, with the balloon as it was asked to be.
    for (int frame = 0; frame < 200; ++frame) exercise.next_frame(Commands{});
    EXPECT_TRUE(exercise.simulation().readings().at_rest);
    EXPECT_FALSE(exercise.simulation().readings().waits);
    const Inflation& now = *exercise.simulation().treatment().inflation();
    EXPECT_EQ(now.pressure, now.burst || !device.balloon ? 0.0 : now.wanted);
}

TEST(Treatment, WildHandsWithABalloonLeaveNothingBroken) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const unsigned count =
        more ? static_cast<unsigned>(std::atoi(more)) : static_cast<unsigned>(test::cases(60));
    Wild all;
    for (unsigned seed = 1; seed <= count; ++seed) ASSERT_NO_FATAL_FAILURE(treat_wildly(seed, all));
    // A solver that is stuck says so: its frame is not called at rest.
    EXPECT_LE(all.stuck, all.frames / 200) << "of " << all.frames;
}

}  // namespace exercise
