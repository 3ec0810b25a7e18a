#include "render/xray/wire_image.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

#include "physics/geometry/random.h"

namespace {

using geometry::Polyline;
using geometry::Vec3;
using render::Bins;
using render::CArm;
using render::WireImage;
using render::WireLook;

/// N joints 1 mm apart that wander in all three directions, with turns down to a radius of 15 mm.
Polyline wandering(int count) {
    Polyline joints{Vec3(-30, 0, -60)};
    for (int i = 1; i < count; ++i) {
        const double a = 0.9 * std::sin(i / 21.0), b = 0.8 * std::cos(i / 33.0);
        joints.push_back(joints.back() +
                         Vec3(std::sin(a) * std::cos(b), std::sin(b), std::cos(a) * std::cos(b)));
    }
    return joints;
}

/// Brute force: rays at n × n places of each pixel through a chain of spheres and cylinders would count
/// overlaps twice; so distance to a finely cut centreline decides what is inside, marching along each ray.
double brute_transmission(const CArm& arm, const Polyline& fine, double radius, double mu, int x, int y,
                          int n) {
    const Vec3 origin = render::source(arm);
    double sum = 0.0;
    for (int v = 0; v < n; ++v) {
        for (int u = 0; u < n; ++u) {
            const Vec3 ray = render::ray_direction(arm, x + (u + 0.5) / n, y + (v + 0.5) / n);
            // Union of the chords through the capsules of the fine pieces.
            std::vector<std::pair<double, double>> chords;
            for (std::size_t i = 0; i + 1 < fine.size(); ++i) {
                const Vec3 axis = (fine[i + 1] - fine[i]).normalized(), from = fine[i] - origin;
                const double length = (fine[i + 1] - fine[i]).norm();
                if (((from + 0.5 * length * axis).cross(ray)).norm() > radius + length) continue;
                const double along = ray.dot(axis), a = 1.0 - along * along;
                const double b = from.dot(ray) - from.dot(axis) * along;
                const double c = from.squaredNorm() - std::pow(from.dot(axis), 2) - radius * radius;
                if (b * b <= a * c) continue;
                double enter = (b - std::sqrt(b * b - a * c)) / a, leave = (b + std::sqrt(b * b - a * c)) / a;
                // Square ends; the pieces are so short and bend so little that gaps do not matter.
                const double s = from.dot(axis);
                const double t0 = s / along, t1 = (s + length) / along;
                enter = std::max(enter, std::min(t0, t1));
                leave = std::min(leave, std::max(t0, t1));
                if (leave > enter) chords.emplace_back(enter, leave);
            }
            std::sort(chords.begin(), chords.end());
            double inside = 0.0, reached = -1e9;
            for (const auto& [enter, leave] : chords) {
                inside += std::max(0.0, leave - std::max(enter, reached));
                reached = std::max(reached, leave);
            }
            sum += std::exp(-mu * inside);
        }
    }
    return sum / (n * n);
}

Bins all(double mu) {
    Bins bins;
    bins.fill(mu);
    return bins;
}

struct Agreement {
    double rms = 0.0;
    double mass = 0.0;  // of 1 − transmission, relative to brute force
    int pixels = 0;
};

Agreement compare(const CArm& arm, double mu, int count) {
    const Polyline joints = wandering(count);
    WireLook look{.marker_length = 0.0};
    WireImage wire;
    const auto cast = wire.cast(arm, joints, look, {all(mu), all(mu)});
    std::vector<double> transmission(static_cast<std::size_t>(arm.pixels) * arm.pixels, 1.0);
    for (const auto& pixel : cast) transmission[pixel.index] = pixel.transmission[1];
    double square = 0.0, own = 0.0, brute = 0.0;
    Agreement result;
    for (int y = 0; y < arm.pixels; ++y) {
        for (int x = 0; x < arm.pixels; ++x) {
            const Vec3 ray = render::ray_direction(arm, x + 0.5, y + 0.5);
            double nearest = 1e9;
            for (const Vec3& p : joints)
                nearest = std::min(nearest, (p - render::source(arm)).cross(ray).norm());
            if (nearest > 2.0) continue;
            const double exact = brute_transmission(arm, joints, 0.5 * look.diameter, mu, x, y, 8);
            const double got = transmission[static_cast<std::size_t>(y) * arm.pixels + x];
            own += 1.0 - got;
            brute += 1.0 - exact;
            if (exact == 1.0 && got == 1.0) continue;
            square += (got - exact) * (got - exact);
            ++result.pixels;
        }
    }
    result.rms = std::sqrt(square / result.pixels);
    result.mass = own / brute;
    return result;
}

TEST(WireImage, AgreesWithBruteForceAtEightByEightPlaces) {
    CArm arm{.pixels = 192};
    arm.detector_width = 112.0;  // pixels of 0.58 mm, as at 512 over 300 mm
    arm.lao = 0.4;
    const Agreement steel = compare(arm, 1.1, 70);
    EXPECT_GT(steel.pixels, 150);
    EXPECT_LE(steel.rms, 0.01);
    EXPECT_NEAR(steel.mass, 1.0, 0.003);
    const Agreement platinum = compare(arm, 10.0, 70);
    EXPECT_LE(platinum.rms, 0.03);
    EXPECT_NEAR(platinum.mass, 1.0, 0.006);
}

TEST(WireImage, OfAThinLongWireHasTheMassOfItsCrossSection) {
    // For a small μ the sum of 1 − T times pixel area is μ·(π/4)d²·length, times the magnification squared
    // (here the wire lies in the isocentre plane, and obliquity is below 0.5 %).
    CArm arm{.detector_width = 200.0};
    Polyline joints;
    for (int i = 0; i <= 60; ++i) joints.emplace_back(i - 30.0, 0.0, 0.31 * (i - 30.0));
    WireLook look{.marker_length = 0.0};
    constexpr double mu = 1e-3;
    WireImage wire;
    double mass = 0.0;
    for (const auto& pixel : wire.cast(arm, joints, look, {all(mu), all(mu)}))
        mass += 1.0 - pixel.transmission[0];
    mass *= std::pow(render::pixel_width(arm) * arm.sod / arm.sid, 2);
    const double length = (joints.back() - joints.front()).norm();
    EXPECT_NEAR(mass / (mu * std::acos(-1.0) / 4.0 * look.diameter * look.diameter * length), 1.0, 0.005);
}

TEST(WireImage, SeenEndOnIsADiscOfItsFullLength) {
    CArm arm{.detector_width = 60.0, .pixels = 256};
    Polyline joints;
    for (int i = 0; i <= 10; ++i) joints.emplace_back(0.0, 0.1 * i, 0.0);  // along the central ray, 1 mm long
    WireLook look{.marker_length = 0.0};
    WireImage wire;
    const auto cast = wire.cast(arm, joints, look, {all(1.0), all(1.0)});
    double middle = 1.0;
    for (const auto& pixel : cast) {
        if (pixel.index == 128u * 256u + 128u) middle = pixel.transmission[0];
    }
    EXPECT_NEAR(middle, std::exp(-1.0), 1e-5);
    const double radius = 0.5 * look.diameter * arm.sid / arm.sod / render::pixel_width(arm);
    EXPECT_NEAR(static_cast<double>(cast.size()), std::acos(-1.0) * radius * radius,
                0.2 * radius * radius + 20);
}

TEST(WireImage, AttenuatesByItsMetalLessWhatItDisplaces) {
    const auto bins = render::fit_bins(render::detected_spectrum(74.0));
    WireLook look{.body_fill = 0.5};
    const auto mu = render::wire_attenuation(look, bins, all(0.1));
    const double steel = render::attenuation(render::Material::Steel, bins.energies[2]);
    const double platinum = render::attenuation(render::Material::Platinum, bins.energies[2]);
    EXPECT_NEAR(mu.body[2], 0.5 * steel - 0.1, 1e-12);
    EXPECT_NEAR(mu.marker[2], look.marker_fill * platinum - 0.1, 1e-12);
}

// Filled from the hub as far as its middle: there a bore of 1 mm with 300 mg/ml removes what so much iodine
// removes, beyond it nothing; and saline in a vessel of contrast is brighter than what it displaces.
TEST(WireImage, ShowsWhatTheBoreHolds) {
    WireLook tube;
    tube.diameter = 1.6;
    tube.inner_diameter = 1.0;
    tube.marker_length = 0;
    const Polyline joints{Vec3(-60, 0, 0), Vec3(0, 0, 0), Vec3(60, 0, 0)};
    render::WireAttenuation nothing;
    Bins per_iodine;
    per_iodine.fill(1e-4);
    render::DeviceIodine iodine{0, std::vector<float>(40, 0.0f), 120};
    std::fill_n(iodine.bore.begin(), 20, 300.0f);
    const CArm arm;
    WireImage image;
    const auto removed = [&](const render::DeviceIodine& of) {
        const render::WireShadow shadow{joints, tube, nothing, &of};
        std::array<double, 2> sum = {0, 0};  // left and right half, over the pixel's width
        for (const render::WirePixel& pixel : image.cast(arm, {&shadow, 1}, per_iodine)) {
            const int column = static_cast<int>(pixel.index) % arm.pixels;
            sum[column < arm.pixels / 2 ? 0 : 1] -= std::log(pixel.transmission[0]);
        }
        return sum;
    };
    const std::array<double, 2> filled = removed(iodine);
    // The section's area times its length, in pixels of the isocentre's plane.
    const double pitch = render::pixel_width(arm) * arm.sod / arm.sid;
    EXPECT_NEAR(filled[0], 1e-4 * 300 * M_PI / 4 * 60 / (pitch * pitch), 0.03 * filled[0]);
    EXPECT_NEAR(filled[1], 0, 0.03 * filled[0]);
    const std::array<double, 2> saline = removed({300, {}, 120});
    EXPECT_NEAR(saline[1], -filled[0], 0.03 * filled[0]);
}

TEST(WireImage, MarkerTakesTheDistalLength) {
    CArm arm;
    Polyline joints;
    for (int i = 0; i <= 50; ++i) joints.emplace_back(i, 0.0, 0.0);
    WireLook look{.marker_length = 10.5};
    WireImage wire;
    int light = 0, dark = 0;
    for (const auto& pixel : wire.cast(arm, joints, look, {all(0.0), all(5.0)})) {
        (pixel.transmission[0] < 1.0f ? dark : light)++;
    }
    EXPECT_NEAR(double(dark) / (dark + light), 10.5 / 50.0, 0.02);
}

TEST(WireImage, OfNoJointsOrOneThatIsNotFiniteIsEmpty) {
    WireImage wire;
    const CArm arm;
    const WireLook look;
    const render::WireAttenuation mu{all(1.0), all(1.0)};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(wire.cast(arm, {}, look, mu).empty());
    EXPECT_TRUE(wire.cast(arm, Polyline{Vec3::Zero()}, look, mu).empty());
    EXPECT_TRUE(wire.cast(arm, Polyline{Vec3::Zero(), Vec3::Zero()}, look, mu).empty());
    EXPECT_TRUE(wire.cast(arm, Polyline{Vec3::Zero(), Vec3(nan, 0, 0)}, look, mu).empty());
    // Behind the source, or out of the field: no shadow and no harm.
    EXPECT_TRUE(wire.cast(arm, Polyline{Vec3(0, 800, 0), Vec3(0, 900, 0)}, look, mu).empty());
    EXPECT_TRUE(wire.cast(arm, Polyline{Vec3(900, 0, 0), Vec3(910, 0, 0)}, look, mu).empty());
    // Absurd, though finite.
    for (const auto& pixel : wire.cast(arm, Polyline{Vec3(0, 0, 0), Vec3(1e300, -1e300, 1e9)}, look, mu)) {
        EXPECT_TRUE(pixel.transmission[0] >= 0.0f && pixel.transmission[0] <= 1.0f);
    }
    EXPECT_FALSE(wire.cast(arm, Polyline{Vec3(0, 0, 0), Vec3(9, 0, 0)}, look, mu).empty());
}

TEST(WireImage, DoesNotRememberTheFrameBefore) {
    const CArm arm;
    const WireLook look;
    const render::WireAttenuation mu{all(1.0), all(3.0)};
    WireImage used, fresh;
    used.cast(arm, wandering(120), look, mu);
    const auto again = used.cast(arm, wandering(60), look, mu);
    const auto first = fresh.cast(arm, wandering(60), look, mu);
    ASSERT_EQ(again.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        EXPECT_EQ(again[i].index, first[i].index);
        EXPECT_EQ(again[i].transmission, first[i].transmission);
    }
}

/// A line along x, middle in the isocentre.
Polyline straight(double length, int pieces) {
    Polyline joints;
    for (int i = 0; i <= pieces; ++i) joints.emplace_back(length * (double(i) / pieces - 0.5), 0.0, 0.0);
    return joints;
}

/// Σ (1 − transmission) in the isocentre's plane [mm²].
double mass_of(std::span<const render::WirePixel> pixels, const CArm& arm) {
    double sum = 0;
    for (const render::WirePixel& pixel : pixels) sum += 1.0 - pixel.transmission[0];
    return sum * std::pow(render::pixel_width(arm) * arm.sod / arm.sid, 2);
}

/// Filled, with a skin that is not seen.
WireLook balloon_look(double shaft = 0) {
    WireLook look{.marker_length = 0};
    look.inner_diameter = look.diameter;
    look.core_diameter = shaft;
    return look;
}

TEST(WireImage, OfABalloonIsTheChordThroughItsContrast) {
    CArm arm{.detector_width = 60, .pixels = 512};
    const Polyline joints = straight(40, 40);
    constexpr double radius = 3, iodine = 150, per_mg = 1e-5;
    const std::vector<double> radii(joints.size(), radius);
    const render::DeviceIodine filling{0, {float(iodine)}, 40};
    WireImage image;
    const render::WireShadow shadow{joints, balloon_look(), {}, &filling, radii};
    std::vector<double> depth(512, 0);  // down the middle column [mg/ml·mm]
    for (const auto& pixel : image.cast(arm, {&shadow, 1}, all(per_mg)))
        if (pixel.index % 512 == 256) depth[pixel.index / 512] = -std::log(pixel.transmission[0]) / per_mg;
    const Vec3 source = render::source(arm);
    for (int row = 0; row < 512; ++row) {
        double exact = 0;
        for (int v = 0; v < 32; ++v) {
            const Vec3 ray = render::ray_direction(arm, 256.5, row + (v + 0.5) / 32);
            const Vec3 across = ray.cross(Vec3::UnitX());
            const double x = source.dot(across.normalized());
            if (std::abs(x) < radius)
                exact += 2 * std::sqrt(radius * radius - x * x) * iodine / across.norm() / 32;
        }
        // Four places do not average the edge, where the chord rises as a root, better than that.
        EXPECT_NEAR(depth[row], exact, 0.003 * 2 * radius * iodine) << row;
    }
}

TEST(WireImage, OfABalloonLeavesOutItsShaftAndIsGoneWhenItIsFolded) {
    CArm arm{.detector_width = 100, .pixels = 512};
    const Polyline joints = straight(30, 30);
    const render::DeviceIodine filling{0, {160.0f}, 30};
    WireImage image;
    const auto filled = [&](double radius, double shaft) {
        const std::vector<double> radii(joints.size(), radius);
        const render::WireShadow shadow{joints, balloon_look(shaft), {}, &filling, radii};
        return mass_of(image.cast(arm, {&shadow, 1}, all(1e-6)), arm) / (160 * 1e-6);
    };
    EXPECT_NEAR(filled(2, 0) / (M_PI * 4 * 30), 1, 0.005);
    EXPECT_NEAR(filled(2, 1) / (M_PI * (4 - 0.25) * 30), 1, 0.005);
    EXPECT_EQ(filled(0.5, 1), 0);
}

// Of radii that vary slowly the silhouette has them to half a pixel at each place, without steps.
TEST(WireImage, ShowsTheWaistOfABalloon) {
    CArm arm{.detector_width = 60, .pixels = 512};
    const Polyline joints = straight(24, 48);
    const auto profile = [](double x) {
        const double waist = 1.3 * std::exp(-std::pow(x / 2.5, 2));
        return std::min(3.0 - waist, std::max(0.0, 12 - std::abs(x)) * 1.2 + 0.4);
    };
    std::vector<double> radii;
    for (const Vec3& p : joints) radii.push_back(profile(p.x()));
    const auto radius_at = [&](double x) {
        const double place = (x + 12) / 0.5;
        const auto i = static_cast<std::size_t>(place);
        return radii[i] + (place - double(i)) * (radii[i + 1] - radii[i]);
    };
    WireImage image;
    const render::WireShadow opaque{joints, {.marker_length = 0}, {all(1e3), {}, {}, {}}, nullptr, radii};
    std::vector<double> width(512, 0);  // of each column [pixels]
    for (const auto& pixel : image.cast(arm, {&opaque, 1}))
        width[pixel.index % 512] += 1 - pixel.transmission[0];
    const double pixel = render::pixel_width(arm) * arm.sod / arm.sid;
    int columns = 0;
    for (int column = 0; column < 512; ++column) {
        const double x = (column + 0.5 - 256) * pixel;
        if (std::abs(x) > 11.8) continue;
        EXPECT_NEAR(0.5 * width[column], radius_at(x) / pixel, 0.5) << x;
        ++columns;
    }
    EXPECT_GT(columns, 200);
}

// Truncated cones of all slopes, from all sides, and also from along their axis, where rays are steeper than
// the surface, have their volume.
TEST(WireImage, OfConesHasTheirVolumeFromAllSides) {
    geometry::Random random(1);
    const auto uniform = [&](double low, double high) { return random.between(low, high); };
    WireImage image;
    for (int trial = 0; trial < 200; ++trial) {
        SCOPED_TRACE(trial);
        CArm arm{.detector_width = 60, .pixels = 384};
        Vec3 axis(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        if (trial % 4 == 0) axis = Vec3(0, 1, 0) + uniform(0, 0.3) * axis;  // nearly along the beam
        axis.normalize();
        const double a = trial % 5 == 0 ? 0 : uniform(0.3, 4), b = uniform(1, 4), length = uniform(0.2, 9);
        const Polyline joints{-0.5 * length * axis, 0.5 * length * axis};
        const std::vector<double> radii{a, b};
        WireLook look{.marker_length = 0};
        const double bore = trial % 3 == 0 ? 0.5 : 0;
        look.inner_diameter = bore * look.diameter;
        const render::WireShadow cone{joints, look, {all(1e-4), {}, {}, {}}, nullptr, radii};
        const double volume = M_PI / 3 * (a * a + a * b + b * b) * length * (1 - bore * bore);
        EXPECT_NEAR(mass_of(image.cast(arm, {&cone, 1}), arm) / (1e-4 * volume), 1, 0.02)
            << a << " " << b << " " << length << " " << axis.transpose();
    }
}

TEST(WireImage, OfRadiiAsItsLookSaysIsThatOfTheLook) {
    const CArm arm;
    const Polyline joints = wandering(60);
    const WireLook look;
    const std::vector<double> radii(joints.size(), 0.5 * look.diameter);
    const render::WireAttenuation mu{all(1.0), all(3.0), {}, {}};
    const render::WireShadow plain{joints, look, mu}, same{joints, look, mu, nullptr, radii};
    WireImage image;
    const auto shown = [&](const render::WireShadow& shadow) {
        std::vector<double> all(static_cast<std::size_t>(arm.pixels) * arm.pixels, 1.0);
        for (const auto& pixel : image.cast(arm, {&shadow, 1})) all[pixel.index] = pixel.transmission[0];
        return all;
    };
    // Points that matter by less than 0.01 mm are left out.
    const std::vector<double> a = shown(plain), b = shown(same);
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 0.08);
}

TEST(WireImage, OfRadiiThatAreNoneIsEmpty) {
    WireImage image;
    const CArm arm;
    const Polyline joints = straight(20, 4);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const std::vector<double>& radii : std::vector<std::vector<double>>{
             {1, 1}, {1, 1, nan, 1, 1}, {1, 1, -1, 1, 1}, {0, 0, 0, 0, 0}, {1, 1, 1, 1, 1e300}}) {
        const render::WireShadow shadow{joints, {}, {all(1.0), all(1.0), {}, {}}, nullptr, radii};
        for (const auto& pixel : image.cast(arm, {&shadow, 1}))
            EXPECT_TRUE(pixel.transmission[0] >= 0 && pixel.transmission[0] <= 1);
        if (radii.back() < 1e300) {
            EXPECT_TRUE(image.cast(arm, {&shadow, 1}).empty());
        }
    }
    // A step: two joints at one place.
    const Polyline step{Vec3(-5, 0, 0), Vec3(0, 0, 0), Vec3(0, 0, 0), Vec3(5, 0, 0)};
    const std::vector<double> radii{1, 1, 2, 2};
    const render::WireShadow shadow{step, {}, {all(1.0), all(1.0), {}, {}}, nullptr, radii};
    EXPECT_FALSE(image.cast(arm, {&shadow, 1}).empty());
}

TEST(WireImage, BandsArePlatinumWhereTheyAre) {
    const Polyline joints = wandering(31);
    WireLook look{.diameter = 1.0, .marker_length = 0, .bands = {5, 25}};
    const render::WireAttenuation mu{{}, {}, {}, all(1e-3)};
    WireImage image;
    const CArm onto{.isocentre = joints[15], .detector_width = 60, .pixels = 512};
    const auto cast = image.cast(onto, joints, look, mu);
    const double volume = 2 * M_PI * (0.55 * 0.55 - 0.5 * 0.5) * WireLook::band_length;
    EXPECT_NEAR(mass_of(cast, onto) / (1e-3 * volume), 1, 0.01);
    // Each about its place, 5 and 25 mm from the tip.
    for (const std::size_t joint : {25u, 5u}) {
        const render::Pixel at = render::project(onto, joints[joint]);
        double sum = 0, x = 0, y = 0;
        for (const auto& pixel : cast) {
            const double dx = pixel.index % 512 + 0.5 - at.x, dy = pixel.index / 512 + 0.5 - at.y;
            if (std::hypot(dx, dy) > 60) continue;
            const double removed = 1 - pixel.transmission[0];
            sum += removed, x += removed * dx, y += removed * dy;
        }
        EXPECT_NEAR(x / sum, 0, 0.5);
        EXPECT_NEAR(y / sum, 0, 0.5);
    }
    // One beyond the hub is not there, one at the tip by half.
    look.bands = {0, 500};
    EXPECT_NEAR(mass_of(image.cast(onto, joints, look, mu), onto) / (1e-3 * volume / 4), 1,
                0.05);  // nearer the source
    // Beside the wire itself: what both remove, and without a band to the bit what there was.
    look.bands = {10};
    const render::WireAttenuation both{all(1e-3), {}, {}, all(1e-3)};
    const double with = mass_of(image.cast(onto, joints, look, both), onto);
    look.bands.clear();
    EXPECT_NEAR((with - mass_of(image.cast(onto, joints, look, both), onto)) / (1e-3 * volume / 2), 1, 0.02);
}

TEST(WireImage, CastsAsManyDevicesAsThereAre) {
    const CArm arm;
    const WireLook look;
    const render::WireAttenuation mu{all(0.5), all(2.0), {}, {}};
    std::vector<Polyline> lines;
    for (int i = 0; i < 20; ++i) {
        lines.push_back(straight(60, 30));
        for (Vec3& p : lines.back()) p.z() += 4 * (i - 10);
    }
    std::vector<render::WireShadow> shadows;
    for (const Polyline& line : lines) shadows.push_back({line, look, mu});
    WireImage all_at_once, one;
    std::vector<render::WirePixel> expected;
    for (const render::WireShadow& shadow : shadows) {
        const auto cast = one.cast(arm, {&shadow, 1});
        expected.insert(expected.end(), cast.begin(), cast.end());
    }
    const auto cast = all_at_once.cast(arm, shadows);
    ASSERT_EQ(cast.size(), expected.size());
    for (std::size_t i = 0; i < cast.size(); ++i) {
        EXPECT_EQ(cast[i].index, expected[i].index);
        EXPECT_EQ(cast[i].transmission, expected[i].transmission);
    }
}

}  // namespace
