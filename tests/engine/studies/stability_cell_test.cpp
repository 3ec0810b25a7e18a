#include "engine/studies/stability_cell.h"

#include <cmath>
#include <gtest/gtest.h>

namespace studies {
namespace {

/// At rest where the reference is.
CellMeasure rested() {
    CellMeasure m;
    m.energies.assign(40, 2.0);
    m.gradient = 1e-6;
    m.deviation = m.basin_deviation = 1e-4;
    m.penetration = m.reference_penetration = 0.01;
    m.moved = 1e-9;
    m.clearance = 1;
    return m;
}

}  // namespace

TEST(StabilityRules, NameEachOutcomeFromNumbersAlone) {
    EXPECT_EQ(judge(rested()), Outcome::Converged);
    CellMeasure m = rested();
    m.finite = false;
    EXPECT_EQ(judge(m), Outcome::NotANumber);
    m = rested();
    m.penetration = 0.6;
    EXPECT_EQ(judge(m), Outcome::LeftTheLumen);
    m.reference_penetration = 0.4;  // the force explains as much
    EXPECT_EQ(judge(m), Outcome::Converged);
    m = rested();
    m.deviation = m.basin_deviation = 0.2;
    EXPECT_EQ(judge(m), Outcome::WrongBasin);
    m.basin_deviation = 0;  // on its way along a flat valley
    EXPECT_EQ(judge(m), Outcome::StillMoving);
    m = rested();
    m.gradient = 1e-3;
    EXPECT_EQ(judge(m), Outcome::Stuck);
    m.moved = 0.01;
    EXPECT_EQ(judge(m), Outcome::StillMoving);
    m.energies[35] = 2.001;
    EXPECT_EQ(judge(m), Outcome::Oscillates);
    m.energies[35] = 2.0;
    m.energies[10] = 3.0;  // long ago
    EXPECT_EQ(judge(m), Outcome::StillMoving);
}

TEST(StabilityDeviation, OfARoundVesselIgnoresTurnsAndMirrors) {
    std::vector<geometry::Vec3> a, b, c;
    for (int i = 0; i < 20; ++i) {
        const double y = std::sin(0.2 * i), z = 0.3 * std::sin(0.5 * i), t = 1.1;
        a.emplace_back(i, y, z);
        b.emplace_back(i, std::cos(t) * y - std::sin(t) * z, std::sin(t) * y + std::cos(t) * z);
        c.emplace_back(i, y, -z);
    }
    EXPECT_GT(largest_deviation(a, b, Symmetry::None), 0.5);
    EXPECT_LT(largest_deviation(a, b, Symmetry::RoundAboutX), 1e-12);
    EXPECT_LT(largest_deviation(a, c, Symmetry::RoundAboutX), 1e-12);
    EXPECT_DOUBLE_EQ(largest_deviation(a, a, Symmetry::None), 0);
    EXPECT_TRUE(std::isinf(largest_deviation(a, {}, Symmetry::None)));
}

}  // namespace studies
