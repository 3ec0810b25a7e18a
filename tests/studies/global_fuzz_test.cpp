/// Thousands of random frames through the global relaxer: pushes, pulls, turns of the hub, bursts, short
/// budgets.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "physics/energy.h"
#include "physics/relaxer.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

struct Tally {
    std::vector<double> times;  // of the processor for a frame [ms]
    int frames = 0, unconverged = 0, kinks = 0;
    double deepest = 0;  // penetration beyond what it was reported with a force for [mm]
};

/// Random vessel and wire, then random frames. `hardness` multiplies the wall's stiffness.
void play(unsigned seed, int frames, double hardness, Tally& tally) {
    std::mt19937 random(seed);
    auto unit = [&] { return random() / 4294967296.0; };
    std::vector<engine::PenMove> path = {engine::Run{20}};
    for (int k = 0; k < 8; ++k) {
        const Vec3 axis(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
        path.push_back(engine::Arc{10 + 20 * unit(), (unit() < 0.5 ? -1 : 1) * (0.4 + unit()), axis});
        path.push_back(engine::Run{2 + 10 * unit()});
    }
    const Polyline line = engine::draw(path);
    const double length = engine::length(path);
    GuidewireSpec spec;
    spec.segment_length = unit() < 0.5 ? 1.0 : 1.5;
    spec.tip_length = 10 + 30 * unit();
    spec.transition_length = 20 + 80 * unit();
    spec.curved_length = 8 + 8 * unit();
    spec.curved_angle = 1.4 * unit();
    const TubeWall wall(line, 1.2 + 2.5 * unit(), hardness * (10 + 40 * unit()), 0.44);
    Guidewire wire = wire_along(spec, line, 30);
    RelaxerConfig config;
    config.kind = RelaxerKind::Global;
    const auto relaxer = make_relaxer(config);
    const RelaxBudget unlimited{400 * 300, 0, 0};
    relaxer->relax(wire, wall, unlimited);

    for (int frame = 0; frame < frames; ++frame) {
        const double what = unit();
        const std::clock_t start = std::clock();
        if (what < 0.40) {
            move(wire, spec.segment_length);
        } else if (what < 0.55) {
            move(wire, -spec.segment_length);
        } else if (what < 0.75) {
            rotate(wire, (unit() - 0.5) * M_PI / 3);
        } else if (what < 0.9) {
            const int burst = 2 + static_cast<int>(12 * unit());
            for (int k = 0; k < burst && wire.inserted_length() < length - 20; ++k) {
                move(wire, spec.segment_length);
                relaxer->relax(wire, wall, {20 * wire.segments(), 0, 0});  // a share of the frame each
            }
        } else {
            for (int k = 0; k < 10; ++k) move(wire, -spec.segment_length);
        }
        while (wire.inserted_length() > length - 15) move(wire, -spec.segment_length);
        if (unit() < 0.1)
            relaxer->relax(wire, wall, {3 * wire.segments(), 0, 0});  // a frame cut short, then on
        const RelaxReport report = relaxer->relax(wire, wall, unlimited);
        tally.times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
        ++tally.frames;
        tally.unconverged += !report.converged;
        if (!report.converged)
            std::printf("seed %u frame %d: |g|/C %.1e, strict %d, %d steps, N %d, bend %.2f\n", seed, frame,
                        report.gradient, report.strict_minimum, report.newton_steps, wire.segments(),
                        report.largest_bend);
        tally.kinks += report.largest_bend > M_PI / 3;
        const auto broken = validate(wire);
        ASSERT_TRUE(broken.empty()) << broken.front();
        for (const WallContact& c : all_contacts(wire, wall))
            tally.deepest = std::max(tally.deepest, c.penetration);
    }
}

/// Random frames in 50 vessels; SELDINGER_FUZZ_SEEDS=N plays N vessels.
Tally play_all(double hardness) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int vessels = more ? std::atoi(more) : 50;
    Tally tally;
    for (int seed = 1; seed <= vessels; ++seed) play(static_cast<unsigned>(seed), 100, hardness, tally);
    std::sort(tally.times.begin(), tally.times.end());
    std::printf(
        "%d frames: %d unconverged, %d kinks, deepest contact %.4f mm, p99 %.2f ms, longest %.2f ms\n",
        tally.frames, tally.unconverged, tally.kinks, tally.deepest,
        tally.times[tally.times.size() * 99 / 100], tally.times.back());
    return tally;
}

}  // namespace

TEST(GlobalFuzz, RandomFramesEndAtEquilibrium) {
    const Tally tally = play_all(1);
    EXPECT_LE(tally.unconverged, tally.frames / 1000);
    EXPECT_EQ(tally.kinks, 0);
    EXPECT_LT(tally.deepest, 0.5);
}

TEST(GlobalFuzz, RandomFramesInAWallAThousandTimesStifferEndAtEquilibrium) {
    const Tally tally = play_all(1000);
    EXPECT_LE(tally.unconverged, tally.frames / 200);
    EXPECT_EQ(tally.kinks, 0);
    EXPECT_LT(tally.deepest, 0.5 / 100);
}
