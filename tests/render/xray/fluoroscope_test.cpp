#include "render/xray/fluoroscope.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "physics/geometry/random.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "render/xray/subtraction.h"
#include "tests/engine/fixtures.h"

namespace {

using geometry::Polyline;
using geometry::Vec3;
using render::CArm;
using render::Exposure;
using render::Field;
using render::Fluoroscope;
using render::Material;
using render::TissueLayer;

/// A slab of soft tissue with a bone on the patient's left and a vessel across below.
std::vector<TissueLayer> phantom() {
    std::vector<TissueLayer> layers;
    layers.push_back({"slab", Material::SoftTissue, Material::Air,
                      render::loft({{Vec3(0, 0, -200), Vec3::UnitX(), Vec3::UnitY(), 200, 100, 8},
                                    {Vec3(0, 0, 200), Vec3::UnitX(), Vec3::UnitY(), 200, 100, 8}},
                                   48),
                      false});
    layers.push_back({"bone", Material::CorticalBone, Material::SoftTissue,
                      render::ellipsoid(Vec3(45, 40, 0), Vec3(20, 20, 60)), false});
    layers.push_back({"vessel", Material::Blood, Material::SoftTissue,
                      render::tube({{-80, 0, -40}, {80, 0, -40}}, Vec3::UnitZ(), {5, 5}, {5, 5}), true});
    return layers;
}

CArm small_arm() {
    return CArm{.detector_width = 160.0, .pixels = 128};
}

Polyline across() {
    Polyline joints;
    for (int i = 0; i <= 100; ++i) joints.emplace_back(i - 30.0, 0.0, 0.0);
    return joints;
}

/// Mean of the expected quanta over 5 × 3 pixels at a point of the patient.
double around(const Field& field, const CArm& arm, const Vec3& point) {
    const render::Pixel p = render::project(arm, point);
    double sum = 0.0;
    for (int j = -1; j <= 1; ++j) {
        for (int i = -2; i <= 2; ++i) {
            sum += field.values[(std::lround(p.y - 0.5) + j) * field.width + std::lround(p.x - 0.5) + i];
        }
    }
    return sum / 15.0;
}

TEST(Fluoroscope, RepeatsItsPixelsAndOwesNothingToEarlierFrames) {
    Fluoroscope used({}, phantom());
    const Polyline wire = across();
    CArm arm = small_arm();
    Exposure exposure{12, 99};
    const auto first = used.expose(arm, wire, exposure);
    EXPECT_EQ(used.expose(arm, wire, exposure), first);
    CArm other = arm;
    other.lao = 0.6;
    other.pixels = 64;
    used.expose(other, {}, {1, 2, 60.0, 90.0, 200.0});
    used.expose(arm, wire, {13, 99, 15.0, 74.0, 100.0});
    EXPECT_EQ(used.expose(arm, wire, exposure), first);
    Fluoroscope fresh({}, phantom());
    EXPECT_EQ(fresh.expose(arm, wire, exposure), first);
    // What stays when the arm turns is not kept when the collimator or the field changes.
    arm.opening_width = 90.0;
    EXPECT_EQ(used.expose(arm, wire, exposure), Fluoroscope({}, phantom()).expose(arm, wire, exposure));
    arm.detector_width = 120.0;
    arm.lao = 0.2;
    EXPECT_EQ(used.expose(arm, wire, exposure), Fluoroscope({}, phantom()).expose(arm, wire, exposure));
    arm = small_arm();
    exposure.frame = 13;
    EXPECT_GT(render::difference(fresh.expose(arm, wire, exposure), first).mean, 1.0) << "noise moves on";
}

TEST(Fluoroscope, GivesTheDoseAskedForAtAnyPose) {
    Fluoroscope scope({}, phantom());
    for (double lao : {0.0, 0.7}) {
        CArm arm = small_arm();
        arm.lao = lao;
        const Field expected = scope.expected_quanta(arm, {}, {0, 0, 30.0});
        double sum = 0.0, field = 0.0;
        for (int j = 0; j < arm.pixels; ++j) {
            for (int i = 0; i < arm.pixels; ++i) {
                if (std::hypot(i - 63.5, j - 63.5) > 0.30 * 128.0) continue;
                sum += expected.values[j * arm.pixels + i];
                ++field;
            }
        }
        const double quanta = 54.0 * std::pow(render::pixel_width(arm) / 0.29, 2);
        EXPECT_NEAR(sum / field / quanta, 1.0, 1e-3);
    }
}

TEST(Fluoroscope, WireBehindBoneDarkensTheBone) {
    Fluoroscope scope({}, phantom());
    const CArm arm = small_arm();
    const Field bare = scope.expected_quanta(arm, {}, {});
    const Field wired = scope.expected_quanta(arm, across(), {});
    const Vec3 on_bone(45, 0, 0), beside(-15, 0, 0);
    EXPECT_LT(around(bare, arm, on_bone), 0.8 * around(bare, arm, beside)) << "the bone shows";
    EXPECT_LT(around(wired, arm, on_bone), 0.96 * around(bare, arm, on_bone));
    EXPECT_LT(around(wired, arm, beside), 0.96 * around(bare, arm, beside));
    // Attenuation multiplies: behind bone the wire takes a smaller number of quanta away.
    EXPECT_LT(around(bare, arm, on_bone) - around(wired, arm, on_bone),
              around(bare, arm, beside) - around(wired, arm, beside));
}

TEST(Fluoroscope, ContrastShowsTheVesselAndOnlyTheVessel) {
    Fluoroscope scope({}, phantom());
    const CArm arm = small_arm();
    const Field plain = scope.expected_quanta(arm, {}, {});
    Exposure filled{.iodine = 150.0};
    const Field contrast = scope.expected_quanta(arm, {}, filled);
    EXPECT_LT(around(contrast, arm, Vec3(0, 0, -40)), 0.6 * around(plain, arm, Vec3(0, 0, -40)));
    EXPECT_EQ(around(contrast, arm, Vec3(0, 0, 20)), around(plain, arm, Vec3(0, 0, 20)));
    // A wire displaces contrast medium: in a dense vessel it takes little more away.
    Polyline inside;
    for (int i = 0; i <= 60; ++i) inside.emplace_back(i - 30.0, 0.0, -40.0);
    EXPECT_LT(around(scope.expected_quanta(arm, inside, filled), arm, Vec3(0, 0, -40)),
              around(contrast, arm, Vec3(0, 0, -40)));
}

TEST(Fluoroscope, ContrastLeavesNothingBehind) {
    std::vector<TissueLayer> layers = phantom();
    layers[1].perfused = true;
    std::vector<Vec3> nodes;
    for (int i = 0; i <= 80; ++i) nodes.emplace_back(2.0 * i - 80.0, 0.0, -40.0);
    const std::vector<float> radii(nodes.size(), 5.0f);
    Fluoroscope scope({}, layers, render::LumenContrast(layers[2].mesh, nodes, radii));
    const CArm arm = small_arm();
    const Field plain = scope.expected_quanta(arm, {}, {});
    Exposure organ{.organs = {{1, 40.0}}};
    const Field blush = scope.expected_quanta(arm, {}, organ);
    EXPECT_LT(around(blush, arm, Vec3(45, 40, 0)), 0.9 * around(plain, arm, Vec3(45, 40, 0)));
    Exposure all = organ;
    all.vessel_iodine.assign(nodes.size(), 150.0f);
    const Field filled = scope.expected_quanta(arm, {}, all);
    EXPECT_LT(around(filled, arm, Vec3(0, 0, -40)), 0.6 * around(plain, arm, Vec3(0, 0, -40)));
    EXPECT_EQ(around(filled, arm, Vec3(45, 40, 0)), around(blush, arm, Vec3(45, 40, 0)));
    all.vessel_shift = Vec3(0, 0, 30);
    EXPECT_LT(around(scope.expected_quanta(arm, {}, all), arm, Vec3(0, 0, -10)),
              0.6 * around(plain, arm, Vec3(0, 0, -10)));
    EXPECT_EQ(scope.expected_quanta(arm, {}, organ).values, blush.values);
    EXPECT_EQ(scope.expected_quanta(arm, {}, {}).values, plain.values);
}

TEST(Fluoroscope, MatchesBeerAndLambertThroughASlab) {
    // Two slabs' expected quanta, without scatter, differ by the attenuation of the extra tissue.
    render::FluoroscopeConfig config;
    config.scatter = 0.0;
    config.heel = 0.0;
    std::vector<TissueLayer> layers = phantom();
    layers.resize(1);
    layers.push_back({"bone", Material::CorticalBone, Material::SoftTissue,
                      render::loft({{Vec3(0, 0, -200), Vec3::UnitX(), Vec3::UnitY(), 30, 10, 60},
                                    {Vec3(0, 0, 200), Vec3::UnitX(), Vec3::UnitY(), 30, 10, 60}},
                                   200),
                      false});
    Fluoroscope scope(config, layers);
    const CArm arm = small_arm();
    Exposure exposure{.kvp = 74.0};
    const Field expected = scope.expected_quanta(arm, {}, exposure);
    const render::Spectrum spectrum = render::detected_spectrum(74.0);
    double with = 0.0, without = 0.0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i) {
        const double tissue = render::attenuation(Material::SoftTissue, spectrum.energies[i]);
        const double bone = render::attenuation(Material::CorticalBone, spectrum.energies[i]);
        without += spectrum.weights[i] * std::exp(-200.0 * tissue);
        with += spectrum.weights[i] * std::exp(-180.0 * tissue - 20.0 * bone);
    }
    // The reference beside the bone has a ray 0.5 % longer, which cos³ and the slant of 0.06 rad explain.
    EXPECT_NEAR(around(expected, arm, Vec3(0, 0, 0)) / around(expected, arm, Vec3(45, 0, 0)), with / without,
                0.02);
}

TEST(Fluoroscope, RefusesAnOpenMeshByName) {
    std::vector<TissueLayer> layers = phantom();
    layers[1].mesh.triangles.pop_back();
    try {
        Fluoroscope scope({}, layers);
        FAIL() << "the hole was not found";
    } catch (const render::OpenMeshError& error) {
        EXPECT_NE(std::string(error.what()).find("bone"), std::string::npos);
    }
}

TEST(Fluoroscope, RefusesABadArmOrExposureWithAllItsProblems) {
    Fluoroscope scope({}, {});
    CArm arm{.sod = 2000.0, .pixels = 0};
    Exposure exposure{.kvp = std::numeric_limits<double>::quiet_NaN(), .iodine = -1.0};
    for (const char* part : {"sod < sid", "pixels", "iodine", "kV"})
        test::expect_refusal<std::invalid_argument>([&] { scope.expose(arm, {}, exposure); }, part);
}

TEST(Fluoroscope, ExposesAnEmptyRoomAndAWireThatIsNotFinite) {
    Fluoroscope scope({}, {});
    const CArm arm = small_arm();
    const auto empty = scope.expose(arm, {}, {});
    EXPECT_EQ(empty.width, 128);
    Polyline broken = across();
    broken[50].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(scope.expose(arm, broken, {}), empty);
    EXPECT_NE(scope.expose(arm, across(), {}), empty);
}

TEST(Fluoroscope, ExposesWhatNothingGetsThrough) {
    std::vector<TissueLayer> layers = phantom();
    layers[0].material = Material::Platinum;  // 200 mm of it: exp(−μt) is 0
    Fluoroscope scope({}, std::move(layers));
    const Exposure exposure{1, 1};
    for (const float quanta : scope.expected_quanta(small_arm(), across(), exposure).values)
        ASSERT_TRUE(std::isfinite(quanta) && quanta >= 0.0f) << quanta;
    const render::Technique technique = scope.technique(small_arm(), exposure);
    EXPECT_EQ(technique.kvp, 120.0);
    EXPECT_GT(technique.delivered, 0.0);
    EXPECT_LT(technique.delivered, 1e-6);
    EXPECT_TRUE(std::isfinite(technique.air_kerma) && technique.air_kerma > 0.0);
    EXPECT_EQ(scope.expose(small_arm(), across(), exposure).pixels.size(), 128u * 128u);
}

TEST(Fluoroscope, DsaShowsAVesselBeforeTheSpineAsBesideIt) {
    // The same vessel twice before a patient's loins: in front of the spine and beside it.
    constexpr double beside = 42.0;
    const auto vessel = [](double x) {
        return TissueLayer{"vessel", Material::SoftTissue, Material::SoftTissue,
                           render::tube({{x, -10, -120}, {x, -10, 40}}, Vec3::UnitX(), {4, 4}, {4, 4}), true};
    };
    const auto amplitudes = [&](double scatter, double removed) {
        render::FluoroscopeConfig config;
        config.scatter = scatter;
        std::vector<TissueLayer> layers = render::make_patient({});
        layers.push_back(vessel(0));
        layers.push_back(vessel(beside));
        Fluoroscope scope(config, std::move(layers));
        CArm arm{.isocentre = Vec3(0, 0, -40), .pixels = 256};
        Exposure mask, filled;
        mask.detector_dose = filled.detector_dose = 1000;
        filled.iodine = 100;
        const auto per_dose = [&](const Exposure& exposure) {
            Field signal = scope.expected_quanta(arm, {}, exposure);
            for (float& value : signal.values) value /= 1000;
            return signal;
        };
        const Field before = per_dose(mask), after = per_dose(filled);
        render::SubtractionSpec spec;
        spec.scatter = removed;
        const render::Subtraction subtraction(before, Field(256, 256, 1.0f),
                                              scope.scatter_in(before, arm, mask), spec);
        const Field difference = subtraction.difference(after);
        const auto mean = [&](double x) {
            double sum = 0;
            int count = 0;
            for (double z = -110; z <= 30; z += 1) {
                const render::Pixel at = render::project(arm, Vec3(x, -10, z));
                sum += difference.values[static_cast<int>(at.y) * 256 + static_cast<int>(at.x)];
                ++count;
            }
            return sum / count;
        };
        return std::pair(mean(0), mean(beside));
    };
    const auto [true_spine, true_beside] = amplitudes(0, 0);
    const auto [left_spine, left_beside] = amplitudes(1, 0);
    const auto [spine, soft] = amplitudes(1, render::SubtractionSpec().scatter);
    RecordProperty("left_in_spine", std::to_string(left_spine / true_spine));
    RecordProperty("left_in_soft", std::to_string(left_beside / true_beside));
    RecordProperty("removed_spine", std::to_string(spine / true_spine));
    RecordProperty("removed_soft", std::to_string(soft / true_beside));
    EXPECT_LT(left_spine / true_spine, 0.93) << "there is scatter to be removed";
    EXPECT_NEAR(spine / true_spine, 1.0, 0.1);
    EXPECT_NEAR(soft / true_beside, 1.0, 0.1);
    EXPECT_NEAR(spine / true_spine / (soft / true_beside), 1.0, 0.1);
}

/// Variance of what a wire along x, at that height above the isocentre toward the detector, removes from the
/// rays of a column [pixels²]: a mean over places of the wire within a pixel, as a few places of a pixel see
/// its border.
double width_of_wire(double toward_detector, const Exposure& exposure) {
    Fluoroscope scope({}, {});
    const CArm arm{.detector_width = 100.0, .pixels = 256};
    constexpr int phases = 16;
    const double pitch = render::pixel_width(arm) * (arm.sod + toward_detector) / arm.sid;
    double variance = 0;
    for (int phase = 0; phase < phases; ++phase) {
        Polyline joints;
        for (int i = 0; i <= 40; ++i)
            joints.emplace_back(2 * i - 40.0, -toward_detector, pitch * phase / phases);
        const Field with = scope.expected_quanta(arm, joints, exposure),
                    without = scope.expected_quanta(arm, Polyline{}, exposure);
        double sum = 0, first = 0, second = 0;
        for (int row = 0; row < arm.pixels; ++row) {
            const auto pixel = static_cast<std::size_t>(row * arm.pixels + arm.pixels / 2);
            const double removed = without.values[pixel] - with.values[pixel];
            sum += removed, first += removed * row, second += removed * row * row;
        }
        variance += (second / sum - std::pow(first / sum, 2)) / phases;
    }
    return variance;
}

// A focal spot of side f widens a shadow by a square of f (M − 1), M by the depth of what casts it.
TEST(Fluoroscope, AFocalSpotWidensShadowsByTheirDepth) {
    const CArm arm{.detector_width = 100.0, .pixels = 256};
    for (const double toward_detector : {-120.0, 0.0, 120.0}) {
        Exposure sharp, large;
        sharp.focal_spot = 0;
        large.focal_spot = 1.0;
        const double magnification = arm.sid / (arm.sod + toward_detector),
                     side = (magnification - 1) / render::pixel_width(arm);
        const double wider = width_of_wire(toward_detector, large) - width_of_wire(toward_detector, sharp);
        EXPECT_NEAR(wider, side * side / 12, 0.15 * side * side / 12) << toward_detector;
    }
}

/// Variance of the upper edge of a plate of bone at that height above the isocentre toward the detector
/// [pixels²]: a mean over places of the edge within a pixel.
double width_of_edge(double toward_detector, double focal_spot) {
    const CArm arm{.detector_width = 100.0, .pixels = 256};
    constexpr int phases = 8;
    const double pitch = render::pixel_width(arm) * (arm.sod + toward_detector) / arm.sid;
    double variance = 0;
    for (int phase = 0; phase < phases; ++phase) {
        const double top = 10 + pitch * phase / phases;
        std::vector<TissueLayer> layers;
        layers.push_back(
            {"plate", Material::CorticalBone, Material::Air,
             render::loft({{Vec3(0, -toward_detector, top - 60), Vec3::UnitX(), Vec3::UnitY(), 60, 0.5, 8},
                           {Vec3(0, -toward_detector, top), Vec3::UnitX(), Vec3::UnitY(), 60, 0.5, 8}},
                          48),
             false});
        Fluoroscope scope({}, std::move(layers));
        Exposure exposure;
        exposure.kvp = 70;
        exposure.focal_spot = focal_spot;
        const Field seen = scope.expected_quanta(arm, Polyline{}, exposure);
        double sum = 0, first = 0, second = 0;
        for (int row = 60; row < 140; ++row) {
            const auto pixel = static_cast<std::size_t>(row * arm.pixels + arm.pixels / 2);
            const double step = std::log(seen.values[pixel] / seen.values[pixel + 256]);
            sum += step, first += step * row, second += step * row * row;
        }
        variance += (second / sum - std::pow(first / sum, 2)) / phases;
    }
    return variance;
}

// The patient's shadows are as unsharp as at 90 mm before or behind the isocentre.
TEST(Fluoroscope, BonesNearTheTubeAreLessSharpThanThoseNearTheDetector) {
    const CArm arm{.detector_width = 100.0, .pixels = 256};
    constexpr double spot = 0.6;
    for (const double toward_detector : {-90.0, 90.0}) {
        const double wider = width_of_edge(toward_detector, spot) - width_of_edge(toward_detector, 0);
        const double side = spot * (arm.sid / (arm.sod + toward_detector) - 1) / render::pixel_width(arm);
        // The straight line between both is exact at the isocentre.
        EXPECT_NEAR(wider, side * side / 12, toward_detector < 0 ? 0.2 * side * side / 12 : 0.04)
            << toward_detector;
    }
}

TEST(Fluoroscope, AFilterDimsWhatItCoversAndSparesThePatient) {
    CArm arm = small_arm();
    Fluoroscope scope({}, phantom());
    Exposure exposure;
    exposure.kvp = 74;
    const Field open = scope.expected_quanta(arm, Polyline{}, exposure);
    const render::Technique free = scope.technique(arm, exposure);
    for (const double angle : {0.0, 0.5 * std::numbers::pi, 2.3}) {
        for (render::BeamFilter CArm::*const which : {&CArm::wedge, &CArm::lung_shutter}) {
            CArm filtered = arm;
            filtered.*which = {10.0, angle};
            const Field seen = scope.expected_quanta(filtered, Polyline{}, exposure);
            const render::Technique technique = scope.technique(filtered, exposure);
            const auto ratio_at = [&](double from_middle, double beside = 0) {
                const double x = from_middle * std::cos(angle) - beside * std::sin(angle),
                             y = from_middle * std::sin(angle) + beside * std::cos(angle);
                const int i = static_cast<int>(64 + x / render::pixel_width(arm)),
                          j = static_cast<int>(64 - y / render::pixel_width(arm));
                const auto pixel = static_cast<std::size_t>(j * arm.pixels + i);
                return seen.values[pixel] / open.values[pixel];
            };
            // Tube output rises to keep the dose behind the patient; the covered side gets far less of it.
            for (const double beside : {-40.0, 0.0, 40.0}) EXPECT_GT(ratio_at(-40, beside), 0.99) << angle;
            EXPECT_GT(ratio_at(-70), 0.99) << angle;
            EXPECT_LT(ratio_at(70), 0.5 * ratio_at(-40)) << angle;
            EXPECT_GT(ratio_at(70), 0.05) << angle;
            const double output =
                technique.current * technique.pulse_width / (free.current * free.pulse_width);
            EXPECT_LT(technique.area_product / output, 0.85 * free.area_product) << angle;
        }
    }
    // The pose's images are kept while a filter moves.
    CArm again = arm;
    again.wedge = {0.0, 1.0};
    EXPECT_EQ(scope.expected_quanta(again, Polyline{}, exposure).values,
              Fluoroscope({}, phantom()).expected_quanta(again, Polyline{}, exposure).values);
    EXPECT_EQ(scope.expected_quanta(arm, Polyline{}, exposure).values, open.values);
    again.wedge.edge = std::nan("");
    EXPECT_THROW(scope.expected_quanta(again, Polyline{}, exposure), std::invalid_argument);
}

TEST(Fluoroscope, CopiesShareThePatientAndNothingElse) {
    Fluoroscope first({}, phantom());
    constexpr int poses = 6;
    const auto arm_of = [](int k) {
        CArm arm = small_arm();
        arm.lao = 0.2 * (k % 3);
        arm.pixels = k < 3 ? 64 : 96;
        arm.opening_width = k % 2 ? 90 : 1000;
        return arm;
    };
    std::vector<render::GrayImage> expected;
    for (int k = 0; k < poses; ++k)
        expected.push_back(Fluoroscope({}, phantom()).expose(arm_of(k), across(), {7, 3, 30.0, {}, 40.0}));
    std::atomic<int> different = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t, own = Fluoroscope(first)]() mutable {
            geometry::Random random(static_cast<std::uint64_t>(40 + t));
            for (int round = 0; round < 40; ++round) {
                const int k = static_cast<int>(random() * poses);
                different += own.expose(arm_of(k), across(), {7, 3, 30.0, {}, 40.0}) != expected[k];
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(different, 0);
    EXPECT_EQ(first.expose(arm_of(1), across(), {7, 3, 30.0, {}, 40.0}), expected[1]);
}

TEST(Fluoroscope, WhatMovesWithinThePulseIsBlurredByItsWay) {
    Exposure still, moving;
    moving.kvp = still.kvp = 70;
    Fluoroscope scope({}, {});
    const CArm arm{.detector_width = 100.0, .pixels = 256};
    const double pulse = scope.technique(arm, still).pulse_width;  // [ms]
    ASSERT_GT(pulse, 0);
    const double way = 0.4;  // up the image [mm]
    moving.vessel_velocity = Vec3(0, 0, way / (1e-3 * pulse));
    const double pixels = way * arm.sid / arm.sod / render::pixel_width(arm);
    ASSERT_LT(pixels, 2);
    EXPECT_NEAR(width_of_wire(0, moving) - width_of_wire(0, still), pixels * pixels / 12,
                0.2 * pixels * pixels / 12);
    // Across its length alone: along it nothing is seen of the motion.
    moving.vessel_velocity = Vec3(way / (1e-3 * pulse), 0, 0);
    EXPECT_NEAR(width_of_wire(0, moving), width_of_wire(0, still), 0.01);
}

}  // namespace
