/// The model changed during an exercise: the wire lies where it lay, at rest with other numbers.

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/simulation.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

Simulation pushed(double mm, int updates_per_frame = 20000) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.budget.updates = updates_per_frame;
    Simulation simulation(scenario);
    simulation.apply(script::Rotate{0.8});
    for (double done = 0; done < mm; done += 2) {
        simulation.apply(script::Advance{2});
        simulation.step();
    }
    return simulation;
}

TEST(Retune, WithItsOwnNumbersTheWireStaysWhereItIs) {
    Simulation simulation = pushed(30);
    const physics::Chain before = simulation.wire();
    simulation.retune(simulation.tuning());
    EXPECT_NEAR(simulation.wire().inserted_length(), before.inserted_length(), 1e-9);
    EXPECT_EQ(simulation.wire().devices[0].roll, before.devices[0].roll);
    ASSERT_EQ(simulation.wire().segments(), before.segments());
    for (int i = 0; i <= before.segments(); ++i)
        EXPECT_LT((simulation.wire().joints[i] - before.joints[i]).norm(), 1e-6) << i;
}

TEST(Retune, AStifferWireInAFinerModelLiesStraighter) {
    Simulation simulation = pushed(30);
    const auto bend = [&] {
        double sum = 0;
        const physics::Chain& wire = simulation.wire();
        for (int i = 1; i < wire.segments(); ++i)
            if (wire.devices[0].rest[i].angle == 0)
                sum += std::pow((wire.tangents[i + 1] - wire.tangents[i]).norm(), 2) / wire.length_of(i);
        return sum;
    };
    const double before = bend();
    Tuning tuning = simulation.tuning();
    tuning.shaft_rigidity *= 20;
    tuning.tip_rigidity *= 20;
    tuning.segment_length /= 2;
    simulation.retune(tuning);
    EXPECT_LT(bend(), before);
    EXPECT_GT(simulation.wire().segments(), 40);
}

/// Every request is either rejected and changes nothing, or leaves the wire as long as before and able to go
/// on.
TEST(Retune, AnyNumbersAreTakenOrRefused) {
    constexpr double wild[] = {
        0, -1, 1e-9, 1e9, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
    int refused = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        std::mt19937 random(seed);
        const auto factor = [&] {
            return std::exp(4 * (std::ldexp(static_cast<double>(random()), -32) - 0.5));
        };
        Simulation simulation = pushed(10 + random() % 30, 2000);
        Tuning tuning = simulation.tuning();
        tuning.shaft_rigidity *= factor();
        tuning.tip_rigidity *= factor();
        tuning.segment_length *= factor();
        tuning.wall_stiffness *= factor();
        constexpr physics::RelaxerKind kinds[] = {
            physics::RelaxerKind::Global, physics::RelaxerKind::Segment, physics::RelaxerKind::FirstOrder,
            physics::RelaxerKind::Combined, physics::RelaxerKind::Konings};
        tuning.relaxer.kind = kinds[random() % 5];
        tuning.relaxer.varied_segments = 1 + static_cast<int>(random() % 5);
        if (random() % 4 == 0) {
            double* const numbers[] = {&tuning.shaft_rigidity, &tuning.tip_rigidity, &tuning.segment_length,
                                       &tuning.wall_stiffness};
            *numbers[random() % 4] = wild[random() % 6];
        }
        const double length = simulation.inserted();
        const std::uint64_t state = simulation.state_hash();
        try {
            simulation.retune(tuning);
        } catch (const io::InputError&) {
            ++refused;
            EXPECT_EQ(simulation.state_hash(), state) << "seed " << seed;
            continue;
        }
        EXPECT_NEAR(simulation.inserted(), length, tuning.segment_length) << "seed " << seed;
        for (int frame = 0; frame < 3; ++frame) {
            simulation.apply(script::Advance{1});
            simulation.apply(script::Rotate{0.3});
            simulation.step();
        }
        for (const geometry::Vec3& joint : simulation.wire().joints)
            ASSERT_TRUE(joint.allFinite()) << "seed " << seed;
        simulation.reset();
        EXPECT_EQ(simulation.tuning().segment_length, tuning.segment_length) << "seed " << seed;
    }
    EXPECT_GT(refused, 1);
    EXPECT_LT(refused, 30);
}

}  // namespace
}  // namespace exercise
