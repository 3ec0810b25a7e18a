#include "render/xray/struts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "physics/geometry/maths.h"

namespace render {
namespace {

using geometry::Polyline;
using geometry::Vec3;

/// Of the points in a wave, within a turn of its phase [rad]: few on the flanks, more at the crowns, so that
/// pieces between them stray by at most 2 % of the amplitude.
constexpr int points_per_wave = 12;
constexpr std::array<double, points_per_wave> phases = [] {
    std::array<double, points_per_wave> all{};
    constexpr std::array<double, 6> half = {0, 50, 72, 90, 108, 130};  // [°]
    for (std::size_t k = 0; k < all.size(); ++k)
        all[k] = (half[k % 6] + (k < 6 ? 0 : 180)) * std::numbers::pi / 180;
    return all;
}();
constexpr double most_points = 2e5;

/// A point of the axis.
struct Station {
    Vec3 at;
    double radius = 0;  // [mm]
    double arc = 0;     // from the first [mm]
    Vec3 tangent = Vec3::Zero(), across = Vec3::Zero();
};

Vec3 mirrored(const Vec3& v, const Vec3& along) {
    const double square = along.squaredNorm();
    return square > 0 ? Vec3(v - (2 * v.dot(along) / square) * along) : v;
}

/// Frames that do not turn about the axis, by two reflections from each to the next (Wang, Jüttler, Zheng,
/// Liu, Computation of rotation minimizing frames, ACM Trans. Graph. 27, 2008).
void carry_frames(std::vector<Station>& stations) {
    const std::size_t count = stations.size();
    const auto direction = [&](std::size_t i) -> Vec3 {
        return (stations[i + 1].at - stations[i].at).normalized();
    };
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 before = direction(i > 0 ? i - 1 : 0), after = direction(std::min(i, count - 2));
        const Vec3 sum = before + after;
        // Folded back on itself it has no tangent between the two.
        stations[i].tangent = sum.norm() > 1e-6 ? Vec3(sum.normalized()) : after;
    }
    Station& first = stations.front();
    first.across = first.tangent.unitOrthogonal();
    for (std::size_t i = 0; i + 1 < count; ++i) {
        const Station& from = stations[i];
        Station& to = stations[i + 1];
        const Vec3 way = to.at - from.at;
        const Vec3 across = mirrored(from.across, way), tangent = mirrored(from.tangent, way);
        to.across = mirrored(across, to.tangent - tangent);
        to.across = (to.across - to.across.dot(to.tangent) * to.tangent).normalized();
    }
}

}  // namespace

Polyline struts(std::span<const Vec3> axis, std::span<const double> radii, int crowns, double pitch) {
    if (axis.size() != radii.size() || crowns < 1 || !(pitch > 0) || !std::isfinite(pitch)) return {};
    std::vector<Station> stations;
    for (std::size_t i = 0; i < axis.size(); ++i) {
        if (!axis[i].allFinite() || !std::isfinite(radii[i])) return {};
        Station station{axis[i], std::max(0.0, radii[i])};
        if (!stations.empty()) {
            const double way = (axis[i] - stations.back().at).norm();
            if (!(way > 1e-6)) continue;
            station.arc = stations.back().arc + way;
        }
        stations.push_back(station);
    }
    if (stations.size() < 2) return {};
    carry_frames(stations);

    const double length = stations.back().arc, waves = (crowns + 0.5) * length / pitch;
    if (!(points_per_wave * waves < most_points)) return {};
    constexpr double turn = 2 * std::numbers::pi;
    const double last = turn * waves;  // phase
    Polyline line;
    line.reserve(static_cast<std::size_t>(points_per_wave * waves) + 3);
    double phase = 0;
    for (int k = 0; phase < last; ++k) {
        phase = std::min(turn * (k / points_per_wave) + phases[static_cast<std::size_t>(k % points_per_wave)],
                         last);
        const double middle = length * phase / last;  // of the turn, along the axis
        const double amplitude = std::min({0.5 * pitch, middle, length - middle});
        const double arc = std::clamp(middle + amplitude * geometry::sin(phase), 0.0, length);
        const auto after =
            std::clamp(std::upper_bound(stations.begin(), stations.end(), arc,
                                        [](double value, const Station& s) { return value < s.arc; }),
                       stations.begin() + 1, stations.end() - 1);
        const Station &a = *(after - 1), &b = *after;
        const double t = (arc - a.arc) / (b.arc - a.arc);
        const Vec3 mixed = a.tangent + t * (b.tangent - a.tangent);
        const Vec3 tangent = mixed.norm() > 1e-6 ? Vec3(mixed.normalized()) : a.tangent;
        Vec3 across = a.across + t * (b.across - a.across);
        across -= across.dot(tangent) * tangent;
        across = across.norm() > 1e-6 ? Vec3(across.normalized()) : tangent.unitOrthogonal();
        const auto [sine, cosine] = geometry::sin_cos(turn * middle / pitch);
        const double radius = a.radius + t * (b.radius - a.radius);
        line.push_back(a.at + t * (b.at - a.at) + radius * (cosine * across + sine * tangent.cross(across)));
    }
    return line;
}

}  // namespace render
