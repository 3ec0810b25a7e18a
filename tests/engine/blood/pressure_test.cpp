#include "engine/blood/pressure.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "engine/blood/contrast_flow.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/vessels.h"

namespace blood {
namespace {

using geometry::Vec3;
constexpr double pi = std::numbers::pi;

/// A vessel of 120 mm along −z whose radius is `narrow` from 50 to 70 mm, cut into cells that fit.
anatomy::Anatomy narrowed_vessel(double open, double narrow) {
    anatomy::Anatomy vessel = test::straight_vessel(120, open);
    geometry::CentrelineBranch& branch = vessel.branches[0];
    for (std::size_t k = 0; k < branch.points.size(); ++k)
        if (-branch.points[k].z() > 50 && -branch.points[k].z() < 70) branch.radii[k] = narrow;
    return vessel;
}

FlowSpec with_inflow(double inflow) {
    FlowSpec spec;
    spec.inflow = inflow;
    return spec;
}

double pressure_at(const BloodFlow& flow, const Vec3& place) {
    return mean_pressure_in(flow, flow.nearest(place));
}

TEST(Pressure, LaminarLossIsThatOfPoiseuille) {
    // In SI: 20 mm of 1 mm radius take 8 μ L Q / π r⁴ of 2 ml/s, without what the open vessel would take.
    const double by_hand = 8 * 3.5e-3 * 0.020 * 2e-6 / pi * (1 / std::pow(1e-3, 4) - 1 / std::pow(3e-3, 4));
    EXPECT_NEAR(laminar_loss(20, 1, 3) * 2, by_hand, 1e-9 * by_hand);
    EXPECT_EQ(laminar_loss(20, 3, 3), 0);
}

TEST(Pressure, ExpansionLossIsThatOfAStep) {
    // In SI: 1.52 ρ/2 (A₀/A₁ − 1)² v² with v = Q/A₀; an area of a quarter at 5 ml/s.
    const double v = 5e-6 / (pi * 4e-6), by_hand = 1.52 * 1060 / 2 * 9 * v * v;
    EXPECT_NEAR(expansion_loss(1, 2) * 25, by_hand, 1e-9 * by_hand);
    EXPECT_EQ(expansion_loss(2, 2), 0);
}

TEST(Pressure, ARatioAcrossIsThatOfYoungAndTsaiByHand) {
    // 10 mm of 0.8 mm radius in a vessel of 2 mm, 93 mmHg, 2 ml/s at rest: a = 212.024, b = 140.611, R =
    // 6199.47 [Pa s/ml]; q = 1.858142 ml/s at rest, and 4.300415 with R/3.
    Obstruction lesion;
    lesion.laminar = laminar_loss(10, 0.8, 2);
    lesion.turbulent = expansion_loss(0.8, 2);
    EXPECT_NEAR(lesion.laminar, 212.024, 0.001);
    EXPECT_NEAR(lesion.turbulent, 140.611, 0.001);
    EXPECT_NEAR(ratio_across(93, 2, lesion), 1.858142 / 2, 1e-5);
    EXPECT_NEAR(ratio_across(93, 2, lesion, 3), 4.300415 / 6, 1e-5);
    EXPECT_DOUBLE_EQ(ratio_across(93, 2, {}), 1);
    EXPECT_DOUBLE_EQ(ratio_across(93, 0, lesion), 1);
    // A laminar loss alone is a divider.
    lesion.turbulent = 0;
    const double bed = 93 * pascal_per_mmhg / 2;
    EXPECT_NEAR(ratio_across(93, 2, lesion), bed / (bed + lesion.laminar), 1e-12);
    // What is left of the flow in BloodFlow is the same.
    const BloodFlow flow = blood_flow(test::straight_vessel(120, 3), with_inflow(2));
    lesion.turbulent = 140.611;
    lesion.from = {0, 0, -50}, lesion.middle = {0, 0, -60};
    const BloodFlow with = flow.obstructed(std::span(&lesion, 1));
    const Across cells = across(with, 0, {0, 0, -50}, {0, 0, -60}, {0, 0, -70});
    EXPECT_NEAR(mean_pressure_in(with, cells.behind) / mean_pressure_in(with, cells.before),
                ratio_across(93, 2, lesion), 1e-9);
}

TEST(Pressure, CellsAcrossAStretchFollowTheFlow) {
    for (const bool turned : {false, true}) {
        FlowSpec spec = with_inflow(2);
        if (turned) spec.source = "vessel.out";
        const BloodFlow flow = blood_flow(test::straight_vessel(120, 3), spec);
        const Across found = across(flow, 0, {0, 0, -50}, {0, 0, -60}, {0, 0, -70});
        const auto z = [&](int cell) { return flow.cells[static_cast<std::size_t>(cell)].centre.z(); };
        EXPECT_NEAR(z(found.middle), -60, 1);
        EXPECT_NEAR(z(found.before), turned ? -71 : -49, 2);
        EXPECT_NEAR(z(found.behind), turned ? -50 : -70, 1);
    }
    // At a branch's origin the cell before is in the vessel that it leaves.
    const BloodFlow flow = blood_flow(test::small_abdomen(), with_inflow(20));
    const Across found = across(flow, 1, {6, 0, 50}, {14, 0, 50}, {22, 0, 50});
    EXPECT_EQ(flow.cells[static_cast<std::size_t>(found.before)].branch, 0);
    EXPECT_EQ(flow.cells[static_cast<std::size_t>(found.behind)].branch, 1);
    EXPECT_FALSE(across(flow, 99, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}).known());
}

TEST(Pressure, AStenosisTakesWhatItAndTheBedShare) {
    const BloodFlow flow = blood_flow(narrowed_vessel(3, 1.2), with_inflow(4));
    ASSERT_EQ(flow.lesions.size(), 1u);
    const Lesion& lesion = flow.lesions[0];
    double laminar = 0, length = 0;
    for (std::size_t k = 0; k < lesion.cells.size(); ++k) {
        laminar += lesion.laminar[k];
        length += flow.cells[static_cast<std::size_t>(lesion.cells[k])].radius < 1.21
                      ? flow.cells[static_cast<std::size_t>(lesion.cells[k])].length
                      : 0;
    }
    // Its 19 mm of even width, and its shoulders over a millimetre each.
    EXPECT_GT(laminar, laminar_loss(length, 1.2, 3));
    EXPECT_LT(laminar, laminar_loss(20, 1.2, 3));
    EXPECT_NEAR(length, 18, 1.6);
    EXPECT_DOUBLE_EQ(lesion.turbulent, expansion_loss(1.2, 3));
    const double before = pressure_at(flow, {0, 0, -30}), behind = pressure_at(flow, {0, 0, -100});
    EXPECT_EQ(before, 93);
    const double bed = 93 * pascal_per_mmhg / 4, q = behind * pascal_per_mmhg / bed;
    EXPECT_NEAR((bed * q + laminar * q + lesion.turbulent * q * q) / pascal_per_mmhg, 93, 1e-9);
    EXPECT_LT(behind, 90);
    EXPECT_GT(behind, 40);
    double last = before;
    for (double z = -31; z > -119; z -= 1) {
        const double now = pressure_at(flow, {0, 0, z});
        EXPECT_LE(now, last) << z;
        last = now;
    }
    EXPECT_NEAR(last, behind, 1e-9);
}

TEST(Pressure, ATaperingVesselAndANarrowBranchLoseNone) {
    anatomy::Anatomy vessel = test::small_abdomen();
    for (std::size_t k = 0; k < vessel.branches[0].radii.size(); ++k)
        vessel.branches[0].radii[k] = 9 - 0.03 * static_cast<double>(k);
    const BloodFlow flow = blood_flow(vessel);
    EXPECT_TRUE(flow.lesions.empty());
    for (int i = 0; i < static_cast<int>(flow.cells.size()); ++i) EXPECT_EQ(mean_pressure_in(flow, i), 93);
}

TEST(Pressure, AStenosisAtAnOriginCounts) {
    anatomy::Anatomy vessel = test::small_abdomen();
    geometry::CentrelineBranch& renal = vessel.branches[1];
    for (std::size_t k = 0; k < renal.points.size(); ++k)
        if (renal.points[k].x() < 16) renal.radii[k] = 1.0;
    const BloodFlow flow = blood_flow(vessel);
    ASSERT_EQ(flow.lesions.size(), 1u);
    EXPECT_LT(pressure_at(flow, {40, 0, 50}), 80);
    EXPECT_EQ(pressure_at(flow, {0, 0, 20}), 93);
    EXPECT_EQ(pressure_at(flow, {0, -40, 70}), 93);
}

/// A spasm in the middle of the left renal artery of small_abdomen, 10 mm long.
Obstruction spasm(double percent) {
    const double left = 3 * (1 - percent / 100);
    return {1, {20, 0, 50}, {25, 0, 50}, laminar_loss(10, left, 3), expansion_loss(left, 3)};
}

TEST(Pressure, FallsBeyondAnObstructionTheMoreTheNarrowerItIs) {
    const BloodFlow open = blood_flow(test::small_abdomen());
    double before = 93;
    for (int percent = 10; percent <= 90; percent += 5) {
        const Obstruction in_the_way = spasm(percent);
        const BloodFlow flow = open.obstructed({&in_the_way, 1});
        const double behind = pressure_at(flow, {45, 0, 50});
        EXPECT_LT(behind, before) << percent;
        EXPECT_GT(behind, 0) << percent;
        EXPECT_EQ(pressure_at(flow, {12, 0, 50}), 93);
        EXPECT_EQ(pressure_at(flow, {0, 0, 10}), 93);
        // What the flow that is left loses.
        const double q = flow.resting()[static_cast<std::size_t>(flow.nearest({45, 0, 50}))];
        const double lost = in_the_way.laminar * q + in_the_way.turbulent * q * q;
        EXPECT_NEAR(behind, 93 - lost / pascal_per_mmhg, 1e-9) << percent;
        before = behind;
    }
    EXPECT_LT(before, 30);
}

TEST(Pressure, BeyondAPlugIsThatOfCollaterals) {
    Obstruction plug = spasm(0);
    plug.passes = 0;
    const BloodFlow flow = blood_flow(test::small_abdomen()).obstructed({&plug, 1});
    EXPECT_EQ(pressure_at(flow, {45, 0, 50}), collateral_pressure);
    EXPECT_EQ(pressure_at(flow, {12, 0, 50}), 93);
}

TEST(Pressure, ABeatHasTheExtremesAndTheMeanThatAreAskedFor) {
    const FlowSpec spec;
    EXPECT_EQ(mean_pressure(spec), 93);
    const Beat beat = beat_of(spec, 93);
    EXPECT_DOUBLE_EQ(beat.systolic, 120);
    EXPECT_DOUBLE_EQ(beat.diastolic, 80);
    double sum = 0, wave = 0, steepest = 0;
    for (const double p : beat.at) sum += p;
    EXPECT_NEAR(sum / Beat::samples, 93, 0.02);
    for (int k = 0; k < 100000; ++k) {
        wave += pressure_wave(k / 1e5);
        steepest = std::max(steepest, std::abs(pressure_wave((k + 1) / 1e5) - pressure_wave(k / 1e5)));
    }
    EXPECT_NEAR(wave / 1e5, 0.325, 1e-6);
    EXPECT_LT(steepest, 1e-4);  // no jump
    const Beat lower = beat_of(spec, 46.5);
    EXPECT_DOUBLE_EQ(lower.systolic, 60);
    EXPECT_DOUBLE_EQ(lower.diastolic, 40);
    EXPECT_NEAR(beat.pressure(0.27), 80, 1e-9);
    EXPECT_NEAR(beat.pressure(1.52), 120, 1e-9);
}

TEST(Pressure, AGapResistsAsAnAnnulusAndSealsWhenItIsClosed) {
    // A thin gap is a slit: 12 μ l / (2 π r g³).
    const double slit = 12 * 3.5e-3 * 0.01 / (2 * pi * 0.975e-3 * std::pow(0.05e-3, 3)) * 1e-6;
    EXPECT_NEAR(gap_resistance(1, 0.95), slit, 0.01 * slit);
    EXPECT_TRUE(std::isinf(gap_resistance(1, 0.98)));
    EXPECT_TRUE(std::isinf(gap_resistance(1, 1.2)));
    EXPECT_EQ(gap_resistance(1, 0), 0);
}

TEST(Pressure, AWedgedEndLosesItsPulseAndItsMean) {
    const Beat free = beat_of({}, 93);
    double last_mean = 93.001, last_pulse = 40.001;
    for (const double device : {0.1, 0.5, 0.7, 0.8, 0.9, 0.95, 0.97}) {
        const Beat at = wedged(free, 1.0, gap_resistance(1, device));
        const double pulse = at.systolic - at.diastolic;
        EXPECT_LT(at.mean, last_mean) << device;
        EXPECT_LT(pulse, last_pulse) << device;
        last_mean = at.mean;
        last_pulse = pulse;
    }
    const Beat sealed = wedged(free, 1.0, gap_resistance(1, 0.99));
    EXPECT_EQ(sealed.mean, collateral_pressure);
    EXPECT_EQ(sealed.systolic, sealed.diastolic);
    // Half of the difference where gap and bed resist alike.
    const Beat half = wedged(free, 1.0, 93 * pascal_per_mmhg);
    EXPECT_NEAR(half.mean, 0.5 * (93 + collateral_pressure), 1e-9);
    EXPECT_NEAR(half.systolic - half.diastolic, 20, 1e-9);
    EXPECT_EQ(wedged(free, 0, gap_resistance(1, 0.99)).at, free.at);
    const Beat low = beat_of({}, 10);
    EXPECT_EQ(wedged(low, 1.0, gap_resistance(1, 0.99)).mean, 10);
}

TEST(Pressure, ABoreDampsAsALowPassOfFirstOrder) {
    Beat sine;
    for (int k = 0; k < Beat::samples; ++k)
        sine.at[static_cast<std::size_t>(k)] = 90 + 10 * std::sin(2 * pi * k / Beat::samples);
    sine.mean = 90;
    for (const double tau : {0.01, 0.1, 1.0, 10.0}) {
        const Beat out = damped(sine, tau / line_compliance, 60);
        const double expected = 10 / std::sqrt(1 + std::pow(2 * pi * tau, 2));
        EXPECT_NEAR(0.5 * (out.systolic - out.diastolic), expected, 2e-3 * expected) << tau;
        EXPECT_EQ(out.mean, 90);
        EXPECT_NEAR(0.5 * (out.systolic + out.diastolic), 90, 0.01);
    }
    EXPECT_EQ(damped(sine, 0, 60).at, sine.at);
    const Beat flat = damped(sine, 1e12, 60);
    EXPECT_EQ(flat.systolic, 90);
    EXPECT_EQ(flat.diastolic, 90);
}

TEST(Pressure, TheElectrocardiogramHasItsWavesBeforeThePressureRises) {
    for (const double rate : {40.0, 70.0, 150.0}) {
        const double r = 0.27 - 0.08 * rate / 60;
        EXPECT_NEAR(ecg(r, rate), 1, 0.02);  // Q and S reach into it
        for (int k = 0; k < 1000; ++k) EXPECT_LE(ecg(k / 1e3, rate), 1.01);
        EXPECT_GT(ecg(r - 1.0 / 6, rate), 0.2);  // P
        EXPECT_LT(ecg(r - 1.0 / 24 - 0.01, rate), 0);
        EXPECT_LT(ecg(r + 1.0 / 24, rate), 0);
        EXPECT_GT(ecg(r + 0.25, rate), 0.3);  // T
        EXPECT_NEAR(ecg(r + 0.6, rate), 0, 0.01);
        EXPECT_DOUBLE_EQ(ecg(r + 1, rate), ecg(r, rate));
    }
    EXPECT_NEAR(heart_phase(60.0 / 70 * 3.25, 70), 0.25, 1e-9);
}

TEST(Pressure, ASpecWithoutAPulseOrOutOfRangeIsRefused) {
    FlowSpec spec;
    spec.systolic = spec.diastolic = 80;
    EXPECT_EQ(problems(spec).size(), 1u);
    spec.systolic = std::nan("");
    EXPECT_GE(problems(spec).size(), 1u);
    spec = {};
    EXPECT_TRUE(problems(spec).empty());
}

TEST(Pressure, RandomTreesAndObstructionsHaveAPressureThatFallsAlongTheFlow) {
    for (unsigned seed = 1; seed <= 200; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        anatomy::Anatomy vessel = test::small_abdomen();
        const int more = 1 + static_cast<int>(4 * unit());
        for (int k = 0; k < more; ++k) {
            const double x = 10 + 35 * unit();
            const Vec3 to(x + 5, 0, 55 + 40 * unit());
            const double radius = 0.4 + 1.6 * unit();
            test::add_branch(vessel, "b" + std::to_string(k), 1, {x, 0, 50}, to, radius);
            test::add_end(vessel, "b" + std::to_string(k) + ".out", to, {0, 0, 1}, radius);
        }
        for (geometry::CentrelineBranch& branch : vessel.branches) {
            const double from = unit(), to = from + 0.5 * unit(), by = unit();
            for (std::size_t k = 0; k < branch.radii.size(); ++k) {
                const double at = static_cast<double>(k) / static_cast<double>(branch.radii.size());
                if (at > from && at < to) branch.radii[k] *= std::max(0.05, by);
            }
        }
        const BloodFlow open = blood_flow(vessel);
        std::vector<Obstruction> all;
        for (int k = static_cast<int>(4 * unit()); k > 0; --k) {
            const int branch = static_cast<int>(unit() * static_cast<double>(vessel.branches.size()));
            const geometry::Polyline& line = vessel.branches[static_cast<std::size_t>(branch)].points;
            const Vec3 at = line[static_cast<std::size_t>(unit() * static_cast<double>(line.size()))];
            const double r = std::max(0.02, unit());
            const double passes = unit() < 0.2 ? 0 : unit() < 0.3 ? unit() : 1;
            all.push_back({branch, at, at, laminar_loss(10, r, 1), expansion_loss(r, 1), passes});
        }
        const BloodFlow flow = open.obstructed(all);
        for (int i = 0; i < static_cast<int>(flow.cells.size()); ++i) {
            const double p = mean_pressure_in(flow, i);
            ASSERT_TRUE(std::isfinite(p)) << i;
            ASSERT_GT(p, 0) << i;
            ASSERT_LE(p, 93) << i;
            const int up = flow.cells[static_cast<std::size_t>(i)].upstream;
            if (up >= 0 &&
                flow.tree[static_cast<std::size_t>(up)] == flow.tree[static_cast<std::size_t>(i)]) {
                ASSERT_LE(p, mean_pressure_in(flow, up) * (1 + 1e-12)) << i;
            }
            const Beat beat = damped(wedged(beat_of({}, p), unit() * 3, gap_resistance(1, unit())),
                                     std::exp(30 * unit() - 10), 20 + 200 * unit());
            ASSERT_TRUE(std::ranges::all_of(beat.at, [](double v) { return std::isfinite(v) && v > 0; }));
            ASSERT_LE(beat.diastolic, beat.mean * (1 + 1e-9));
            ASSERT_GE(beat.systolic, beat.mean * (1 - 1e-9));
        }
    }
}

}  // namespace
}  // namespace blood
