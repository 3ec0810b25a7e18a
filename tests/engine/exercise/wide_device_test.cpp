/// Guide catheters and sheaths, and wires as thick: the smooth wall is as deep as they need.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <random>

#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/exercise/device_rules.h"
#include "engine/exercise/simulation.h"
#include "engine/io/error.h"
#include "engine/scenario/placement.h"
#include "physics/geometry/mesh_query.h"
#include "physics/wall/distance_field.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using geometry::Vec3;
using script::DeviceRole;

/// |g|/C of a wire at rest: the relaxer ends below 1e-8, and all contacts are asked for anew here.
constexpr double rest = 1e-6;

/// A wire of 2.5 mm that is as stiff as a catheter, in the iliac arteries and the aorta.
scenario::Scenario thick_wire() {
    return test::shipped_scenario("renal", {{"guidewire.diameter_mm", "2.5"},
                                            {"guidewire.shaft_rigidity_N_mm2", "4000"},
                                            {"guidewire.tip_rigidity_N_mm2", "100"}});
}

/// The chain's |g|/C on a wall that is asked anew.
double gradient_of(const Simulation& simulation) {
    return physics::relative_gradient(simulation.wire(),
                                      physics::all_contacts(simulation.wire(), simulation.wall()));
}

/// Radius of the outermost device at a joint [mm].
double radius_at(const physics::Chain& wire, const physics::WallContact& contact) {
    return wire.inner_radius() + contact.thickness;
}

}  // namespace

TEST(WideDevices, AThickWireTakesTheDistanceFieldAndEveryWildFrameIsAtRest) {
    Simulation simulation(thick_wire(), test::cache());
    EXPECT_EQ(simulation.scenario().wall_model, scenario::WallModel::DistanceField);
    EXPECT_TRUE(simulation.wall().smooth());
    constexpr unsigned seed = 37007;
    std::mt19937 random(seed);
    const auto unit = [&] { return random() / 4294967296.0; };
    for (int frame = 0; frame < 200; ++frame) {
        const bool in = unit() < (frame / 40 % 2 == 0 ? 0.8 : 0.3);
        const double length = 30 * unit() * unit();
        if (in)
            simulation.apply(script::Advance{length});
        else
            simulation.apply(script::Withdraw{length});
        simulation.apply(script::Rotate{2 * M_PI * (2 * unit() - 1) * unit()});
        simulation.step();
        ASSERT_LE(gradient_of(simulation), rest) << "seed " << seed << ", frame " << frame;
    }
}

TEST(WideDevices, GuideAndSheathArePushedUpTheAortaAtRestAndInside) {
    for (const char* device : {"\"guide8f\"", "\"sheath12f\""}) {
        Simulation simulation(test::shipped_scenario("renal_cobra", {{"catheter.device", device},
                                                                     {"catheter.inserted_mm", "0"},
                                                                     {"wall.friction", "0"}}),
                              test::cache());
        ASSERT_TRUE(simulation.wall().smooth());
        const geometry::MeshQuery mesh(simulation.anatomy().lumen);
        const double start = simulation.inserted();
        constexpr double reach = 330, step = 3;  // past both renal arteries [mm]
        int frame = 0;
        const auto frames_until = [&](DeviceRole held, double goal) {
            for (; simulation.inserted(held) < goal - 1e-6 && frame < 500; ++frame) {
                simulation.apply(script::Advance{std::min(step, goal - simulation.inserted(held)), held});
                const StepReport report = simulation.step();
                ASSERT_LE(gradient_of(simulation), rest) << device << ", frame " << frame;
                ASSERT_FALSE(report.refused) << device << ", frame " << frame;
                const physics::Chain& wire = simulation.wire();
                const auto contacts = physics::all_contacts(wire, simulation.wall());
                for (int i = 1; i <= wire.segments(); ++i) {
                    // Facets lie inside round vessels, and the smooth wall rounds their edges off.
                    constexpr double smoothing = 0.15;
                    const geometry::Vec3 in_vessel = wire.joints[i] - contacts[i].given;
                    ASSERT_TRUE(anatomy::inside(simulation.anatomy(), in_vessel)) << device << " " << i;
                    const double to_wall = mesh.distance(in_vessel);
                    ASSERT_GE(to_wall, radius_at(wire, contacts[i]) -
                                           std::max(contacts[i].pressed_in(), 0.0) - smoothing)
                        << device << ", frame " << frame << ", joint " << i;
                }
            }
        };
        frames_until(DeviceRole::Wire, reach);
        if (HasFatalFailure()) return;
        EXPECT_GT(simulation.inserted(), start);
        frames_until(DeviceRole::Catheter, reach);
        if (HasFatalFailure()) return;
        EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), reach, 1e-6) << device;
    }
}

TEST(WideDevices, ASheathThatNearlyFillsItsVesselBeginsAtRest) {
    for (const char* diameter : {"4.7", "8"}) {  // in vessels of 8.5 mm
        const Simulation simulation(
            test::shipped_scenario("renal_cobra", {{"catheter.device", "\"sheath12f\""},
                                                   {"catheter.outer_diameter_mm", diameter},
                                                   {"wall.friction", "0"}}),
            test::cache());
        EXPECT_LE(gradient_of(simulation), rest) << diameter;
    }
}

TEST(WideDevices, FieldsOfOrdinaryScenariosKeepTheirDepthKeysAndBits) {
    // As deep as before there were deeper ones.
    EXPECT_EQ(physics::DistanceFieldOptions().inner, 1.25);
    for (const auto& file : scenario::shipped_scenarios(test::asset("scenarios"))) {
        const scenario::Scenario s = scenario::load_scenario(file, test::asset("devices"));
        EXPECT_EQ(physics::DistanceField::depth_for(s.thickest_radius()), 1.25) << file;
    }
    const anatomy::Anatomy tube = anatomy::tube_anatomy("tube", {{0, 0, 0}, {8, 0, 0}}, 3, 32, 0.5);
    physics::DistanceFieldOptions options;
    options.inner = 1.25;
    const physics::DistanceField before(tube.lumen, tube.branches, tube.openings(), 20, 0.3, options);
    const std::string key =
        fmt::format("field-{:016x}.bin",
                    physics::DistanceField::fingerprint(tube.lumen, tube.branches, tube.openings(), options));
    const test::TemporaryFolder folder;
    for (const double thickest : {0.0, 1.0, 1.249999}) {
        const auto now = anatomy::cached_distance_field(tube, 20, 0.3, {folder.path(), {}}, thickest);
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << thickest;
        EXPECT_TRUE(std::filesystem::exists(folder / key)) << thickest;
        for (double r = 0; r < 3.5; r += 0.01) {
            const Vec3 x(4.1, r, 0.1);
            physics::WallContact a, b;
            before.contacts({&x, 1}, {&a, 1});
            now->contacts({&x, 1}, {&b, 1});
            ASSERT_EQ(a.penetration, b.penetration) << r;
            ASSERT_EQ(a.normal, b.normal) << r;
            ASSERT_EQ(a.curvature, b.curvature) << r;
            ASSERT_EQ(a.trust, b.trust) << r;
        }
    }
    // Deeper ones have keys of their own, and few of them.
    for (const double thickest : {1.25, 1.35, 1.5})
        static_cast<void>(anatomy::cached_distance_field(tube, 20, 0.3, {folder.path(), {}}, thickest));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(WideDevices, AWireInExchangeIsThinnerThanTheCatheterThatItNeeds) {
    int fit = 0, refused = 0;
    const auto files = scenario::device_files(test::asset("devices"));
    for (const auto& catheter : files) {
        if (scenario::load_device(catheter).kind != scenario::DeviceKind::Catheter) continue;
        const scenario::Scenario s =
            test::small_scenario(test::small_toml_with("device = \"glide035\"", "device = \"floppy014\"") +
                                 "[catheter]\ndevice = \"" + catheter.stem().string() + "\"\n");
        for (const auto& wire : files) {
            try {
                const scenario::Device device =
                    device_of_catalogue(script::DeviceRole::Wire, wire.stem().string(), s);
                EXPECT_LT(0.5 * device.outer_diameter, s.thickest_radius()) << wire;
                ++fit;
            } catch (const io::InputError&) {
                ++refused;
            }
        }
    }
    EXPECT_GT(fit, 100);
    EXPECT_GT(refused, 100);
}

TEST(WideDevices, WhatIsThickerThanTheEntryIsRefused) {
    const auto refused = [](const char* name, const std::vector<scenario::Override>& overrides) {
        return test::refusal([&] { Simulation(test::shipped_scenario(name, overrides), test::cache()); });
    };
    test::expect_said(refused("renal", {{"guidewire.diameter_mm", "9.9"}}),
                      "a wire of diameter 9.9 mm does not enter at 'aorta+LCIA+LEIA+LCFA.out', which is 8.5");
    const std::vector<scenario::Override> wide = {{"catheter.device", "\"sheath12f\""},
                                                  {"catheter.outer_diameter_mm", "9.9"}};
    test::expect_said(
        refused("renal_cobra", wide),
        "a catheter of diameter 9.9 mm does not enter at 'aorta+LCIA+LEIA+LCFA.out', which is 8.5");
    // One that begins outside stops at the entry, and says so.
    auto outside = wide;
    outside.push_back({"catheter.inserted_mm", "0"});
    Simulation simulation(test::shipped_scenario("renal_cobra", outside), test::cache());
    bool too_thick = false;
    for (int frame = 0; frame < 10; ++frame) {
        simulation.apply(script::Advance{3, DeviceRole::Catheter});
        too_thick |= simulation.step().too_thick;
    }
    EXPECT_TRUE(too_thick);
    EXPECT_LT(simulation.inserted(DeviceRole::Catheter), 6);
    EXPECT_TRUE(physics::validate(simulation.wire()).empty());
    test::expect_said(refused("renal", {{"guidewire.diameter_mm", "10.1"}}), "diameter_mm = 10.1");
}

TEST(WideDevices, NoWallOfPlanesIsTakenUnlessTheScenarioAsksForIt) {
    const auto chosen = [](const anatomy::Anatomy& lumen, scenario::WallModel model, double diameter) {
        scenario::Scenario s = test::small_scenario();
        s.tube.reset();
        s.wall_model = model;
        s.wire().device.outer_diameter = diameter;
        static_cast<void>(scenario::choose(s, lumen, scenario::Reach(lumen)));
        return s.wall_model;
    };
    const auto tube = [](double length, double radius) {
        return anatomy::tube_anatomy("tube", {{0, 0, 0}, {length, 0, 0}}, radius, 16, length / 40);
    };
    using scenario::WallModel;
    for (const double diameter : {0.3, 2.4, 2.5, 2.7, 4.0, 8.0, 10.0})
        EXPECT_EQ(chosen(tube(60, 6), WallModel::Auto, diameter), WallModel::DistanceField) << diameter;
    const anatomy::Anatomy narrow = tube(60, 0.2), huge = tube(400'000, 40);
    for (const anatomy::Anatomy* lumen : {&narrow, &huge}) {
        const std::string said = test::refusal([&] { chosen(*lumen, WallModel::Auto, 0.3); });
        test::expect_said(said,
                          lumen == &narrow ? "does not resolve 'tube' of radius 0.2 mm" : " MB, more than ");
        test::expect_said(said, "model = \"mesh\"");
        EXPECT_EQ(chosen(*lumen, WallModel::Mesh, 0.3), WallModel::Mesh);
    }
}

TEST(WideDevices, DeepFieldsKnowTubesToTheirDepthAndTouchNothingWithinTheirTrust) {
    constexpr unsigned seed = 37008;
    std::mt19937 random(seed);
    const auto draw = [&](double least, double most) {
        return std::uniform_real_distribution<double>(least, most)(random);
    };
    for (const double tube_radius : {2.5, 4.5, 9.0}) {
        // Facets lie inside the circle by this much.
        constexpr int around = 96;
        const double sagitta = tube_radius * (1 - std::cos(M_PI / around));
        const anatomy::Anatomy tube =
            anatomy::tube_anatomy("tube", {{0, 0, 0}, {16, 0, 0}}, tube_radius, around, 0.5);
        for (const double thickest : {1.35, 2.35, 4.0, 5.0}) {
            if (thickest >= tube_radius) continue;
            const auto wall = anatomy::cached_distance_field(tube, 20, 0.3, {}, thickest);
            const auto asked = [&](const Vec3& x, double radius) {
                physics::WallContact c;
                c.thickness = radius - 0.3;
                wall->contacts({&x, 1}, {&c, 1});
                return c;
            };
            for (int k = 0; k < 200; ++k) {
                const double radius = draw(0.3, thickest), r = draw(0, tube_radius + 1), angle = draw(0, 6.3);
                const Vec3 x(draw(6, 10), r * std::cos(angle), r * std::sin(angle));
                const std::string what =
                    fmt::format("seed {}: tube {}, device {}, at {}", seed, tube_radius, radius, r);
                const physics::WallContact c = asked(x, radius);
                const double exact = r + radius - tube_radius;
                if (c.touches() || exact > sagitta + 0.02) {
                    // The grid's spacing is 0.3 to 1.2 mm here, and the field has no kink at the axis.
                    const double near_axis = std::max(0.0, 1.2 - r);
                    ASSERT_NEAR(c.penetration, exact, sagitta + 0.02 + 0.5 * near_axis) << what;
                    if (r > 1.5) {
                        ASSERT_NEAR(c.normal.norm(), 1, 0.02) << what;
                    }
                }
                const Vec3 way = Vec3(draw(-1, 1), draw(-1, 1), draw(-1, 1)).normalized();
                ASSERT_FALSE(c.trust > 0 && asked(x + 0.999 * c.trust * way, radius).touches()) << what;
            }
        }
    }
}

}  // namespace exercise
