/// Where the wall gives way, from the scenario's key to the score, the notice, the truth and the image.

#include "engine/exercise/injury.h"

#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/score_file.h"
#include "engine/run/headless.h"
#include "render/picture/png.h"
#include "tests/cases.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

/// A bent vessel of 1.2 mm radius, closed at its far end, 60 mm straight on from the bend.
const char* const blind_bend = R"(schema = 1
title = "blind"
[[anatomy.branch]]
name = "v"
closed = true
points_mm = [[0, 0, 0, 1.2], [0, 0, 40, 1.2], [12, 0, 68, 1.2], [40, 0, 80, 1.2], [100, 0, 80, 1.2]]
[entry]
end = "v.in"
inserted_mm = 100.0
[guidewire]
device = "amplatzSS035"
[target]
centre_mm = [40, 0, 80]
[c_arm]
isocentre_mm = [80, 0, 80]
pixels = 256
detector_width_mm = 150
)";

const char* const catheter_section = R"([catheter]
device = "vertebral5f"
inserted_mm = 95.0
)";

/// Its vessels stay where they are, unless `more` says otherwise.
scenario::Scenario blind(const std::string& more = "") {
    const bool said = more.find("[tissue]") != std::string::npos;
    return scenario::parse_scenario(blind_bend + more + (said ? "" : "[tissue]\nrigid = true\n"),
                                    "blind.toml", test::asset("devices"));
}

/// End-on force at the chain's end, from its contact alone.
double force_at_end(const Simulation& simulation) {
    const physics::WallContact& contact = simulation.contacts().back();
    return std::max(0.0, contact.force() * contact.normal.dot(simulation.wire().tangents.back()));
}

bool rests(const Simulation& simulation) {
    return simulation.readings().at_rest && !simulation.readings().motion.settling;
}

constexpr double wire_diameter = 0.889, catheter_diameter = 5 / 3.0, vessel = 1.2;

/// Cosine between that end and the wall's normal.
double facing(const Simulation& simulation) {
    return simulation.contacts().back().normal.normalized().dot(simulation.wire().tangents.back());
}

/// By hand, from docs/injury.md.
double by_hand(double strength, double diameter, double facing = 1) {
    return std::numbers::pi * diameter * 0.2 * vessel * strength / facing;
}

}  // namespace

TEST(Injury, StrengthIsThatOfTheCylinderThatTheEndPunches) {
    const WallStrength renal = wall_strength({}, 0.889, 3);
    EXPECT_NEAR(renal.of(InjuryKind::Dissection), 0.285, 0.001);
    EXPECT_NEAR(renal.of(InjuryKind::Perforation), 1.408, 0.001);
    const WallStrength coronary = wall_strength({}, 0.36, 1.85);
    EXPECT_NEAR(coronary.of(InjuryKind::Perforation), 0.352, 0.001);
    scenario::InjurySpec stated;
    stated.perforation_force = 2.5;
    EXPECT_EQ(wall_strength(stated, 0.889, 3).of(InjuryKind::Perforation), 2.5);
    EXPECT_EQ(wall_strength(stated, 0.36, 9, 0.5).of(InjuryKind::Perforation), 2.5);
    EXPECT_DOUBLE_EQ(wall_strength({}, 0.889, 3, 0.5).of(InjuryKind::Perforation),
                     2 * renal.of(InjuryKind::Perforation));
    EXPECT_EQ(wall_strength(stated, 0.889, 3).of(InjuryKind::Dissection), renal.of(InjuryKind::Dissection));
}

TEST(Injury, BadThresholdsAreRefusedWithFileKeyAndWhatWasExpected) {
    for (const std::string key : {"perforation_N_per_mm2", "dissection_N_per_mm2", "wall_over_radius",
                                  "perforation_N", "dissection_N"})
        for (const std::string value : {"0", "0.0", "-1.5", "nan", "inf", "1e9", "true", "\"much\""}) {
            const std::string said = test::refusal([&] { blind("[injury]\n" + key + " = " + value + "\n"); });
            test::expect_said(said, "blind.toml:19:");
            test::expect_said(said, key);
            test::expect_said(said, "expected");
        }
    test::expect_said(test::refusal([] { blind("[injury]\nperforation = 1\n"); }), "perforation_N");
    test::expect_said(test::refusal([] { blind("[injury]\noff = 1\n"); }), "true or false");
}

TEST(Injury, AWireThatIsPushedOnDissectsAndThenPerforatesOnceAtTheEnd) {
    Exercise exercise(blind(), false);
    const Simulation& simulation = exercise.simulation();
    double before = 0;
    std::vector<double> rising;
    for (int frame = 0; frame < 200; ++frame) {
        const Frame made =
            exercise.next_frame(std::vector<script::Command>{script::Advance{frame < 58 ? 1 : 0.1}});
        const auto all = simulation.injuries().all();
        for (const Injury& injury : all.last(static_cast<std::size_t>(made.motion.injuries))) {
            EXPECT_GT(injury.force, injury.threshold);
            EXPECT_LT(before, 1.05 * injury.threshold);  // the rest before it did not reach it
            EXPECT_EQ(injury.frame, frame);
            EXPECT_NEAR(injury.place.x(), 100, 4);
            EXPECT_NEAR(injury.along, geometry::length_of(simulation.anatomy().branches[0].points), 4);
            EXPECT_GT(injury.outward.x(), 0.7);
            rising.push_back(injury.threshold * facing(simulation));
        }
        if (rests(simulation)) before = force_at_end(simulation);
    }
    ASSERT_EQ(simulation.injuries().all().size(), 2u);
    EXPECT_EQ(simulation.injuries().all()[0].kind, InjuryKind::Dissection);
    EXPECT_EQ(simulation.injuries().all()[1].kind, InjuryKind::Perforation);
    EXPECT_NEAR(rising[0], by_hand(0.17, wire_diameter), 0.03 * rising[0]);
    EXPECT_NEAR(rising[1], by_hand(0.84, wire_diameter), 0.03 * rising[1]);
    // Away and back it is another one; a wall that bears everything has none.
    for (int frame = 0; frame < 30; ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Withdraw{3}});
    EXPECT_FALSE(simulation.injuries().open());
    for (int frame = 0; frame < 90; ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Advance{1.5}});
    EXPECT_EQ(simulation.injuries().count(InjuryKind::Perforation), 2);
    Exercise borne(blind("[injury]\noff = true\n"), false);
    for (int frame = 0; frame < 85; ++frame)
        borne.next_frame(std::vector<script::Command>{script::Advance{1}});
    EXPECT_TRUE(borne.simulation().injuries().all().empty());
    EXPECT_GT(force_at_end(borne.simulation()), rising[1]);
}

TEST(Injury, AreOfTheDeviceThatLeadsAndOfItsDiameter) {
    Exercise exercise(blind(catheter_section), false);
    const Simulation& simulation = exercise.simulation();
    // Over the wire, which is then drawn back into it, to the end of the vessel.
    for (int frame = 0; frame < 20; ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Advance{2, script::DeviceRole::Catheter}});
    for (int frame = 0; frame < 20; ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Withdraw{3}});
    EXPECT_EQ(foremost(simulation).role, script::DeviceRole::Catheter);
    for (int frame = 0; frame < 90 && simulation.injuries().all().empty(); ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Advance{1.5, script::DeviceRole::Catheter}});
    ASSERT_FALSE(simulation.injuries().all().empty());
    const double cosine = facing(simulation);
    EXPECT_GT(cosine, 0.3);
    const Injury& injury = simulation.injuries().all().front();
    EXPECT_EQ(injury.device, script::DeviceRole::Catheter);
    const double strength = injury.kind == InjuryKind::Dissection ? 0.17 : 0.84;
    EXPECT_NEAR(injury.threshold, by_hand(strength, catheter_diameter, cosine), 0.03 * injury.threshold);
}

TEST(Injury, PastAnOpenEndTheWallIsThatOfTheNarrowingVessel) {
    std::string open = blind_bend;
    open.replace(open.find("closed = true\n"), 14, "");
    Exercise exercise(scenario::parse_scenario(open, "open.toml", test::asset("devices")), false);
    const Simulation& simulation = exercise.simulation();
    for (int frame = 0; frame < 120 && simulation.injuries().all().empty(); ++frame)
        exercise.next_frame(std::vector<script::Command>{script::Advance{1.5}});
    ASSERT_FALSE(simulation.injuries().all().empty());
    const Injury& injury = simulation.injuries().all().front();
    const double past = injury.place.x() - 100;
    EXPECT_GT(past, 5);
    // A cone over 14 radii to 0.3 mm for a joint on its axis.
    const double radius = std::max(vessel - (vessel - 0.3) / (14 * vessel) * past, wire_diameter / 2);
    const double strength = injury.kind == InjuryKind::Dissection ? 0.17 : 0.84;
    EXPECT_NEAR(injury.threshold * facing(simulation),
                std::numbers::pi * wire_diameter * 0.2 * radius * strength, 0.15 * injury.threshold);
}

/// Every event is of a force above the threshold, and every rest above it belongs to an event.
TEST(Injury, OfWildHandsAreAllRestsAboveTheThresholdAndNoOthers) {
    const std::string variants[] = {"", "[wall]\nfriction = 0\n", "[tissue]\n", catheter_section};
    int events = 0, over = 0, frames = 0, of_catheters = 0;
    const int seeds = test::cases(24);
    for (int seed = 1; seed <= seeds; ++seed) {
        std::mt19937 random(static_cast<unsigned>(seed));
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        const bool two = seed % 4 == 3;
        Exercise exercise(blind(variants[static_cast<std::size_t>(seed) % 4]), false);
        const Simulation& simulation = exercise.simulation();
        std::size_t known = 0;
        geometry::Vec3 pressed = geometry::Vec3::Zero();  // where the end last pressed too hard
        double farthest = 0;                              // from there, since
        for (int frame = 0; frame < 250; ++frame, ++frames) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(frame));
            const script::DeviceRole held =
                two && unit() < 0.7 ? script::DeviceRole::Catheter : script::DeviceRole::Wire;
            std::vector<script::Command> commands;
            const double what = unit();
            if (what < 0.5) commands.push_back(script::Advance{6 * unit(), held});
            if (what > 0.45 && what < 0.65) commands.push_back(script::Withdraw{9 * unit(), held});
            if (what > 0.6 && what < 0.9) commands.push_back(script::Rotate{4 * unit() - 2, held});
            if (what > 0.995) commands.push_back(script::Reset{});
            const Frame made = exercise.next_frame(commands);
            if (made.motion.reset) known = 0;
            const auto all = simulation.injuries().all();
            ASSERT_EQ(all.size(), known + static_cast<std::size_t>(made.motion.injuries));
            const double force = force_at_end(simulation), angle = force > 0 ? facing(simulation) : 1;
            const bool catheter_leads = two && simulation.inserted(script::DeviceRole::Catheter) >=
                                                   simulation.inserted(script::DeviceRole::Wire) - 1e-9;
            const double diameter = catheter_leads ? catheter_diameter : wire_diameter;
            const geometry::Vec3 tip = simulation.wire().joints.back() - simulation.contacts().back().given;
            if (rests(simulation)) farthest = std::max(farthest, (tip - pressed).norm());
            for (std::size_t k = known; k < all.size(); ++k, ++events) {
                EXPECT_TRUE(rests(simulation));
                EXPECT_NEAR(all[k].force, force, 1e-12);
                EXPECT_EQ(all[k].device,
                          catheter_leads ? script::DeviceRole::Catheter : script::DeviceRole::Wire);
                of_catheters += catheter_leads;
                const double strength = all[k].kind == InjuryKind::Dissection ? 0.17 : 0.84;
                EXPECT_GT(force, by_hand(strength, diameter, angle) * 0.97);
                // Another one of a kind only where the end has been away.
                if (k > 0 && all[k].kind <= all[k - 1].kind && all[k].device == all[k - 1].device) {
                    EXPECT_GT(farthest, 5 * 0.97);
                }
            }
            known = all.size();
            if (!rests(simulation)) continue;
            const Injury* open = simulation.injuries().open();
            if (force > by_hand(0.17, diameter, angle) * 1.03) {
                ++over;
                ASSERT_TRUE(open) << force << " N";
                EXPECT_GE(open->force, force);
            }
            if (force > by_hand(0.84, diameter, angle) * 1.03) {
                EXPECT_EQ(open->kind, InjuryKind::Perforation);
            }
            if (force > by_hand(0.17, diameter, angle)) pressed = tip, farthest = 0;
        }
    }
    std::printf(
        "%d frames of seeds 1 to %d: %d events, %d of them of catheters, %d rests above the threshold\n",
        frames, seeds, events, of_catheters, over);
    // Hands whose shafts bow outside press less: 17 with the first twelve.
    EXPECT_GT(events, seeds / 2);
    EXPECT_GT(over, events);
}

TEST(Injury, IsInSnapshotsAndInTheStatesHash) {
    Exercise exercise(blind("[injury]\nperforation_N = 0.3\n"), false);
    const auto push = [](Exercise& at) { at.next_frame(std::vector<script::Command>{script::Advance{1}}); };
    for (int frame = 0; frame < 85 && exercise.simulation().injuries().count(InjuryKind::Perforation) == 0;
         ++frame)
        push(exercise);
    ASSERT_EQ(exercise.simulation().injuries().count(InjuryKind::Perforation), 1);
    exercise.next_frame(std::vector<script::Command>{script::Inject{4, 8, "v", 320}});
    for (int frame = 0; frame < 15; ++frame) exercise.next_frame({});
    const Exercise::Snapshot kept = exercise.snapshot();
    Exercise other(blind("[injury]\nperforation_N = 0.3\n"), false);
    other.restore(kept);
    for (int frame = 0; frame < 30; ++frame) {
        push(exercise);
        push(other);
        ASSERT_EQ(exercise.simulation().state_hash(), other.simulation().state_hash());
    }
    ASSERT_EQ(other.simulation().contrast().holes().size(), 1u);
    EXPECT_GT(other.simulation().contrast().holes()[0].iodine, 1);
    EXPECT_EQ(other.score().handling_errors.size(), exercise.score().handling_errors.size());
    // Back to where nothing was hurt.
    Exercise whole(blind("[injury]\nperforation_N = 0.3\n"), false);
    const Exercise::Snapshot unhurt = whole.snapshot();
    exercise.restore(unhurt);
    EXPECT_TRUE(exercise.simulation().injuries().all().empty());
    EXPECT_FALSE(exercise.simulation().injuries().open());
    EXPECT_TRUE(exercise.simulation().contrast().holes().empty());
    EXPECT_EQ(exercise.simulation().state_hash(), whole.simulation().state_hash());
}

TEST(Injury, CostsPointsByItsKindAndIsNoErrorOfHandlingBesides) {
    Score score;
    score.completed = true;
    score.handling_errors.resize(3);
    score.handling_errors[1].kind = HandlingError::Dissection;
    score.handling_errors[2].kind = HandlingError::Perforation;
    EXPECT_DOUBLE_EQ(grade(score, {}).points, 100 - 15 - 50);
    scenario::Benchmark skilled;
    skilled.errors.values = {0};
    EXPECT_DOUBLE_EQ(grade(score, skilled).lines[6].cost, 20 * (1 - std::sqrt(0.5)));  // of the one error
    score.handling_errors[1].kind = HandlingError::Perforation;
    EXPECT_DOUBLE_EQ(grade(score, {}).points, 0);
}

TEST(Leak, CloudsHaveTheIodineOfTheHoleAndLieOutsideTheVessel) {
    Exercise exercise(blind(), false);
    blood::Hole hole;
    hole.cell = exercise.simulation().contrast().blood().nearest({70, 0, 80});
    hole.place = {70, 0, 81.2};
    hole.outward = {0, 0, 1};
    hole.diameter = 0.889;
    hole.blood = 3;
    hole.iodine = 250;
    const auto clouds = clouds_of(exercise.simulation().contrast().blood(), hole);
    double sum = 0;
    geometry::Vec3 middle = geometry::Vec3::Zero();
    for (const render::IodineCloud& cloud : clouds) {
        sum += cloud.iodine;
        middle += cloud.iodine * cloud.middle;
        EXPECT_GT(cloud.iodine, 0);
        EXPECT_GT(cloud.spread, 0);
    }
    EXPECT_NEAR(sum, hole.iodine, 1e-9 * sum);
    middle /= sum;
    EXPECT_GT(middle.z(), 84);
    hole.iodine = 0;
    EXPECT_TRUE(clouds_of(exercise.simulation().contrast().blood(), hole).empty());
}

using InjuryRun = test::InFolder;

/// Commands go in; score, notice, truth and image come out.
TEST_F(InjuryRun, FromAPushToTheScoreTheNoticeTheTruthAndTheStainInTheImage) {
    std::string push = "0 beam on\n1..82 advance 1 mm\n83..96 withdraw 4 mm\n98 mode dsa\n";
    push += "102 inject 20 ml at 4 ml/s into v\n220 end\n";
    run::RunOptions options;
    options.truth = true;
    const scenario::Scenario patient = blind();
    const run::RunResult result =
        run::run_headless(patient, script::parse_commands(push, "push.gw"), folder / "out", options);
    scenario::Scenario bears = blind("[injury]\noff = true\n");
    run::run_headless(bears, script::parse_commands(push, "push.gw"), folder / "bears", options);

    const auto score = nlohmann::json::parse(test::read(folder / "out/score.json"));
    const auto& errors = score["handling_errors"];
    ASSERT_EQ(errors["counts"]["perforation"], 1);
    const auto mark = *std::find_if(errors["marks"].begin(), errors["marks"].end(),
                                    [](const auto& m) { return m["error"] == "perforation"; });
    EXPECT_EQ(mark["device"], "wire");
    EXPECT_EQ(mark["branch"], "v");
    EXPECT_EQ(mark["unit"], "N");
    EXPECT_GT(mark["amount"], mark["threshold_N"]);
    EXPECT_NEAR(mark["threshold_N"].get<double>(), by_hand(0.84, wire_diameter), 0.05);
    test::expect_said(mark["threshold_source"].get<std::string>(), "docs/injury.md");
    const bool told = std::any_of(result.notices.begin(), result.notices.end(), [](const std::string& text) {
        return text.find("The wire has perforated the v") != std::string::npos;
    });
    EXPECT_TRUE(told);

    // The truth has the stain, which lies outside the vessel, and the image is darker there.
    const auto truth = nlohmann::json::parse(test::read(folder / "out/truth/frame_000220.json"));
    ASSERT_TRUE(truth.contains("extravasation_mask"));
    const auto picture = [&](const std::string& name) { return render::read_png(folder / name); };
    const render::GrayImage stain = picture("out/truth/frame_000220_extravasation.png"),
                            vessels = picture("out/truth/frame_000220_vessels.png"),
                            shown = picture("out/frames/frame_000220.png"),
                            before = picture("bears/frames/frame_000220.png");
    EXPECT_FALSE(std::filesystem::exists(folder / "bears/truth/frame_000220_extravasation.png"));
    double x = 0, y = 0, number = 0, now = 0, then = 0, beside = 0, elsewhere = 0, elsewhere_then = 0;
    for (int row = 0; row < stain.height; ++row)
        for (int column = 0; column < stain.width; ++column) {
            const auto k = static_cast<std::size_t>(row) * static_cast<std::size_t>(stain.width) +
                           static_cast<std::size_t>(column);
            if (!stain.pixels[k]) {
                ++elsewhere;
                elsewhere_then += std::abs(before.pixels[k] - shown.pixels[k]);
                continue;
            }
            ++number;
            x += column;
            y += row;
            beside += vessels.pixels[k] == 0;
            now += shown.pixels[k];
            then += before.pixels[k];
        }
    ASSERT_GT(number, 50);
    EXPECT_GT(beside, 0.5 * number);
    EXPECT_LT(now / number, then / number - 10);
    EXPECT_LT(elsewhere_then / elsewhere, 6);
    // Beyond the vessel's closed end, at (100, 0, 80): a pool of 5 ml in 10 ml of tissue, 13 mm in radius.
    const render::Pixel end = render::project(patient.c_arm, {100, 0, 80});
    EXPECT_NEAR(x / number, end.x + 25, 15);
    EXPECT_NEAR(y / number, end.y, 20);

    // The recording gives the same score.
    const run::RunResult again =
        run::run_headless(patient, script::load_commands(folder / "out/run.gw"), folder / "again", options);
    EXPECT_TRUE(again.differences.empty());
    EXPECT_EQ(test::read(folder / "again/score.json"), test::read(folder / "out/score.json"));
}

}  // namespace exercise
