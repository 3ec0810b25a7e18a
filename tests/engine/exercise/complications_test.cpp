/// Complications that a teacher sets: what they do to devices, blood and score, and that nothing is left of
/// them.

#include "engine/exercise/complications.h"

#include <algorithm>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "engine/exercise/score_file.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using script::ComplicationKind;
using script::DeviceRole;
using Commands = std::vector<script::Command>;

const script::Complicate spasm{ComplicationKind::Spasm, "tube", 45, 16, 60};
const script::Complicate thrombus{ComplicationKind::Thrombus, "tube", 45, 10, 100};
const script::Complicate dissection{ComplicationKind::Dissection, "tube", 45, 16, 50};
script::Complicate breath(script::BreathManner how) {
    return {ComplicationKind::Breath, "", 0, 0, 0, how};
}

/// The bent tube, 77 mm long, with a 5F catheter of 1.67 mm.
scenario::Scenario scenario_with_catheter(double inserted, const std::string& more = "") {
    return test::small_scenario(
        std::string(test::small_toml) +
        fmt::format("[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = {}\n{}", inserted, more));
}

void wait(Exercise& exercise, int frames) {
    for (int k = 0; k < frames; ++k) exercise.next_frame(Commands{});
}

/// As many frames as complications take to come or to go, and a few more.
constexpr int long_enough = 100;

double inserted_after(Exercise& exercise, const script::Command& motion, int times) {
    for (int k = 0; k < times; ++k) exercise.next_frame(Commands{motion});
    wait(exercise, 20);
    return exercise.simulation().inserted(DeviceRole::Catheter);
}

std::string refused(const script::Complicate& c) {
    Exercise exercise(test::small_scenario(), false);
    return test::refusal([&] { exercise.next_frame(Commands{c}); });
}

}  // namespace

TEST(Complications, ThatTheVesselsCannotHaveAreRefusedWithWhatTheyCan) {
    test::expect_said(refused({ComplicationKind::Spasm, "tub", 45, 16, 60}),
                      "expected a branch of small, found 'tub' (did you mean 'tube'?); branches are tube");
    test::expect_said(refused({ComplicationKind::Spasm, "tube", 200, 16, 60}),
                      "from the origin of tube, found 200 mm");
    Exercise segments(
        test::small_scenario_with("updates_per_frame = 20000", "updates_per_frame = 400\nkind = \"segment\""),
        false);
    test::expect_refusal([&] { segments.next_frame(Commands{spasm}); }, "kind = \"global\"");
    segments.next_frame(Commands{breath(script::BreathManner::Deep)});
    const script::CommandScript wrong =
        script::parse_commands("5 complication spasm of LRA at 10 mm over 20 mm by 60 percent\n", "x.gw");
    test::expect_refusal([&] { Exercise(test::small_scenario(), Pictures::None, {}, &wrong); }, "x.gw:1:3: ");
}

TEST(Complications, ASpasmStopsACatheterUntilItIsRelieved) {
    Exercise free(scenario_with_catheter(20), false), exercise(scenario_with_catheter(20), false);
    exercise.next_frame(Commands{spasm});
    wait(exercise, long_enough);
    const auto& catheter = script::Advance{2, DeviceRole::All};
    const double passes = inserted_after(free, catheter, 20);
    const double stops = inserted_after(exercise, catheter, 20);
    EXPECT_GT(passes, 58);
    EXPECT_LT(stops, 47);
    EXPECT_GT(stops, 30);
    EXPECT_TRUE(exercise.simulation().readings().motion.too_thick ||
                exercise.simulation().readings().motion.refused || stops < 47);
    exercise.next_frame(Commands{script::Relieve{ComplicationKind::Spasm, "tube"}});
    wait(exercise, long_enough);
    EXPECT_GT(inserted_after(exercise, catheter, 12), 58);
}

TEST(Complications, ASpasmSqueezesAWireAndLetsItGo) {
    // Of a wire that lies through the bend.
    Exercise exercise(test::small_scenario_with("inserted_mm = 20.0", "inserted_mm = 70.0"), false);
    const auto force = [&] {
        double sum = 0;
        for (const physics::WallContact& c : exercise.simulation().contacts()) sum += c.force();
        return sum;
    };
    wait(exercise, 5);
    const double before = force();
    exercise.next_frame(Commands{script::Complicate{ComplicationKind::Spasm, "tube", 40, 40, 70}});
    double deepest_step = 0;
    for (int k = 0; k < long_enough; ++k) {
        const auto was = exercise.simulation().wire().joints;
        exercise.next_frame(Commands{});
        const auto& now = exercise.simulation().wire().joints;
        for (std::size_t j = 0; j < now.size(); ++j)
            deepest_step = std::max(deepest_step, (now[j] - was[j]).norm());
    }
    EXPECT_GT(force(), 1.2 * before);
    EXPECT_LT(deepest_step, 1.0);
    EXPECT_LT(physics::relative_gradient(exercise.simulation().wire(), exercise.simulation().contacts()),
              1e-6);
    exercise.next_frame(Commands{script::Relieve{}});
    wait(exercise, long_enough);
    EXPECT_NEAR(force(), before, 0.02 * before);
    EXPECT_TRUE(exercise.simulation().wall().narrowings().empty());
}

TEST(Complications, AWallDoesNotCloseOnADeviceThatLiesInItButGripsIt) {
    const std::string rubs = test::replaced(test::small_toml, "frictionless = true\n", "");
    const auto made = [&] {
        return test::small_scenario(rubs + "[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = 65.0\n");
    };
    Exercise free(made(), false), gripped(made(), false);
    const script::Complicate tight{ComplicationKind::Spasm, "tube", 40, 30, 80};
    gripped.next_frame(Commands{tight});
    free.next_frame(Commands{});
    wait(gripped, long_enough);
    wait(free, long_enough);
    const Complication& set = gripped.simulation().complications()[0];
    EXPECT_TRUE(set.held_off);
    const auto tubes = gripped.simulation().wall().narrowings();
    ASSERT_EQ(tubes.size(), 1u);
    for (const physics::Narrowing::Sample& sample : tubes[0].samples) EXPECT_GE(sample.radius, 0.835);
    const auto pull = [](Exercise& exercise) {
        double most = 0;
        for (int k = 0; k < 5; ++k) {
            exercise.next_frame(Commands{script::Withdraw{0.5, DeviceRole::All}});
            most = std::max(most, -exercise.simulation().hand(DeviceRole::Catheter).load.push);
        }
        return most;
    };
    EXPECT_GT(pull(gripped), 1.3 * pull(free));
}

TEST(Complications, AThrombusLetsDevicesPassWithResistance) {
    const std::string rubs = test::replaced(test::small_toml, "frictionless = true\n", "");
    Exercise free(test::small_scenario(rubs), false), plugged(test::small_scenario(rubs), false);
    plugged.next_frame(Commands{thrombus});
    free.next_frame(Commands{});
    wait(plugged, long_enough);
    wait(free, long_enough);
    double with = 0, without = 0;
    for (int k = 0; k < 40; ++k) {
        plugged.next_frame(Commands{script::Advance{1}});
        free.next_frame(Commands{script::Advance{1}});
        with = std::max(with, plugged.simulation().hand(DeviceRole::Wire).load.push);
        without = std::max(without, free.simulation().hand(DeviceRole::Wire).load.push);
    }
    EXPECT_GT(plugged.simulation().inserted(), 55);
    // About 1 kPa on 10 mm of a wire of 0.89 mm.
    EXPECT_NEAR(with - without, 0.028, 0.02);
}

TEST(Complications, NoBloodFlowsBeyondAThrombusAndIodineIsKept) {
    Exercise exercise(test::small_scenario(), false);
    exercise.next_frame(Commands{thrombus});
    wait(exercise, long_enough);
    const auto& axis = exercise.simulation().anatomy().branches[0].points;
    const auto index_at = [&](double along) {
        std::size_t k = 0;
        for (double way = 0; way < along; ++k) way += (axis[k + 1] - axis[k]).norm();
        return k;
    };
    for (const bool beyond : {false, true}) {
        blood::ContrastFlow contrast = exercise.simulation().contrast();
        for (const blood::Outlet& outlet : contrast.blood().outlets) EXPECT_EQ(outlet.flow, 0);
        for (const double flow : contrast.blood().resting()) EXPECT_EQ(flow, 0);
        contrast.inject({axis[index_at(beyond ? 60 : 30)], 2, 2, 320});
        for (int k = 0; k < 90; ++k) contrast.step(1 / 15.0);
        const blood::IodineBalance at = contrast.balance();
        EXPECT_NEAR(at.injected, 640, 1e-6);
        EXPECT_NEAR(at.in_vessels + at.in_organs + at.drained + at.leaked, at.injected, 1e-9 * at.injected);
        // Blood enters by the start of the tube: before the plug contrast runs back, beyond it on.
        const auto iodine_at = [&](double along) {
            return contrast
                .iodine()[static_cast<std::size_t>(contrast.blood().nearest(axis[index_at(along)]))];
        };
        EXPECT_EQ(iodine_at(beyond ? 30 : 60), 0);
        EXPECT_GT(iodine_at(beyond ? 70 : 15), 100);
    }
    exercise.next_frame(Commands{script::Relieve{ComplicationKind::Thrombus, "tube"}});
    wait(exercise, long_enough);
    EXPECT_GT(exercise.simulation().contrast().blood().outlets[0].flow, 0);
}

TEST(Complications, ASpasmTakesOfTheFlowWhatItResists) {
    Exercise exercise(test::small_scenario(), false);
    const double before = exercise.simulation().contrast().blood().outlets[0].flow;
    exercise.next_frame(Commands{spasm});
    wait(exercise, long_enough);
    const double at_60 = exercise.simulation().contrast().blood().outlets[0].flow;
    exercise.next_frame(Commands{script::Complicate{ComplicationKind::Spasm, "tube", 45, 16, 80}});
    wait(exercise, long_enough);
    const double at_80 = exercise.simulation().contrast().blood().outlets[0].flow;
    EXPECT_LT(at_60, before);
    EXPECT_LT(at_80, 0.7 * at_60);
    EXPECT_GT(at_80, 0);
    exercise.next_frame(Commands{script::Relieve{}});
    wait(exercise, long_enough);
    EXPECT_EQ(exercise.simulation().contrast().blood().outlets[0].flow, before);
}

TEST(Complications, ADissectionLeavesTheLumenOnOneSide) {
    Exercise exercise(test::small_scenario(), false);
    exercise.next_frame(Commands{script::Complicate{ComplicationKind::Dissection, "tube", 15, 16, 50}});
    wait(exercise, long_enough);
    // The tube begins along x; its flap is seen from the front, along y.
    const auto at = [&](double z) {
        physics::WallContact contact;
        const geometry::Vec3 place(15, 0, z);
        exercise.simulation().wall().contacts({&place, 1}, {&contact, 1});
        return contact.penetration;
    };
    const double radius = 0.889 / 2;
    EXPECT_NEAR(std::min(at(1.5), at(-1.5)), 1.5 + radius - 2, 0.1);
    EXPECT_NEAR(std::max(at(1.5), at(-1.5)), 2.5 + radius - 1, 0.1);
    EXPECT_TRUE(exercise.simulation().injuries().all().empty());
    double narrowest = 10, widest = 0;
    for (const render::VertexMove& move : exercise.simulation().narrowed_lumen()) {
        const geometry::Vec3 place =
            exercise.simulation().anatomy().lumen.vertices[move.vertex] + move.by.cast<double>();
        if (std::abs(place.x() - 15) > 2) continue;
        narrowest = std::min(narrowest, place.z());
        widest = std::max(widest, place.z());
    }
    // Of 4 mm; on the side that is left nothing moves.
    EXPECT_NEAR(std::min(std::abs(narrowest), std::abs(widest)), 0, 0.3);
}

TEST(Complications, PastTheirEndsTheVesselIsAsItWas) {
    for (const script::Complicate& set : {spasm, dissection, thrombus}) {
        Exercise exercise(test::small_scenario(), false);
        exercise.next_frame(Commands{set});
        wait(exercise, long_enough);
        const physics::NarrowedWall& wall = exercise.simulation().wall();
        const geometry::Polyline& axis = exercise.simulation().anatomy().branches[0].points;
        double way = 0;
        int differ = 0;
        for (std::size_t k = 0; k < axis.size(); ++k) {
            if (k > 0) way += (axis[k] - axis[k - 1]).norm();
            for (const geometry::Vec3& aside :
                 {geometry::Vec3(0, 0, 0.2), geometry::Vec3(0, 0, 1.4), geometry::Vec3(0, 0, -1.7)}) {
                const geometry::Vec3 place = axis[k] + aside;
                physics::WallContact now, before;
                now.thickness = before.thickness = 0.7;  // of a thick catheter
                wall.contacts({&place, 1}, {&now, 1});
                wall.vessels()->contacts({&place, 1}, {&before, 1});
                if (std::abs(way - set.at) > 0.5 * set.over + 1) {
                    EXPECT_EQ(std::max(0.0, now.penetration), std::max(0.0, before.penetration)) << way;
                }
                differ += now.touches() && !before.touches();
            }
        }
        EXPECT_EQ(differ > 3, set.kind != ComplicationKind::Thrombus);
    }
}

TEST(Complications, ResistAsPoiseuilleAndTheJetDo) {
    Simulation simulation(test::small_scenario());
    Complications set;
    set.set(spasm, simulation.anatomy(), 0);
    for (int k = 0; k < long_enough; ++k) set.step(1 / 15.0, simulation.wire());
    ASSERT_EQ(set.obstructions().size(), 1u);
    const blood::Obstruction in_the_way = set.obstructions()[0];
    const double area = M_PI * 4, more = 1 / (0.4 * 0.4) - 1;
    EXPECT_NEAR(in_the_way.turbulent, 1.52 * 1060 / 2 * more * more / (area * area), 1e-6);
    // Its middle half, 8 mm, is as narrow as asked; the shoulders add a fifth or so.
    const double narrow = 8 * 8 * 3.5 / M_PI * (1 / std::pow(0.8, 4) - 1 / std::pow(2.0, 4));
    EXPECT_GT(in_the_way.laminar, narrow);
    EXPECT_LT(in_the_way.laminar, 1.6 * narrow);
}

TEST(Complications, AreNoErrorsAndNothingTellsTheTraineeButTheScore) {
    Exercise exercise(test::small_scenario(), false);
    Notices notices;
    const auto frame = [&](const Commands& commands) { notices.observe(exercise.next_frame(commands)); };
    frame({});
    frame({spasm, dissection, breath(script::BreathManner::Deep)});
    for (int k = 0; k < 44; ++k) frame({});
    frame({breath(script::BreathManner::Cough)});
    frame({script::Relieve{ComplicationKind::Spasm, "tube"}});
    for (int k = 0; k < 50; ++k) frame({});
    EXPECT_TRUE(notices.text().empty()) << notices.text()[0];
    const Score score = exercise.finish();
    EXPECT_TRUE(score.handling_errors.empty());
    ASSERT_EQ(score.set_by_teacher.size(), 4u);
    EXPECT_EQ(score.set_by_teacher[0].text, "spasm of the tube");
    EXPECT_NEAR(score.set_by_teacher[0].set, 1.0 / exercise.simulation().scenario().frame_rate, 1e-12);
    EXPECT_NEAR(*score.set_by_teacher[0].relieved, 47 / exercise.simulation().scenario().frame_rate, 1e-12);
    EXPECT_FALSE(score.set_by_teacher[1].relieved);
    EXPECT_EQ(score.set_by_teacher[2].text, "deep breathing");
    EXPECT_EQ(score.set_by_teacher[3].text, "cough");
    const auto now = exercise.simulation().complications();
    EXPECT_EQ(std::ranges::count_if(now, &Complication::set), 1);
    exercise.next_frame(Commands{script::Reset{}});
    EXPECT_TRUE(exercise.simulation().complications().empty());
    EXPECT_TRUE(exercise.finish().set_by_teacher.empty());
    EXPECT_EQ(exercise.earlier_attempts()[0].set_by_teacher.size(), 4u);
}

TEST(Complications, DeepBreathsAndCoughsMoveTheVesselsFartherAndAreOver) {
    const auto made = [](const Commands& first, int frames) {
        scenario::Scenario scenario = test::small_scenario();
        scenario.motion.breathing_reach = {0, 0, -10};
        Exercise exercise(scenario, false);
        exercise.next_frame(first);
        double farthest = 0, fastest = 0, before = 0;
        for (int k = 0; k < frames; ++k) {
            exercise.next_frame(Commands{});
            const double now = exercise.simulation().vessel_shift().norm();
            farthest = std::max(farthest, now);
            fastest = std::max(fastest, std::abs(now - before));
            before = now;
        }
        return std::pair{farthest, fastest};
    };
    const auto [quiet, quietly] = made({}, 200);
    const auto [deep, deeply] = made({breath(script::BreathManner::Deep)}, 200);
    const auto [cough, suddenly] = made({breath(script::BreathManner::Cough)}, 10);
    EXPECT_NEAR(quiet, 10, 0.2);
    EXPECT_NEAR(deep, 25, 0.5);
    EXPECT_GT(deeply, 2 * quietly);
    EXPECT_GT(cough, 10);
    EXPECT_GT(suddenly, 2.5 * quietly);
    EXPECT_EQ(made({breath(script::BreathManner::Deep), breath(script::BreathManner::Free)}, 200).first,
              quiet);
}

TEST(Complications, ARecordingOfAllOfThemReplaysToTheBit) {
    const test::TemporaryFolder folder;
    const scenario::Scenario scenario = scenario_with_catheter(20);
    const std::filesystem::path file = folder / "all.gw";
    {
        Exercise exercise(scenario, false);
        exercise.record(file, {});
        exercise.next_frame(Commands{spasm, script::Advance{3, DeviceRole::All}});
        wait(exercise, 15);
        exercise.next_frame(Commands{thrombus, breath(script::BreathManner::Deep)});
        for (int k = 0; k < 25; ++k) exercise.next_frame(Commands{script::Advance{1.5, DeviceRole::Wire}});
        exercise.next_frame(Commands{dissection, breath(script::BreathManner::Cough)});
        for (int k = 0; k < 25; ++k) exercise.next_frame(Commands{script::Withdraw{1, DeviceRole::Wire}});
        exercise.next_frame(Commands{script::Relieve{}});
        wait(exercise, 40);
        exercise.close_recording();
    }
    const script::CommandScript recording = script::load_commands(file);
    EXPECT_GT(recording.checks.size(), 3u);
    run::RunOptions options;
    options.images = false;
    EXPECT_TRUE(run::run_headless(scenario, recording, options).differences.empty());
}

TEST(Complications, ASnapshotGoesOnAsItWentOn) {
    scenario::Scenario scenario = scenario_with_catheter(20);
    scenario.motion.breathing_reach = {0, 0, -5};
    Exercise exercise(scenario, true);
    exercise.next_frame(Commands{script::Beam{true}, spasm, breath(script::BreathManner::Deep)});
    wait(exercise, 12);
    exercise.next_frame(Commands{thrombus, script::Inject{3, 6, "tube", 320}});
    wait(exercise, 9);
    const Exercise::Snapshot snapshot = exercise.snapshot();
    const auto go_on = [&] {
        std::vector<std::uint64_t> states;
        for (int k = 0; k < 30; ++k) {
            exercise.next_frame(Commands{script::Advance{1, DeviceRole::All}});
            states.push_back(exercise.simulation().state_hash());
        }
        return std::pair{states, exercise.image()};
    };
    const auto first = go_on();
    exercise.restore(snapshot);
    const auto again = go_on();
    EXPECT_EQ(first.first, again.first);
    EXPECT_EQ(first.second, again.second);
    const Simulation copy(exercise.simulation());
    EXPECT_EQ(copy.state_hash(), exercise.simulation().state_hash());
    EXPECT_EQ(copy.wall().narrowings().size(), exercise.simulation().wall().narrowings().size());
}

TEST(Complications, TheLumenInTheImageNarrowsAndComesBackToTheBit) {
    Exercise exercise(test::small_scenario(), false);
    EXPECT_TRUE(exercise.simulation().narrowed_lumen().empty());
    exercise.next_frame(Commands{spasm});
    wait(exercise, long_enough);
    const auto& anatomy = exercise.simulation().anatomy();
    const std::vector<render::VertexMove> moves = exercise.simulation().narrowed_lumen();
    ASSERT_FALSE(moves.empty());
    double narrowest = 10;
    for (const render::VertexMove& move : moves) {
        const geometry::Vec3 place = anatomy.lumen.vertices[move.vertex] + move.by.cast<double>();
        double away = 10;
        for (const geometry::Vec3& p : anatomy.branches[0].points) away = std::min(away, (p - place).norm());
        narrowest = std::min(narrowest, away);
    }
    EXPECT_NEAR(narrowest, 0.4 * 2, 0.1);
    exercise.next_frame(Commands{script::Relieve{}});
    wait(exercise, long_enough);
    EXPECT_TRUE(exercise.simulation().narrowed_lumen().empty());
    EXPECT_TRUE(exercise.simulation().lumen_moves().empty());
}

namespace {

/// Whatever a teacher may set anywhere in the vessels.
/// Every other one near the devices' tip.
script::Command random_complication(std::mt19937& random, const Simulation& simulation) {
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    script::Complicate made;
    made.kind = static_cast<ComplicationKind>(random() % 4);
    if (random() % 6 == 0) return script::Relieve{};
    if (made.kind == ComplicationKind::Breath) {
        made.breath = static_cast<script::BreathManner>(random() % 3);
        return made;
    }
    made.branch = anatomy.branches[random() % anatomy.branches.size()].name;
    made.at = 120 * unit();
    if (random() % 2 == 0) {
        const auto& joints = simulation.wire().joints;
        const anatomy::VesselPlace place =
            anatomy::nearest_place(anatomy, joints[joints.size() - 1 - random() % (joints.size() / 2)]);
        made.branch = anatomy.branches[static_cast<std::size_t>(place.branch)].name;
        made.at = std::max(0.0, anatomy::along(anatomy, place) - anatomy::origin_of(anatomy, place.branch));
    }
    made.over = 6 + 50 * unit();
    made.percent = made.kind == ComplicationKind::Thrombus ? 100 : 10 + 80 * unit();
    if (random() % 8 == 0) return script::Relieve{made.kind, made.branch};
    return made;
}

struct Attack {
    int set = 0, frames = 0, restless = 0, settling = 0;
};

/// `count` complications while a hand pushes, pulls and turns; without any, `frames` of the hand alone.
Attack attack(Exercise& exercise, unsigned seed, int count, int frames) {
    std::mt19937 random(seed), hand(seed);
    Attack made;
    const DeviceRole held = exercise.simulation().devices().size() > 1 ? DeviceRole::All : DeviceRole::Wire;
    const anatomy::Anatomy& anatomy = exercise.simulation().anatomy();
    while (made.set < count || made.frames < frames) {
        Commands commands;
        if (count > 0 && made.frames % 12 == 0) {
            const script::Command next = random_complication(random, exercise.simulation());
            const auto* set = std::get_if<script::Complicate>(&next);
            if (!set || Complications::problem(*set, anatomy).empty()) {
                commands.push_back(next);
                ++made.set;
            }
        }
        const double amount = std::ldexp(static_cast<double>(hand()), -32);
        switch (hand() % 5) {
            case 0:
                commands.push_back(script::Withdraw{2 * amount, held});
                break;
            case 1:
                commands.push_back(script::Rotate{amount, held});
                break;
            default:
                commands.push_back(script::Advance{2 * amount, held});
                break;
        }
        const Frame frame = exercise.next_frame(commands);
        ++made.frames;
        made.settling += frame.motion.settling;
        made.restless += !frame.motion.settling && !frame.simulation.readings().at_rest;
        EXPECT_TRUE(physics::validate(frame.simulation.wire()).empty());
        for (const geometry::Vec3& x : frame.simulation.wire().joints) EXPECT_TRUE(x.allFinite());
    }
    return made;
}

/// Of random complications at random places and times in exercises that ship, a seed each.
void attack_shipped(const char* name, unsigned seed, int count) {
    SCOPED_TRACE(std::string(name) + ", seed " + std::to_string(seed));
    const scenario::Scenario scenario = test::shipped_scenario(name);
    Exercise exercise(scenario, false), alone(scenario, false);
    const auto fractions = [&] {
        std::vector<double> all;
        for (const blood::Outlet& outlet : exercise.simulation().contrast().blood().outlets)
            all.insert(all.end(), {outlet.fraction, outlet.flow});
        return all;
    };
    const std::vector<double> before = fractions();
    const Attack under = attack(exercise, seed, count, 0);
    const Attack free = attack(alone, seed, 0, under.frames);
    EXPECT_LE(under.restless, free.restless) << "of " << under.frames;
    // How many frames show the last rest is printed; docs/complications.md has what that came to.
    exercise.next_frame(Commands{script::Relieve{}});
    wait(exercise, 200);
    EXPECT_TRUE(exercise.simulation().wall().narrowings().empty());
    EXPECT_TRUE(exercise.simulation().narrowed_lumen().empty());
    EXPECT_EQ(fractions(), before);
    std::printf("%s, seed %u: %d commands, %d frames, on their way %d (without %d), restless %d (%d)\n", name,
                seed, under.set, under.frames, under.settling, free.settling, under.restless, free.restless);
}

}  // namespace

TEST(Complications, RandomOnesInShippedExercisesLeaveNothingBehind) {
    // SELDINGER_COMPLICATIONS=N sets N in each of five exercises.
    const char* const each = std::getenv("SELDINGER_COMPLICATIONS");
    if (!each) return attack_shipped("bifurcation", 11, 10);
    for (const char* name : {"renal", "coronary", "arch", "bifurcation", "renal_cobra"}) {
        attack_shipped(name, 12, std::atoi(each));
        if (testing::Test::HasFailure()) return;
    }
}

}  // namespace exercise
