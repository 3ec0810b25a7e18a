#include "render/xray/volume.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "render/xray/beam_images.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/fluoroscope.h"

namespace {

using geometry::Vec3;
using render::CArm;
using render::DensityVolume;
using render::Field;
using render::Material;
using render::VolumeGrid;
using render::VolumeRayCaster;

constexpr double full_fraction = 10000;  // the sample that stands for a fraction of 1

/// A grid of equal steps about the isocentre, turned if `oblique`.
VolumeGrid grid_about(const Vec3& middle, double step, std::array<int, 3> size, bool oblique) {
    VolumeGrid grid;
    geometry::Mat3 turn = geometry::Mat3::Identity();
    if (oblique)
        turn = (Eigen::AngleAxisd(0.35, Vec3(1, 2, -1).normalized()) * Eigen::AngleAxisd(-0.2, Vec3::UnitZ()))
                   .toRotationMatrix();
    for (int a = 0; a < 3; ++a) grid.steps[a] = step * turn.col(a);
    grid.size = size;
    grid.origin = middle - 0.5 * ((size[0] - 1) * grid.steps[0] + (size[1] - 1) * grid.steps[1] +
                                  (size[2] - 1) * grid.steps[2]);
    return grid;
}

DensityVolume filled(const VolumeGrid& grid, const std::function<double(const Vec3&)>& fraction) {
    DensityVolume volume;
    volume.name = "phantom";
    volume.grid = grid;
    volume.samples.resize(grid.count());
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
                volume.samples[grid.index(i, j, k)] =
                    static_cast<std::int16_t>(std::lround(full_fraction * fraction(grid.at(i, j, k))));
    volume.parts.push_back(
        {Material::SoftTissue, Material::Air, {{-3 * full_fraction, -3}, {3 * full_fraction, 3}}});
    return volume;
}

CArm turned_arm(double lao, double cranial) {
    return CArm{
        .lao = lao, .cranial = cranial, .isocentre = Vec3(10, -20, 300), .detector_width = 220, .pixels = 96};
}

const CArm volume_views[] = {turned_arm(0, 0), turned_arm(1.5707963, 0), turned_arm(0.6, 0.4),
                             turned_arm(-0.9, -0.5)};

/// Calls visit(i, j, unit direction) for every pixel.
void for_each_ray(const CArm& arm, const std::function<void(int, int, const Vec3&)>& visit) {
    for (int j = 0; j < arm.pixels; ++j)
        for (int i = 0; i < arm.pixels; ++i) visit(i, j, render::ray_direction(arm, i + 0.5, j + 0.5));
}

}  // namespace

TEST(VolumeRayCaster, LengthsThroughALinearFieldAreExact) {
    // Fractions are whole samples, linear in i, j and k; rays that enter and leave by the faces of the axis
    // that they are cast along see the whole slab, half a step beyond the outermost samples.
    for (const bool oblique : {false, true}) {
        DensityVolume volume;
        volume.grid = grid_about({10, -20, 300}, 2.0, {61, 53, 57}, oblique);
        const VolumeGrid& grid = volume.grid;
        volume.samples.resize(grid.count());
        for (int k = 0; k < grid.size[2]; ++k)
            for (int j = 0; j < grid.size[1]; ++j)
                for (int i = 0; i < grid.size[0]; ++i)
                    volume.samples[grid.index(i, j, k)] =
                        static_cast<std::int16_t>(5000 + 30 * i - 20 * j + 11 * k);
        volume.parts.push_back({Material::SoftTissue, Material::Air, {{0, 0}, {10000, 1}}});
        const VolumeRayCaster caster(volume);
        const geometry::Mat3 to_index = grid.axes().inverse();
        int rays = 0;
        for (const CArm& arm : volume_views) {
            const Field length = caster.every_length(arm).front();
            for_each_ray(arm, [&](int i, int j, const Vec3& along) {
                const Vec3 from = to_index * (render::source(arm) - grid.origin), d = to_index * along;
                int axis = 0;
                d.cwiseAbs().maxCoeff(&axis);
                double enters = (-0.5 - from[axis]) / d[axis],
                       leaves = (grid.size[axis] - 0.5 - from[axis]) / d[axis];
                if (enters > leaves) std::swap(enters, leaves);
                for (int a = 0; a < 3; ++a)
                    for (const double t : {enters, leaves})
                        if (a != axis &&
                            !(from[a] + t * d[a] > 0.5 && from[a] + t * d[a] < grid.size[a] - 1.5))
                            return;
                const Vec3 middle = from + 0.5 * (enters + leaves) * d;
                const double fraction = 0.5 + 0.003 * middle[0] - 0.002 * middle[1] + 0.0011 * middle[2];
                ++rays;
                EXPECT_NEAR(length.values[static_cast<std::size_t>(j * arm.pixels + i)],
                            fraction * (leaves - enters), 5e-4);
            });
        }
        EXPECT_GT(rays, 1000);
    }
}

TEST(VolumeRayCaster, GaussianAgreesWithItsClosedForm) {
    // A blob of σ = 4 steps: the sum over layers errs by less than exp(−2π²σ²/h²), bilinear interpolation by
    // h²/8 of the second derivative: at most 1/(8·16) of the middle's value each way across the ray.
    const Vec3 middle(10, -20, 300);
    constexpr double step = 1.5, sigma = 4 * step;
    for (const bool oblique : {false, true}) {
        const VolumeRayCaster caster(filled(
            grid_about(middle, step, {48, 48, 48}, oblique),
            [&](const Vec3& x) { return std::exp(-0.5 * (x - middle).squaredNorm() / (sigma * sigma)); }));
        for (const CArm& arm : volume_views) {
            const Field every = caster.every_length(arm).front(), fewer = caster.lengths(arm).front();
            const double most = sigma * std::sqrt(2 * std::numbers::pi);
            for_each_ray(arm, [&](int i, int j, const Vec3& along) {
                const double away = (middle - render::source(arm)).cross(along).squaredNorm();
                const double expected = most * std::exp(-0.5 * away / (sigma * sigma));
                const auto pixel = static_cast<std::size_t>(j * arm.pixels + i);
                EXPECT_NEAR(every.values[pixel], expected, 2.0 / (8 * 16) * most + 0.01);
                EXPECT_NEAR(fewer.values[pixel], expected, 2.0 / (8 * 16) * most + 0.01);
            });
        }
    }
}

TEST(VolumeRayCaster, NoiseOfCoarseSamplesIsHardlyStrongerAtThemThanBetween) {
    // Otherwise a moiré of both shows in the image. One layer of noise, seen from far away, so that pixels
    // are at samples and in the middle between four of them by turns.
    constexpr double step = 3.0;
    constexpr int count = 64;
    DensityVolume volume =
        filled(grid_about(Vec3::Zero(), step, {count, 1, count}, false), [](const Vec3&) { return 0.0; });
    std::mt19937 random(5);
    for (auto& sample : volume.samples) sample = static_cast<std::int16_t>(random() % 8000) - 4000;
    CArm arm{
        .sid = 1e6 + 1e-3, .sod = 1e6, .detector_width = step * (count - 16), .pixels = 2 * (count - 16)};
    arm.isocentre = Vec3(0.25 * step, 0, 0.25 * step);
    const Field length = VolumeRayCaster(std::move(volume)).every_length(arm).front();
    std::array<double, 4> phases{};
    for (int j = 0; j < arm.pixels; ++j)
        for (int i = 0; i < arm.pixels; ++i)
            phases[static_cast<std::size_t>(2 * (j % 2) + i % 2)] +=
                std::pow(length.values[static_cast<std::size_t>(j * arm.pixels + i)], 2);
    const auto [least, most] = std::minmax_element(phases.begin(), phases.end());
    EXPECT_GT(*least, 0.6 * *most);
    EXPECT_GT(*least, 0);
}

TEST(VolumeRayCaster, SphereAgreesWithItsChordsTheBetterTheFinerItIs) {
    // Samples hold the fraction of their cell that lies in the sphere, from 4³ places.
    const Vec3 middle(10, -20, 300);
    constexpr double radius = 40;
    double before = std::numeric_limits<double>::infinity();
    for (const double step : {4.0, 2.0, 1.0}) {
        const int count = static_cast<int>(96 / step);
        const VolumeGrid grid = grid_about(middle, step, {count, count, count}, true);
        const VolumeRayCaster caster(filled(grid, [&](const Vec3& x) {
            if (std::abs((x - middle).norm() - radius) > step)
                return (x - middle).norm() < radius ? 1.0 : 0.0;
            int inside = 0;
            for (int s = 0; s < 64; ++s) {
                const Vec3 at = x + ((s % 4 - 1.5) * grid.steps[0] + (s / 4 % 4 - 1.5) * grid.steps[1] +
                                     (s / 16 - 1.5) * grid.steps[2]) /
                                        4;
                inside += (at - middle).norm() < radius;
            }
            return inside / 64.0;
        }));
        double squares = 0;
        int rays = 0;
        for (const CArm& arm : volume_views) {
            const Field length = caster.every_length(arm).front();
            for_each_ray(arm, [&](int i, int j, const Vec3& along) {
                const double away = (middle - render::source(arm)).cross(along).squaredNorm();
                const double chord = 2 * std::sqrt(std::max(radius * radius - away, 0.0));
                const double error = length.values[static_cast<std::size_t>(j * arm.pixels + i)] - chord;
                squares += error * error;
                ++rays;
            });
        }
        const double rms = std::sqrt(squares / rays);
        EXPECT_LT(rms, 0.5 * step);
        EXPECT_LT(rms, 0.6 * before);  // the silhouette, where a chord falls as a root, allows no h²
        before = rms;
    }
}

TEST(VolumeRayCaster, FewerRaysChangeLittleWhereVoxelsAreLargerThanPixels) {
    // Independent samples are rougher than any CT; means of 3 × 3 × 3 of them are as rough as its noise.
    const unsigned seed = 20260708;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> fraction(0.0, 1.0);
    const VolumeGrid grid = grid_about({10, -20, 300}, 0.7, {120, 120, 120}, true);
    DensityVolume rough = filled(grid, [&](const Vec3&) { return fraction(random); }), blurred = rough;
    for (int a = 0; a < 3; ++a) {
        const std::vector<std::int16_t> before = blurred.samples;
        const std::size_t step = a == 0 ? 1 : a == 1 ? 120 : 120 * 120;
        for (std::size_t i = step; i + step < before.size(); ++i)
            blurred.samples[i] =
                static_cast<std::int16_t>((before[i - step] + before[i] + before[i + step]) / 3);
    }
    CArm arm = turned_arm(0.3, 0.2);
    arm.pixels = 256;
    arm.detector_width = 100;
    const auto lost_of = [&](const DensityVolume& volume) {
        const VolumeRayCaster caster(volume);
        const Field every = caster.every_length(arm).front(), fewer = caster.lengths(arm).front();
        double lost = 0, mean = 0, squares = 0;
        int counted = 0;
        for (int j = 100; j < 156; ++j)
            for (int i = 100; i < 156; ++i, ++counted) {
                const auto pixel = static_cast<std::size_t>(j * 256 + i);
                lost += std::pow(every.values[pixel] - fewer.values[pixel], 2);
                mean += every.values[pixel];
                squares += std::pow(every.values[pixel], 2);
            }
        mean /= counted;
        return std::sqrt(lost / counted) / std::sqrt(squares / counted - mean * mean);
    };
    EXPECT_LT(lost_of(rough), 0.5) << "of the fluctuations, seed " << seed;
    EXPECT_LT(lost_of(blurred), 0.1) << "of the fluctuations, seed " << seed;
    EXPECT_GT(lost_of(rough), 0.0);
}

TEST(VolumeRayCaster, OneVolumeGivesSeveralMaterialsAndAnyNumberOfThreadsTheSameBits) {
    std::mt19937 random(7);
    std::uniform_int_distribution<int> sample(-1000, 2000);
    DensityVolume volume;
    volume.grid = grid_about({10, -20, 300}, 2.0, {40, 50, 60}, true);
    for (std::size_t i = 0; i < volume.grid.count(); ++i)
        volume.samples.push_back(static_cast<std::int16_t>(sample(random)));
    for (const Material material : {Material::Lung, Material::Adipose, Material::SoftTissue, Material::Blood,
                                    Material::CorticalBone, Material::TrabecularBone})
        volume.parts.push_back(
            {material, Material::Air, {{-500, 0}, {0, 0.1 * (1 + static_cast<int>(material))}}});
    const VolumeRayCaster one(volume, 1), three(volume, 3);
    const CArm arm = turned_arm(0.4, -0.3);
    const std::vector<Field> a = one.lengths(arm), b = three.lengths(arm);
    ASSERT_EQ(a.size(), volume.parts.size());
    for (std::size_t p = 0; p < a.size(); ++p) {
        EXPECT_EQ(a[p].values, b[p].values);
        // All parts are multiples of one another.
        const double factor = volume.parts[p].knots[1].fraction / volume.parts[0].knots[1].fraction;
        for (std::size_t i = 0; i < a[p].values.size(); i += 37)
            EXPECT_NEAR(a[p].values[i], factor * a[0].values[i], 1e-4 * (1 + factor * a[0].values[i]));
    }
}

TEST(VolumeRayCaster, VolumesInTheBeamAreWhatMeshesOfTheSameLengthsAre) {
    // Two volumes that overlap, one of them oblique, against their own lengths put into the image by hand.
    const DensityVolume body =
        filled(grid_about({10, -20, 300}, 3.0, {60, 40, 50}, false), [](const Vec3&) { return 0.7; });
    DensityVolume bone =
        filled(grid_about({0, 0, 290}, 2.0, {20, 20, 40}, true), [](const Vec3&) { return 0.4; });
    bone.parts[0].material = Material::CorticalBone;
    bone.parts[0].inside = Material::SoftTissue;
    CArm arm = turned_arm(0.5, 0.1);
    render::Fluoroscope fluoroscope({}, {}, {}, {}, {body, bone});
    const Field quanta = fluoroscope.expected_quanta(arm, {}, {1, 2, 30.0, 74.0});
    // A narrower collimator and back: the same image.
    CArm narrow = arm;
    narrow.opening_width = 50;
    EXPECT_NE(fluoroscope.expected_quanta(narrow, {}, {1, 2, 30.0, 74.0}).values, quanta.values);
    EXPECT_EQ(fluoroscope.expected_quanta(arm, {}, {1, 2, 30.0, 74.0}).values, quanta.values);

    render::PoseImages pose;
    pose.arm = arm;
    std::vector<VolumeRayCaster> ray_casters;
    for (const DensityVolume& volume : {body, bone}) {
        ray_casters.emplace_back(volume);
        render::add_length(pose.mixtures, volume.parts[0].material, volume.parts[0].inside,
                           ray_casters.back().lengths(arm)[0]);
    }
    const render::FluoroscopeConfig config;
    render::ExposureMeter meter(config, {}, ray_casters);
    const render::BeamImages beam =
        render::beam_images(render::plane_images(config, arm), pose, 74.0, 0.6, meter.scatter(arm, 74.0));
    for (std::size_t i = 0; i < quanta.values.size(); i += 11) {
        const double expected = 30.0 * beam.gain * (render::sum(beam.primary[i]) + beam.scatter.values[i]);
        EXPECT_NEAR(quanta.values[i], expected, 1e-4 * expected);
    }
}

TEST(VolumeRayCaster, UnusableVolumesAreRefusedWithEverythingWrong) {
    DensityVolume volume =
        filled(grid_about({0, 0, 0}, 1, {4, 4, 4}, false), [](const Vec3&) { return 1.0; });
    EXPECT_TRUE(render::problems(volume).empty());
    volume.samples.pop_back();
    volume.grid.steps[1] = volume.grid.steps[0];
    volume.parts[0].knots[1].fraction = std::nan("");
    EXPECT_EQ(render::problems(volume).size(), 3u);
    EXPECT_THROW(VolumeRayCaster{volume}, std::invalid_argument);
    volume.grid.size = {0, 4, 4};
    volume.grid.origin[0] = std::numeric_limits<double>::infinity();
    volume.parts.clear();
    EXPECT_EQ(render::problems(volume).size(), 3u);
}

TEST(VolumeRayCaster, VolumeBehindTheSourceOrBesideTheBeamCastsNothing) {
    const CArm arm = turned_arm(0, 0);
    const Vec3 behind = render::source(arm) - 200 * render::axes(arm).beam;
    for (const Vec3& middle : {behind, Vec3(10, -20, 900)}) {
        const VolumeRayCaster caster(
            filled(grid_about(middle, 2, {20, 20, 20}, true), [](const Vec3&) { return 1.0; }));
        const Field length = caster.lengths(arm).front();
        for (const float value : length.values) EXPECT_EQ(value, 0.0f);
    }
}

TEST(SplineEnlarged, ReproducesCubicPolynomialsAndItsOwnValues) {
    const int count = 44, margin = 14, inner = count - 2 * margin, pixels = 40;
    const auto cubic = [](double x, double y) { return 3 + 2 * x - y + x * x * y - 0.5 * y * y * y; };
    const auto place = [&](double i, int n) { return (i + 0.5) / n - 0.5; };  // −½ to ½ over the inner field
    Field field(count, count);
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i)
            field.values[static_cast<std::size_t>(j * count + i)] =
                static_cast<float>(cubic(place(i - margin, inner), place(j - margin, inner)));
    const Field large = render::spline_enlarged(field, margin, pixels);
    for (int j = 0; j < pixels; ++j)
        for (int i = 0; i < pixels; ++i)
            EXPECT_NEAR(large.values[static_cast<std::size_t>(j * pixels + i)],
                        cubic(place(i, pixels), place(j, pixels)), 1e-5);
    const Field same = render::spline_enlarged(field, 0, count);
    for (std::size_t i = 0; i < field.values.size(); ++i) EXPECT_NEAR(same.values[i], field.values[i], 1e-5);
}
