/// Invasive pressure as a catheter in an exercise shows it.

#include "engine/exercise/tip_pressure.h"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sstream>

#include "engine/blood/pressure.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/room_readout.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using script::DeviceRole;
using Commands = std::vector<script::Command>;

/// The bent tube with a 5F catheter of 1.67 mm, 30 mm inside, and a wire of so many.
scenario::Scenario with_catheter(double radius, double wire, const std::string& more = "") {
    std::string toml = test::small_toml_with("radius_mm = 2.0", fmt::format("radius_mm = {}", radius));
    toml = test::replaced(toml, "inserted_mm = 20.0", fmt::format("inserted_mm = {}", wire));
    return test::small_scenario(
        toml + fmt::format("[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = 30\n{}", more));
}

void pull_wire_out(Exercise& exercise) {
    for (int k = 0; k < 60 && exercise.simulation().inserted() > 0; ++k)
        exercise.next_frame(Commands{script::Withdraw{20, DeviceRole::Wire}});
    for (int k = 0; k < 5; ++k) exercise.next_frame(Commands{});
}

TipPressure at_catheter(const Exercise& exercise) {
    return pressure_at_tip(exercise.simulation(), DeviceRole::Catheter).value();
}

TEST(TipPressure, AWireHasNone) {
    Exercise exercise(test::small_scenario(), false);
    EXPECT_FALSE(pressure_device(exercise.simulation()));
    EXPECT_FALSE(pressure_at_tip(exercise.simulation(), DeviceRole::Wire));
    EXPECT_FALSE(pressure_at_tip(exercise.simulation(), DeviceRole::Catheter));
    const Frame frame = exercise.next_frame(Commands{});
    EXPECT_EQ(Reader(exercise.simulation()).read(exercise).pressure, 0);
    EXPECT_NE(Trace(exercise.simulation()).rows(frame, exercise.score()).find(",,,,,"), std::string::npos);
    RoomReadout room;
    room.observe(frame, exercise.score());
    EXPECT_EQ(room.read(frame, exercise.score()).pressure_of, "");
}

TEST(TipPressure, AnOpenCatheterShowsTheAortasBeat) {
    Exercise exercise(with_catheter(2.0, 50, "[contrast]\nsystolic_mmHg = 150\ndiastolic_mmHg = 90\n"),
                      false);
    EXPECT_EQ(pressure_device(exercise.simulation()), DeviceRole::Catheter);
    const TipPressure with_wire = at_catheter(exercise);
    pull_wire_out(exercise);
    double highest = 0, lowest = 1000;
    const TipPressure open = at_catheter(exercise);
    for (int k = 0; k < 200; ++k) {
        exercise.next_frame(Commands{});
        const double now = at_catheter(exercise).now;
        highest = std::max(highest, now);
        lowest = std::min(lowest, now);
    }
    // 5F in 4 mm: some of the pressure is lost past it.
    EXPECT_NEAR(open.systolic, 148, 3);
    EXPECT_NEAR(open.diastolic, 89, 2);
    EXPECT_NEAR(open.mean, 109, 2);
    EXPECT_NEAR(highest, open.systolic, 1.5);
    EXPECT_NEAR(lowest, open.diastolic, 1.5);
    // A wire in the lumen damps the pulse and keeps the mean.
    EXPECT_NEAR(with_wire.mean, open.mean, 0.5);
    EXPECT_LT(with_wire.systolic - with_wire.diastolic, 0.5 * (open.systolic - open.diastolic));
}

TEST(TipPressure, AWedgedCatheterLosesPulseAndMean) {
    Exercise wide(with_catheter(2.0, 50), false), narrow(with_catheter(1.0, 50), false);
    pull_wire_out(wide);
    pull_wire_out(narrow);
    const TipPressure open = at_catheter(wide), wedged = at_catheter(narrow);
    EXPECT_GT(open.mean, 88);
    EXPECT_LT(wedged.mean, 75);
    EXPECT_GT(wedged.mean, blood::collateral_pressure);
    EXPECT_LT(wedged.systolic - wedged.diastolic, 0.75 * (open.systolic - open.diastolic));
}

TEST(TipPressure, FallsBeyondASpasmAndComesBack) {
    Exercise exercise(test::small_scenario(), false);
    const auto distal = [&] {
        const blood::BloodFlow& flow = exercise.simulation().contrast().blood();
        return blood::mean_pressure_in(flow, flow.outlets[0].cell);
    };
    double before = distal();
    EXPECT_EQ(before, 93);
    for (const double percent : {50.0, 60.0, 70.0, 80.0, 90.0}) {
        exercise.next_frame(
            Commands{script::Complicate{script::ComplicationKind::Spasm, "tube", 45, 16, percent}});
        for (int k = 0; k < 100; ++k) exercise.next_frame(Commands{});
        EXPECT_LT(distal(), before) << percent;
        before = distal();
    }
    EXPECT_LT(before, 30);
    exercise.next_frame(Commands{script::Relieve{}});
    for (int k = 0; k < 100; ++k) exercise.next_frame(Commands{});
    EXPECT_EQ(distal(), 93);
}

TEST(TipPressure, NothingIsReadWhileTheCatheterIsInjectedThrough) {
    Exercise exercise(with_catheter(2.0, 50), false);
    pull_wire_out(exercise);
    script::Inject inject;
    inject.rate = 2;
    inject.volume = 2;
    inject.through = DeviceRole::Catheter;
    exercise.next_frame(Commands{inject});
    EXPECT_FALSE(pressure_at_tip(exercise.simulation(), DeviceRole::Catheter));
    bool again = false;
    for (int k = 0; k < 200 && !again; ++k) {
        exercise.next_frame(Commands{});
        again = pressure_at_tip(exercise.simulation(), DeviceRole::Catheter).has_value();
    }
    EXPECT_TRUE(again);
}

TEST(TipPressure, PanelTraceAndReadingSayTheSameAndReplaysToo) {
    Exercise exercise(with_catheter(2.0, 50), false);
    const Reader reader(exercise.simulation());
    const Trace trace(exercise.simulation());
    RoomReadout room;
    const auto play = [&] {
        std::vector<double> seen;
        for (int k = 0; k < 25; ++k) {
            const Frame frame = exercise.next_frame(Commands{script::Withdraw{3, DeviceRole::Wire}});
            room.observe(frame, exercise.score());
            const render::Readout shown = room.read(frame, exercise.score());
            const Observation read = reader.read(exercise);
            EXPECT_EQ(shown.pressure_of, "catheter");
            EXPECT_EQ(shown.heart_rate, 70);
            EXPECT_EQ(shown.pressure, read.pressure);
            EXPECT_EQ(shown.mean_pressure, read.mean_pressure);
            EXPECT_EQ(render::pressure_text(shown), fmt::format("{:.0f}/{:.0f} ({:.0f})", read.systolic,
                                                                read.diastolic, read.mean_pressure));
            seen.insert(seen.end(),
                        {read.pressure, read.systolic, read.diastolic, read.mean_pressure, read.ecg});
            std::istringstream rows(trace.rows(frame, exercise.score()));
            int count = 0;
            for (std::string row; std::getline(rows, row); ++count)
                EXPECT_NE(row.find(fmt::format(",{}", read.mean_pressure)), std::string::npos) << row;
            EXPECT_EQ(count, 2);
        }
        return seen;
    };
    const Exercise::Snapshot start = exercise.snapshot();
    const std::vector<double> first = play();
    exercise.restore(start);
    EXPECT_EQ(play(), first);
}

}  // namespace
}  // namespace exercise
