#include "render/xray/struts.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

#include "physics/geometry/polyline.h"
#include "physics/geometry/random.h"
#include "render/xray/wire_image.h"

namespace {

using geometry::Polyline;
using geometry::Vec3;
using render::struts;

/// An arc of that radius, 0 = straight [mm].
Polyline arc(double length, double step, double bend = 0) {
    Polyline points;
    const int pieces = static_cast<int>(std::ceil(length / step));
    for (int i = 0; i <= pieces; ++i) {
        const double s = length * i / pieces;
        points.push_back(bend > 0 ? Vec3(bend * std::sin(s / bend), 0, bend * (1 - std::cos(s / bend)))
                                  : Vec3(s - 0.5 * length, 0, 0));
    }
    return points;
}

/// Of the wave that the header describes, with its ends.
double exact_length(double length, double radius, int crowns, double pitch) {
    const int pieces = 400000;
    double sum = 0, last = 0;
    for (int i = 1; i <= pieces; ++i) {
        const double middle = length * i / pieces;
        const double amplitude = std::min({0.5 * pitch, middle, length - middle});
        const double z = middle + amplitude * std::sin(2 * M_PI * (crowns + 0.5) * middle / pitch);
        sum += std::hypot(z - last, 2 * M_PI * radius * length / pieces / pitch);
        last = z;
    }
    return sum;
}

double distance_to(const Polyline& axis, const Vec3& x) {
    double nearest = 1e9;
    for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
        const double t = geometry::closest_fraction(axis[i], axis[i + 1], x);
        nearest = std::min(nearest, (axis[i] + t * (axis[i + 1] - axis[i]) - x).norm());
    }
    return nearest;
}

struct Kind {
    double length, radius;
    int crowns;
    double pitch, strut;
    double covered;  // as documented
};
constexpr Kind coronary{18, 1.5, 9, 1, 0.08, 0.186}, renal{18, 3, 8, 2, 0.15, 0.16},
    iliac{38, 4, 8, 2, 0.2, 0.174};

TEST(Struts, AreAsLongAsTheirWaveAndCoverWhatIsSaid) {
    for (const Kind& kind : {coronary, renal, iliac}) {
        const Polyline axis = arc(kind.length, 1);
        const std::vector<double> radii(axis.size(), kind.radius);
        const double length = geometry::length_of(struts(axis, radii, kind.crowns, kind.pitch));
        EXPECT_NEAR(length / exact_length(kind.length, kind.radius, kind.crowns, kind.pitch), 1, 0.015);
        EXPECT_NEAR(length * kind.strut / (2 * M_PI * kind.radius * kind.length), kind.covered, 0.01);
    }
}

TEST(Struts, LieOnTheSurfaceAndWithinTheAxis) {
    const Polyline axis = arc(30, 0.5);
    std::vector<double> radii;
    for (const Vec3& p : axis) radii.push_back(3 - 1.2 * std::exp(-p.x() * p.x() / 9));
    const Polyline line = struts(axis, radii, 8, 1.5);
    for (const Vec3& p : line) {
        EXPECT_GE(p.x(), -15 - 1e-9);
        EXPECT_LE(p.x(), 15 + 1e-9);
        const double i = std::clamp((p.x() + 15) / 0.5, 0.0, 59.999);
        const auto k = static_cast<std::size_t>(i);
        EXPECT_NEAR(std::hypot(p.y(), p.z()), radii[k] + (i - double(k)) * (radii[k + 1] - radii[k]), 1e-9);
    }
}

// Around bends of 15 mm the frame does not wind the wave up: in a plane bend a point at the same phase of
// each turn stays on the same side.
TEST(Struts, DoNotTwistInABend) {
    const Polyline axis = arc(20, 0.5, 15);
    const std::vector<double> radii(axis.size(), 2.0);
    for (const Vec3& p : struts(axis, radii, 8, 1.0)) EXPECT_NEAR(distance_to(axis, p), 2.0, 0.02);
    // The first and the last point are whole turns apart.
    const Polyline line = struts(axis, radii, 8, 1.0);
    EXPECT_NEAR(line.front().y() - axis.front().y(), line.back().y() - axis.back().y(), 1e-3);
    // A bend out of the plane carries the frame along as well.
    Polyline helix;
    for (int i = 0; i <= 200; ++i)
        helix.emplace_back(8 * std::cos(i / 40.0), 8 * std::sin(i / 40.0), 0.1 * i);
    double most = 0;
    const Polyline wound = struts(helix, std::vector<double>(helix.size(), 2.0), 8, 1.0);
    for (std::size_t i = 1; i < wound.size(); ++i) most = std::max(most, (wound[i] - wound[i - 1]).norm());
    EXPECT_LT(most, 0.8);
}

TEST(Struts, OfAnyAxisAreFinite) {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const Polyline two{Vec3(0, 0, 0), Vec3(5, 0, 0)};
    const std::vector<double> ones{1, 1};
    EXPECT_TRUE(struts({}, {}, 8, 1).empty());
    EXPECT_TRUE(struts(two, std::vector<double>{1}, 8, 1).empty());
    EXPECT_TRUE(struts(Polyline{two[0], two[0]}, ones, 8, 1).empty());
    EXPECT_TRUE(struts(two, ones, 0, 1).empty());
    for (const double pitch : {0.0, -1.0, nan, inf, 1e-9}) EXPECT_TRUE(struts(two, ones, 8, pitch).empty());
    EXPECT_TRUE(struts(Polyline{Vec3(0, nan, 0), two[1]}, ones, 8, 1).empty());
    EXPECT_TRUE(struts(two, std::vector<double>{1, inf}, 8, 1).empty());
    EXPECT_FALSE(struts(two, ones, 8, 1).empty());
    EXPECT_FALSE(struts(two, std::vector<double>{0, 1e-12}, 8, 1).empty());
    const Polyline back{Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(0, 0, 0)};  // on itself
    for (const Vec3& p : struts(back, std::vector<double>{1, 1, 1}, 8, 1)) EXPECT_TRUE(p.allFinite());

    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        geometry::Random uniform(seed);
        Polyline axis{Vec3::Zero()};
        std::vector<double> radii{5 * uniform()};
        const int count = 2 + static_cast<int>(30 * uniform());
        for (int i = 1; i < count; ++i) {
            const double step = uniform() < 0.2 ? 0.0 : std::pow(10, 4 * uniform() - 3);
            axis.push_back(axis.back() + step * Vec3(uniform() - 0.2, uniform() - 0.5, uniform() - 0.5));
            radii.push_back(uniform() < 0.2 ? 1e-9 * uniform() : 5 * uniform());
        }
        const int crowns = 1 + static_cast<int>(15 * uniform());
        const double pitch = 0.3 + 4 * uniform();
        const Polyline line = struts(axis, radii, crowns, pitch);
        const double length = geometry::length_of(axis);
        EXPECT_EQ(line.empty(), length == 0);
        const double widest = std::ranges::max(radii);
        for (const Vec3& p : line) {
            ASSERT_TRUE(p.allFinite());
            ASSERT_LE(distance_to(axis, p), widest + 1e-6);
        }
    }
}

TEST(Struts, ImageHasTheMassOfTheMetal) {
    const render::CArm arm{.detector_width = 80, .pixels = 512};
    render::Bins mu;
    mu.fill(1e-3);
    for (const Kind& kind : {coronary, renal, iliac}) {
        const Polyline axis = arc(kind.length, 1);
        const Polyline line =
            struts(axis, std::vector<double>(axis.size(), kind.radius), kind.crowns, kind.pitch);
        render::WireLook look;
        look.diameter = kind.strut;
        look.marker_length = 0;
        render::WireImage image;
        double removed = 0;
        const render::WireShadow shadow{line, look, {mu, mu, {}, {}}, nullptr, {}, true};
        for (const auto& pixel : image.cast(arm, {&shadow, 1})) removed += 1 - pixel.transmission[0];
        removed *= std::pow(render::pixel_width(arm) * arm.sod / arm.sid, 2);
        const double volume = M_PI / 4 * kind.strut * kind.strut *
                              exact_length(kind.length, kind.radius, kind.crowns, kind.pitch);
        EXPECT_NEAR(removed / (1e-3 * volume), 1, 0.02);
    }
}

}  // namespace
