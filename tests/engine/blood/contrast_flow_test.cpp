#include "engine/blood/contrast_flow.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "tests/engine/fixtures.h"
#include "tests/engine/vessels.h"

namespace blood {
namespace {

using namespace test;

using geometry::Vec3;

constexpr double frame = 1.0 / 15;

FlowSpec steady(double inflow, double dispersion = 0) {
    FlowSpec spec;
    spec.inflow = inflow;
    spec.pulsatility = 0;
    spec.dispersion = dispersion;
    return spec;
}

void expect_balanced(const ContrastFlow& flow) {
    const IodineBalance at = flow.balance();
    EXPECT_NEAR(at.in_lines + at.in_vessels + at.in_organs + at.drained + at.leaked, at.injected,
                1e-10 * std::max(1.0, at.injected));
}

float iodine_at(const ContrastFlow& flow, const Vec3& x) {
    return flow.iodine()[static_cast<std::size_t>(flow.blood().nearest(x))];
}

/// The place of the first kidney's outlet.
std::size_t kidney_of(const ContrastFlow& flow) {
    const auto& outlets = flow.blood().outlets;
    return static_cast<std::size_t>(
        std::distance(outlets.begin(), std::ranges::find(outlets, "kidney", &Outlet::organ)));
}

TEST(ContrastFlow, MixesWithTheBloodThatPasses) {
    ContrastFlow flow(straight_vessel(200, 5), steady(20));
    flow.inject({Vec3(0, 0, -20), 5, 50, 300});
    for (int f = 0; f < 60; ++f) flow.step(frame);
    EXPECT_NEAR(iodine_at(flow, {0, 0, -100}), 300.0 * 5 / (20 + 5), 0.1);
    EXPECT_EQ(iodine_at(flow, {0, 0, -15}), 0);
    EXPECT_NEAR(flow.injected(), 20, 1e-9);
    expect_balanced(flow);
}

TEST(ContrastFlow, VeinsFillAfterTheOrganAndLoseNothing) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    const std::size_t kidney = kidney_of(flow);
    constexpr std::size_t bins = DistalArteries::bins;
    flow.inject({Vec3(0, 0, 90), 10, 10, 300});
    double artery = 0, first_vein = 0, last_vein = 0, held = 0, before = 0;
    int artery_peak = 0, first_peak = 0, last_peak = 0;
    const auto peak = [](double value, int f, double& most, int& at) {
        if (value > most) most = value, at = f;
    };
    for (int f = 0; f < 900; ++f) {
        flow.step(frame);
        peak(flow.distal_iodine()[kidney * bins], f, artery, artery_peak);
        peak(flow.venous_iodine()[kidney * bins], f, first_vein, first_peak);
        peak(flow.venous_iodine()[kidney * bins + bins - 1], f, last_vein, last_peak);
        const IodineBalance at = flow.balance();
        EXPECT_GE(at.in_veins, 0);
        EXPECT_LE(at.in_veins, at.drained + 1e-9);
        // What has passed the veins never comes back.
        EXPECT_GE(at.drained - at.in_veins, before - 1e-9);
        before = at.drained - at.in_veins;
        held = std::max(held, at.in_veins);
        expect_balanced(flow);
    }
    EXPECT_GT(held, 100);
    EXPECT_LT(last_vein, artery);
    EXPECT_GT(last_vein, 0.02 * artery);
    EXPECT_GT(first_peak, artery_peak + 1 / frame);
    EXPECT_NEAR((last_peak - first_peak) * frame, flow.blood().outlets[kidney].venous * (bins - 1.0) / bins,
                0.3);
    EXPECT_LT(flow.balance().in_veins, 0.1 * held);
    flow.reset();
    EXPECT_EQ(flow.balance().in_veins, 0);
}

TEST(ContrastFlow, APlugEndsTheContrastWhereItBeginsAndIsForgotten) {
    const anatomy::Anatomy abdomen = small_abdomen();
    ContrastFlow flow(abdomen, steady(40, 0.7)), free(abdomen, steady(40, 0.7));
    Obstruction plug;
    plug.branch = 1;
    plug.from = plug.middle = {30, 0, 50};
    plug.passes = 0;
    flow.obstruct({&plug, 1});
    for (ContrastFlow* each : {&flow, &free}) {
        each->inject({Vec3(0, 0, 90), 10, 20, 300});
        for (int f = 0; f < 30; ++f) each->step(frame);
    }
    EXPECT_GT(iodine_at(flow, {15, 0, 50}), 20);
    EXPECT_GT(iodine_at(free, {45, 0, 50}), 20);
    EXPECT_EQ(iodine_at(flow, {45, 0, 50}), 0);
    EXPECT_EQ(flow.blush()[kidney_of(flow)].iodine, 0);
    expect_balanced(flow);
    // The others have what they had.
    for (std::size_t o = 0; o < flow.blood().outlets.size(); ++o)
        if (o != kidney_of(flow)) {
            EXPECT_DOUBLE_EQ(flow.blood().outlets[o].flow, free.blood().outlets[o].flow);
        }
    flow.obstruct({});
    for (std::size_t o = 0; o < flow.blood().outlets.size(); ++o)
        EXPECT_EQ(flow.blood().outlets[o].flow, free.blood().outlets[o].flow);
    for (int f = 0; f < 300; ++f) flow.step(frame);
    expect_balanced(flow);
}

TEST(BloodFlow, ANarrowPlaceTakesWhatPoiseuilleAndTheJetTake) {
    const BloodFlow free = blood_flow(small_abdomen(), steady(40));
    Obstruction narrow;
    narrow.branch = 1;
    narrow.from = narrow.middle = {30, 0, 50};
    narrow.laminar = 500;
    narrow.turbulent = 300;
    const BloodFlow flow = free.obstructed({&narrow, 1});
    const auto kidney = std::ranges::find(free.outlets, "kidney", &Outlet::organ);
    const double before = kidney->flow,
                 now = flow.outlets[static_cast<std::size_t>(kidney - free.outlets.begin())].flow;
    EXPECT_LT(now, before);
    const double pressure = 93 * 133.322;
    EXPECT_NEAR(now * pressure / before + 500 * now + 300 * now * now, pressure, 1e-6);
}

TEST(ContrastFlow, LeaksThroughAHoleWhatFlowsThereAndKeepsTheBalance) {
    // Bernoulli's speed at 93 mmHg, 4.84 m/s, times 0.6 of a sharp edge and a quarter of the section.
    EXPECT_NEAR(leak_rate(0.889, 93), 0.6 * 0.25 * 0.6207 * 4.837, 0.002);
    EXPECT_NEAR(leak_rate(2 * 0.889, 93), 4 * leak_rate(0.889, 93), 1e-12);
    ContrastFlow flow(straight_vessel(200, 5), steady(20)), whole(straight_vessel(200, 5), steady(20));
    flow.pierce({0, 0, -100}, {1, 0, 0}, 0.889);
    flow.pierce({0.2, 0, -100}, {1, 0, 0}, 0.889);  // the same hole
    ASSERT_EQ(flow.holes().size(), 1u);
    for (ContrastFlow* each : {&flow, &whole}) each->inject({Vec3(0, 0, -20), 5, 50, 300});
    for (int f = 0; f < 120; ++f) {
        flow.step(frame);
        whole.step(frame);
        expect_balanced(flow);
    }
    const Hole& hole = flow.holes()[0];
    EXPECT_NEAR(hole.blood, 8 * leak_rate(0.889, 93), 1e-9);
    // Steady since the bolus has come: blood of 60 mg/ml, from about 4 s on.
    const double before = hole.iodine;
    flow.step(frame);
    EXPECT_NEAR(hole.iodine - before, leak_rate(0.889, 93) * frame * 60, 1e-3 * before);
    EXPECT_GT(hole.iodine, 2 * leak_rate(0.889, 93) * 60);
    EXPECT_NEAR(iodine_at(flow, {0, 0, -150}), iodine_at(whole, {0, 0, -150}), 0.5);
    // What has leaked stays; a hole takes no more than half of what flows.
    for (int f = 0; f < 600; ++f) flow.step(frame);
    EXPECT_GE(flow.balance().leaked, before);
    expect_balanced(flow);
    ContrastFlow small(straight_vessel(50, 2), steady(0.4));
    small.pierce({0, 0, -25}, {1, 0, 0}, 5);
    small.inject({Vec3(0, 0, -5), 0.5, 2, 300});
    for (int f = 0; f < 300; ++f) small.step(frame);
    EXPECT_NEAR(small.holes()[0].blood, 20 * 0.2, 1e-9);
    EXPECT_GT(small.balance().leaked, 0.1 * small.balance().injected);
    expect_balanced(small);
    for (const float c : small.iodine()) EXPECT_GE(c, 0);
    small.reset();
    EXPECT_TRUE(small.holes().empty());
}

TEST(ContrastFlow, ArrivesAfterTheVolumeOnTheWayOverTheFlow) {
    const double rate = 2, inflow = 10;
    ContrastFlow flow(straight_vessel(300, 4), steady(inflow));
    const auto place = [&](double z) { return flow.blood().cells[flow.blood().nearest({0, 0, z})]; };
    flow.inject({Vec3(0, 0, -30), rate, 100, 350});
    const FlowCell from = place(-30), to = place(-270);
    const double area = std::numbers::pi * 16 / 1000, way = from.centre.z() - to.centre.z();
    const double transit = way * area / (inflow + rate), cell = to.volume / (inflow + rate);
    const double full = 350 * rate / (inflow + rate);
    double before = 0, time = 0;
    while (iodine_at(flow, to.centre) < 0.5 * full && time < 10) {
        before = iodine_at(flow, to.centre);
        flow.step(0.002);
        time += 0.002;
    }
    EXPECT_LT(before, 0.5 * full);
    EXPECT_NEAR(time, transit, cell + 0.002);
    // The front is a few cells long after 160 of them.
    while (iodine_at(flow, to.centre) < 0.9 * full) {
        flow.step(0.002);
        time += 0.002;
    }
    EXPECT_LT(time, transit + 6 * cell);
}

// Through a bore of 1 ml the saline that it is full of comes first, then contrast, and what stays behind is
// flushed into the vessel a second after the injection has ended.
TEST(ContrastFlow, ComesOutOfALineAfterItsSaline) {
    ContrastFlow line(straight_vessel(200, 5), steady(20)), direct(straight_vessel(200, 5), steady(20));
    const Vec3 end(0, 0, -20);
    line.inject({end, 2, 4, 300, Line{3, 1.0, 0.5}});
    direct.inject({end, 2, 4, 300});
    line.step(0.2);
    direct.step(0.2);
    EXPECT_EQ(iodine_at(line, end), 0);
    EXPECT_GT(iodine_at(direct, end), 5);
    EXPECT_EQ(line.injected(), direct.injected());
    const std::vector<float> filling = line.in_line(3, 20);
    ASSERT_EQ(filling.size(), 20u);
    EXPECT_GT(filling.front(), 250);
    EXPECT_EQ(filling.back(), 0);
    EXPECT_TRUE(line.in_line(2, 20).empty());
    expect_balanced(line);
    line.step(1.8);
    EXPECT_FALSE(line.injecting());
    EXPECT_GT(line.balance().in_lines, 0.7 * 300);
    EXPECT_GT(line.in_line(3, 20).back(), 0.7 * 300);
    line.step(0.9);
    EXPECT_EQ(line.out_of_line(3).flow, 0);
    line.lead(3, {0, 0, -100}, 1.0);  // drawn back, then flushed there
    line.step(0.5);
    EXPECT_NEAR(line.out_of_line(3).flow, 0.5, 1e-12);
    EXPECT_GT(iodine_at(line, {0, 0, -101}), 1);
    for (int f = 0; f < 200; ++f) line.step(frame);
    EXPECT_EQ(line.out_of_line(3).flow, 0);
    EXPECT_LT(line.balance().in_lines, 0.2 * 300);
    expect_balanced(line);
    line.reset();
    EXPECT_TRUE(line.in_line(3, 20).empty());
}

TEST(ContrastFlow, SpreadsAsDispersionSays) {
    // A short pulse in a long vessel: its variance grows by 2·D/v³ per length, D = dispersion·r·v.
    const double radius = 4, inflow = 10, dispersion = 0.7;
    ContrastFlow flow(straight_vessel(900, radius), steady(inflow, dispersion));
    flow.inject({Vec3(0, 0, -100), 1e-3, 1e-5, 400});
    const double speed = inflow * 1000 / (std::numbers::pi * radius * radius), duration = 2.0;
    for (int k = 0; k < 200; ++k) flow.step(duration / 200);
    double mass = 0, mean = 0, variance = 0;
    for (std::size_t i = 0; i < flow.nodes().size(); ++i) {
        const double here = flow.iodine()[i] * flow.blood().cells[i].volume;
        mass += here, mean += here * flow.nodes()[i].z();
    }
    mean /= mass;
    for (std::size_t i = 0; i < flow.nodes().size(); ++i)
        variance +=
            flow.iodine()[i] * flow.blood().cells[i].volume / mass * std::pow(flow.nodes()[i].z() - mean, 2);
    EXPECT_NEAR(-mean, 100 + speed * duration, 4);
    EXPECT_NEAR(variance, 2 * dispersion * radius * speed * duration, 0.03 * variance);
}

TEST(ContrastFlow, SplitsAtAJunctionAsTheFlowDoes) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    flow.inject({std::string("trunk"), 10, 100, 300});
    for (int f = 0; f < 60; ++f) flow.step(frame);
    // The same concentration everywhere downstream, so that iodine leaves as blood does.
    const float mixed = 300.0f * 10 / 50;
    EXPECT_NEAR(iodine_at(flow, {45, 0, 50}), mixed, 0.5);
    EXPECT_NEAR(iodine_at(flow, {0, -45, 70}), mixed, 0.5);
    EXPECT_NEAR(iodine_at(flow, {0, 0, 5}), mixed, 0.5);
    EXPECT_EQ(flow.blush().size(), 3u);
    expect_balanced(flow);
}

TEST(ContrastFlow, IntoABranchStaysInItUnlessItIsMoreThanTheBranchTakes) {
    ContrastFlow flow(small_abdomen(), steady(40));
    const auto outlet = [&](const std::string& branch) -> const Outlet& {
        return *std::ranges::find(flow.blood().outlets, branch, &Outlet::branch);
    };
    const double renal = outlet("LRA").flow;
    flow.inject({std::string("LRA"), 0.5 * renal, 20, 300});
    for (int f = 0; f < 30; ++f) flow.step(frame);
    EXPECT_GT(iodine_at(flow, {45, 0, 50}), 100);
    EXPECT_EQ(iodine_at(flow, {0, 0, 30}), 0);

    flow.reset();
    const double rate = 3 * renal;
    flow.inject({std::string("LRA"), rate, 100, 300});
    for (int f = 0; f < 45; ++f) flow.step(frame);
    // Undiluted in the branch; what runs back mixes with the aorta's blood and goes on down, not up.
    EXPECT_NEAR(iodine_at(flow, {45, 0, 50}), 300, 1);
    const double taken = renal * (40 + rate) / 40, back = rate - taken;
    const double passing = 40.0 + rate - taken - outlet("SMA").fraction * (40 + rate);
    EXPECT_GT(back, 1);
    EXPECT_NEAR(iodine_at(flow, {0, 0, 10}), 300 * back / passing, 1);
    EXPECT_EQ(iodine_at(flow, {0, 0, 60}), 0);
    EXPECT_EQ(iodine_at(flow, {0, -45, 70}), 0);
    expect_balanced(flow);
}

TEST(ContrastFlow, RunsBackAsFarAsTheBranchesThatTakeIt) {
    // 34 ml/s enter, of which the aorta's end takes 72 %: 5 ml/s run up to the renal artery, which asks for
    // more.
    ContrastFlow flow(small_abdomen(), steady(4));
    flow.inject({Vec3(0, 0, 20), 30, 120, 300});
    for (int f = 0; f < 58; ++f) flow.step(frame);
    EXPECT_NEAR(iodine_at(flow, {0, 0, 40}), 300, 1);
    EXPECT_GT(iodine_at(flow, {40, 0, 50}), 150);
    EXPECT_LT(iodine_at(flow, {40, 0, 50}), 290);
    EXPECT_EQ(iodine_at(flow, {0, 0, 60}), 0);
    EXPECT_EQ(iodine_at(flow, {0, -30, 70}), 0);
    expect_balanced(flow);
}

TEST(ContrastFlow, SpreadsUpItsVesselButNotOutOfItsMouth) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    flow.inject({std::string("LRA"), 3, 6, 300});
    double mouth = 0;
    for (int f = 0; f < 30; ++f) {
        flow.step(frame);
        mouth = std::max<double>(mouth, iodine_at(flow, {10, 0, 50}));
        EXPECT_EQ(iodine_at(flow, {0, 0, 40}), 0);
    }
    EXPECT_GT(mouth, 1);
}

TEST(ContrastFlow, WashesOut) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    flow.inject({std::string("trunk"), 20, 10, 300});
    double volume = 0;
    for (const FlowCell& cell : flow.blood().cells) volume += cell.volume;
    double peak = 0;
    for (double time = 0; time < 0.5; time += frame) {
        flow.step(frame);
        peak = std::max(peak, flow.balance().in_vessels);
    }
    // Slowest to clear are the narrow branches: ten times as long as the whole tree takes on average.
    for (double time = 0; time < 10 * volume / 40; time += frame) flow.step(frame);
    EXPECT_GT(peak, 500);
    EXPECT_LT(flow.balance().in_vessels, 0.01 * peak);
    for (int f = 0; f < 6000; ++f) flow.step(frame);
    EXPECT_EQ(flow.balance().in_vessels, 0);
    for (int f = 0; f < 30000; ++f) flow.step(frame);  // what kidneys filter takes minutes
    EXPECT_NEAR(flow.balance().drained, flow.balance().injected, 1e-6);
    expect_balanced(flow);
}

TEST(ContrastFlow, KeepsIodineThroughPulsesAndSeveralInjections) {
    ContrastFlow flow(small_abdomen());
    for (int f = 0; f < 150; ++f) {
        if (f % 20 == 0) flow.inject({std::string("LRA"), 7, 3.3, 320});
        if (f == 30) flow.inject({std::string("trunk"), 20, 31, 370});
        if (f == 33) flow.inject({Vec3(0, 0, 20), 40, 17, 150});
        flow.step(frame);
        expect_balanced(flow);
        for (const float c : flow.iodine()) {
            ASSERT_GE(c, 0);
            ASSERT_LE(c, 370);
        }
    }
    EXPECT_NEAR(flow.injected(), 8 * 3.3 + 31 + 17, 1e-9);
    EXPECT_FALSE(flow.injecting());
}

TEST(ContrastFlow, PulsesDeliverTheMeanFlow) {
    FlowSpec spec = steady(20);
    spec.pulsatility = 1;
    spec.heart_rate = 60;
    ContrastFlow pulsing(straight_vessel(4000, 5), spec), even(straight_vessel(4000, 5), steady(20));
    for (ContrastFlow* flow : {&pulsing, &even}) {
        flow->inject({Vec3(0, 0, -10), 0.001, 0.0001, 400});
        for (int f = 0; f < 150; ++f) flow->step(frame);
    }
    const auto middle = [](const ContrastFlow& flow) {
        const auto c = flow.iodine();
        return flow.nodes()[static_cast<std::size_t>(std::max_element(c.begin(), c.end()) - c.begin())].z();
    };
    EXPECT_NEAR(middle(pulsing), middle(even), 0.02 * 2546);
}

TEST(ContrastFlow, IsTheSameAtAnyFrameRate) {
    std::vector<std::vector<float>> after;
    for (const double rate : {7.5, 15.0, 30.0}) {
        ContrastFlow flow(small_abdomen());
        flow.inject({std::string("trunk"), 10, 15, 300});
        for (int f = 0; f < 2 * rate; ++f) flow.step(1 / rate);
        after.emplace_back(flow.iodine().begin(), flow.iodine().end());
    }
    const float most = *std::max_element(after[1].begin(), after[1].end());
    EXPECT_GT(most, 10);
    for (std::size_t i = 0; i < after[1].size(); ++i) {
        EXPECT_NEAR(after[0][i], after[1][i], 0.01 * most);
        EXPECT_NEAR(after[2][i], after[1][i], 0.01 * most);
    }
}

TEST(ContrastFlow, OrgansBlushAfterTheirArteries) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    const auto& outlets = flow.blood().outlets;
    const std::size_t kidney = kidney_of(flow);
    flow.inject({std::string("LRA"), 3, 6, 300});
    double artery = 0, organ = 0, artery_at = 0, organ_at = 0;
    for (int f = 1; f <= 600; ++f) {
        flow.step(frame);
        const double now = iodine_at(flow, {45, 0, 50}), blush = flow.blush()[kidney].concentration;
        if (now > artery) artery = now, artery_at = f * frame;
        if (blush > organ) organ = blush, organ_at = f * frame;
    }
    EXPECT_GT(organ, 1);
    EXPECT_GT(organ_at, artery_at + 0.1);
    EXPECT_LT(organ_at, artery_at + outlets[kidney].transit + 2);
    // What was filtered stays for minutes: the nephrogram.
    EXPECT_GT(flow.blush()[kidney].concentration, 0.1 * organ);
    EXPECT_LT(flow.blush()[kidney].concentration, 0.4 * organ);
    EXPECT_EQ(flow.blush()[kidney].concentration, flow.blush()[kidney].iodine / outlets[kidney].tissue);
    for (int f = 0; f < 15 * 600; ++f) flow.step(frame);
    EXPECT_LT(flow.blush()[kidney].concentration, 0.01 * organ);
    expect_balanced(flow);
}

TEST(ContrastFlow, LiesAtTheBackOfWideVesselsInSlowBlood) {
    const auto most_back = [](double radius, double inflow, const geometry::Vec3& at) {
        ContrastFlow flow(straight_vessel(300, radius), steady(inflow));
        EXPECT_TRUE(flow.streams().empty());
        flow.inject({at, 2, 6, 300});
        for (int f = 0; f < 45; ++f) flow.step(frame);
        const std::vector<Eigen::Vector3f> streams = flow.streams();
        EXPECT_TRUE(streams.empty() || streams.size() == flow.nodes().size());
        float back = 0;
        for (const Eigen::Vector3f& s : streams) {
            EXPECT_TRUE(s.allFinite());
            EXPECT_LE(s.norm(), 1.0f + 1e-5f);
            EXPECT_NEAR(s.z(), 0, 1e-5f);  // along the vessel
            back = std::max(back, s.y());
        }
        return back;
    };
    const Vec3 middle(0, 0, -21);
    const float slow = most_back(9, 10, middle), fast = most_back(9, 80, middle);
    EXPECT_GT(slow, 0.8f);
    EXPECT_LT(fast, 0.5f * slow);
    EXPECT_EQ(most_back(2.9, 1, middle), 0.0f);
}

TEST(ContrastFlow, StaysOnTheSideOfTheCathetersTip) {
    ContrastFlow flow(straight_vessel(300, 5), steady(60));
    flow.inject({Vec3(4, 0, -20), 5, 40, 300});
    for (int f = 0; f < 30; ++f) flow.step(frame);
    const auto streams = flow.streams();
    ASSERT_FALSE(streams.empty());
    const auto aside = [&](double z) {
        return streams[static_cast<std::size_t>(flow.blood().nearest({0, 0, z}))].x();
    };
    EXPECT_GT(aside(-22), 0.5f);
    // 8 diameters on, a factor e less.
    EXPECT_NEAR(aside(-122) / aside(-42), std::exp(-1.0), 0.02);
    // A snapshot knows the side; a reset forgets it.
    const std::vector<std::byte> state = geometry::state_of(flow);
    flow.reset();
    EXPECT_TRUE(flow.streams().empty());
    geometry::restore_state(flow, state);
    EXPECT_EQ(flow.streams(), streams);
    // An injection into a branch fills it evenly.
    flow.reset();
    flow.inject({std::string("vessel"), 5, 40, 300});
    for (int f = 0; f < 30; ++f) flow.step(frame);
    for (const Eigen::Vector3f& s : flow.streams()) EXPECT_NEAR(s.x(), 0, 1e-6f);
}

TEST(ContrastFlow, KidneysShowTheirCortexBeforeTheirMedulla) {
    ContrastFlow flow(small_abdomen(), steady(40, 0.7));
    const auto& outlets = flow.blood().outlets;
    const std::size_t kidney = kidney_of(flow);
    for (const Outlet& outlet : outlets) EXPECT_EQ(outlet.inner.fraction > 0, outlet.organ == "kidney");
    flow.inject({std::string("LRA"), 3, 6, 300});
    constexpr double cortex_fraction = 0.7;  // of the tissue
    double cortex_most = 0, cortex_at = 0, medulla_most = 0, medulla_at = 0;
    for (int f = 1; f <= 15 * 120; ++f) {
        flow.step(frame);
        const Blush& blush = flow.blush()[kidney];
        ASSERT_GE(blush.inner, 0);
        ASSERT_GE(blush.iodine, blush.inner);
        const double cortex = (blush.iodine - blush.inner) / cortex_fraction,
                     medulla = blush.inner / (1 - cortex_fraction);
        if (cortex > cortex_most) cortex_most = cortex, cortex_at = f * frame;
        if (f * frame < 20 && medulla > medulla_most) medulla_most = medulla, medulla_at = f * frame;
        // The nephrographic phase of a CT.
        if (f == 15 * 100) {
            EXPECT_GT(medulla, 0.7 * cortex);
        }
        expect_balanced(flow);
    }
    EXPECT_GT(cortex_at, 1.5);
    EXPECT_LT(cortex_at, 4);
    EXPECT_GT(medulla_at, cortex_at + 3);
    EXPECT_LT(medulla_most, 0.4 * cortex_most);
    // Snapshots hold what is in the kidneys, and leave none behind.
    const std::vector<std::byte> full = geometry::state_of(flow);
    flow.reset();
    const std::vector<std::byte> empty = geometry::state_of(flow);
    geometry::restore_state(flow, full);
    EXPECT_EQ(geometry::state_of(flow), full);
    geometry::restore_state(flow, empty);
    EXPECT_EQ(geometry::state_of(flow), empty);
}

TEST(ContrastFlow, StandsStillWhereNoBloodFlows) {
    ContrastFlow flow(straight_vessel(100, 4), steady(0));
    flow.inject({Vec3(0, 0, -50), 2, 2, 300});
    for (int f = 0; f < 30; ++f) flow.step(frame);
    const double held = flow.balance().in_vessels;
    EXPECT_NEAR(held, 600, 0.01);  // 2 ml of the 2.5 below
    for (int f = 0; f < 30; ++f) flow.step(frame);
    EXPECT_EQ(flow.balance().in_vessels, held);

    anatomy::Anatomy blind = straight_vessel(100, 4);
    blind.ends.clear();
    ContrastFlow closed(blind, {});
    closed.inject({std::string("vessel"), 2, 4, 300});
    for (int f = 0; f < 60; ++f) closed.step(frame);
    EXPECT_NEAR(closed.injected(), 4, 1e-9);
    // All can only leave by where blood would come in.
    EXPECT_GT(closed.balance().drained, 600);
    for (const float c : closed.iodine()) EXPECT_LE(c, 300.001f);
    expect_balanced(closed);
}

TEST(ContrastFlow, ResetsToTheSameBits) {
    ContrastFlow flow(small_abdomen());
    const auto run = [&] {
        flow.inject({std::string("LRA"), 7, 3.3, 320});
        std::vector<float> seen;
        for (int f = 0; f < 40; ++f) {
            if (f == 10) flow.inject({Vec3(0, 0, 90), 20, 5, 300});
            flow.step(frame);
            seen.insert(seen.end(), flow.iodine().begin(), flow.iodine().end());
            for (const Blush& blush : flow.blush()) seen.push_back(static_cast<float>(blush.iodine));
        }
        return seen;
    };
    const std::vector<float> once = run();
    flow.reset();
    EXPECT_EQ(flow.injected(), 0);
    EXPECT_FALSE(flow.injecting());
    EXPECT_EQ(run(), once);
    ContrastFlow other(small_abdomen());
    std::swap(flow, other);
    EXPECT_EQ(run(), once);
}

TEST(ContrastFlow, RefusesMoreThanTheLimitAndSaysWhatIsLeft) {
    FlowSpec spec;
    spec.limit = 20;
    ContrastFlow flow(small_abdomen(), spec);
    flow.inject({std::string("LRA"), 5, 12.5, 300});
    const std::string said = refusal([&] { flow.inject({std::string("LRA"), 5, 8, 300}); });
    test::expect_said(said, "8 ml");
    test::expect_said(said, "7.5 ml");
    test::expect_said(said, "20 ml");
    EXPECT_DOUBLE_EQ(flow.left(), 7.5);
    for (int f = 0; f < 60; ++f) flow.step(frame);
    EXPECT_NEAR(flow.left(), 7.5, 1e-9);
    flow.inject({std::string("LRA"), 5, 7.5, 300});
    for (int f = 0; f < 60; ++f) flow.step(frame);
    EXPECT_NEAR(flow.injected(), 20, 1e-9);
    EXPECT_EQ(contrast_limit(70, 1.0), 300);
    EXPECT_EQ(contrast_limit(60, 2.0), 150);
}

TEST(ContrastFlow, RefusesInjectionsThatCannotBe) {
    ContrastFlow flow(small_abdomen());
    test::expect_refusal([&] { flow.inject({std::string("RRA"), 5, 5, 300}); }, "LRA");
    EXPECT_FALSE(refusal([&] { flow.inject({std::string("LRA"), 0, 5, 300}); }).empty());
    EXPECT_FALSE(refusal([&] { flow.inject({std::string("LRA"), 5, -1, 300}); }).empty());
    EXPECT_FALSE(refusal([&] { flow.inject({std::string("LRA"), 5, 5, std::nan("")}); }).empty());
    EXPECT_FALSE(refusal([&] { flow.inject({Vec3(0, std::nan(""), 0), 5, 5, 300}); }).empty());
    flow.step(frame);
    EXPECT_EQ(flow.injected(), 0);
}

}  // namespace
}  // namespace blood
