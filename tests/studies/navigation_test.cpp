/// A careless hand in the iliac arteries with the demo's wire: random pushes, pulls, turns and bursts, out of
/// open ends too. What a frame's budget leaves undone is made up for in later frames.

#include <cstdlib>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/simulation.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

struct Restlessness {
    int frames = 0, late = 0, late_in_a_row = 0, most_late_in_a_row = 0;
    double bend = 0, deepest_at_rest = 0;
};

void play(exercise::Simulation& simulation, std::uint32_t seed, int frames, Restlessness& tally) {
    std::mt19937 random(seed);
    const auto draw = [&](double from, double to) { return from + (to - from) * (random() / 4294967296.0); };
    double trend = 1;
    for (int frame = 0; frame < frames; ++frame) {
        if (frame % 40 == 0) trend = draw(-0.3, 1);
        const double kind = draw(0, 1);
        if (kind < 0.6) {
            const double mm = draw(0.2, 3) * (draw(0, 1) < 0.1 ? 8 : 1);
            if (draw(0, 1) < 0.5 + 0.5 * trend)
                simulation.apply(script::Advance{mm});
            else
                simulation.apply(script::Withdraw{mm});
        }
        if (kind > 0.4 && kind < 0.9) simulation.apply(script::Rotate{draw(-0.6, 0.6)});
        const exercise::StepReport report = simulation.step();
        ASSERT_TRUE(physics::validate(simulation.wire()).empty()) << "seed " << seed << ", frame " << frame;
        ++tally.frames;
        tally.late += !report.relax.converged();
        tally.late_in_a_row = report.relax.converged() ? 0 : tally.late_in_a_row + 1;
        tally.most_late_in_a_row = std::max(tally.most_late_in_a_row, tally.late_in_a_row);
        tally.bend = std::max(tally.bend, report.relax.largest_bend);
        if (!report.relax.converged()) continue;
        for (const physics::WallContact& c : simulation.contacts())
            tally.deepest_at_rest = std::max(tally.deepest_at_rest, c.pressed_in());
    }
}

}  // namespace

TEST(Navigation, ACarelessHandNeverBreaksTheWire) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int seeds = more ? std::max(1, std::atoi(more)) : 2;
    exercise::Simulation simulation(test::shipped_scenario("renal"), test::cache());
    Restlessness tally;
    for (int seed = 1; seed <= seeds; ++seed) {
        simulation.reset();
        play(simulation, static_cast<std::uint32_t>(seed), 500, tally);
    }
    EXPECT_LE(tally.late, 0.01 * tally.frames);  // bursts of 24 mm under a budget
    EXPECT_LE(tally.most_late_in_a_row, 4);
    EXPECT_LT(tally.bend, std::numbers::pi / 3);
    EXPECT_LT(tally.deepest_at_rest, 0.25);  // a tip wedged past an end: 1.25 N at 5 N/mm
    RecordProperty("frames", tally.frames);
    RecordProperty("under_way_at_their_end", tally.late);
    RecordProperty("most_late_in_a_row", tally.most_late_in_a_row);
    RecordProperty("largest_bend_rad", std::to_string(tally.bend));
}
