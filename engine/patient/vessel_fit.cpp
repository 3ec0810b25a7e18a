#include "engine/patient/vessel_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <vector>

#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

using geometry::Mat3;
using geometry::Vec3;

constexpr int air_below = -900;     // [HU]
constexpr int tissue_above = -400;  // [HU]
constexpr double good_fit = 0.05;   // of a placement that is worth proposing

/// Places spread evenly over a surface (R2 sequence of M. Roberts, 2018, in each triangle).
std::vector<Vec3> places_on(const geometry::TriangleMesh& wall) {
    constexpr int count = 20000;
    constexpr double first = 0.7548776662466927, second = 0.5698402909980532;
    std::vector<double> area;  // of all triangles up to each
    for (const auto& t : wall.triangles) {
        const Vec3 &a = wall.vertices[t[0]], &b = wall.vertices[t[1]], &c = wall.vertices[t[2]];
        area.push_back((area.empty() ? 0 : area.back()) + 0.5 * (b - a).cross(c - a).norm());
    }
    std::vector<Vec3> places;
    if (area.empty() || !(area.back() > 0)) return places;
    for (int k = 0; k < count; ++k) {
        const double at = (k + 0.5) / count * area.back();
        const auto& t =
            wall.triangles[static_cast<std::size_t>(std::ranges::lower_bound(area, at) - area.begin())];
        double u = std::fmod(first * k, 1.0), v = std::fmod(second * k, 1.0);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3& a = wall.vertices[t[0]];
        places.push_back(a + u * (wall.vertices[t[1]] - a) + v * (wall.vertices[t[2]] - a));
    }
    return places;
}

/// Turned about the origin, then moved.
VesselFit fit_of(const CtImage& ct, const std::vector<Vec3>& wall, const Mat3& turn, const Vec3& shift) {
    if (wall.empty()) return {};
    const Mat3 to_index = ct.grid.axes().inverse();
    std::size_t outside = 0, in_air = 0;
    for (const Vec3& x : wall) {
        const Vec3 at = to_index * (turn * x + shift - ct.grid.origin);
        std::array<int, 3> n{};
        bool within = true;
        for (int a = 0; a < 3; ++a) {
            within = within && at[a] > -0.5 && at[a] < ct.grid.size[a] - 0.5;
            if (within) n[a] = static_cast<int>(std::lround(at[a]));
        }
        if (!within)
            ++outside;
        else if (ct.hu[ct.grid.index(n[0], n[1], n[2])] < air_below)
            ++in_air;
    }
    const auto count = static_cast<double>(wall.size());
    return {static_cast<double>(outside) / count, static_cast<double>(in_air) / count};
}

struct Box {
    Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9);

    void add(const Vec3& x) { low = low.cwiseMin(x), high = high.cwiseMax(x); }
    Vec3 middle() const { return 0.5 * (low + high); }
};

/// Middle of the box around what is denser than air.
Vec3 middle_of_body(const CtImage& ct) {
    constexpr int every = 4;
    Box box;
    for (int k = 0; k < ct.grid.size[2]; k += every)
        for (int j = 0; j < ct.grid.size[1]; j += every)
            for (int i = 0; i < ct.grid.size[0]; i += every)
                if (ct.hu[ct.grid.index(i, j, k)] > tissue_above) box.add(ct.grid.at(i, j, k));
    return box.middle();
}

/// About x, then y, then z [degrees], as turn_by takes them.
Vec3 angles_of(const Mat3& turn) {
    Vec3 angles(std::atan2(turn(2, 1), turn(2, 2)),
                std::atan2(-turn(2, 0), std::hypot(turn(2, 1), turn(2, 2))),
                std::atan2(turn(1, 0), turn(0, 0)));
    angles /= geometry::degree;
    for (double& angle : angles)
        if (angle < -179.5) angle += 360;
    return angles;
}

std::string text_of(const Vec3& v) {
    std::array<long, 3> whole{};
    for (int a = 0; a < 3; ++a) whole[a] = std::lround(v[a]);  // no -0
    return fmt::format("[{}, {}, {}]", whole[0], whole[1], whole[2]);
}

}  // namespace

VesselFit vessel_fit(const CtImage& ct, const geometry::TriangleMesh& wall) {
    return fit_of(ct, places_on(wall), Mat3::Identity(), Vec3::Zero());
}

std::string better_placement(const CtImage& ct, const geometry::TriangleMesh& whole, const Mat3& turned,
                             const Vec3& moved) {
    const std::vector<Vec3> wall = places_on(whole);
    const Vec3 body = middle_of_body(ct);
    for (const bool moves : {false, true})
        for (const int axis : {-1, 2, 0, 1}) {
            const Mat3 turn = axis < 0 ? Mat3::Identity() : Mat3(Eigen::AngleAxisd(M_PI, Vec3::Unit(axis)));
            Box box;
            for (const Vec3& x : wall) box.add(turn * x);
            // Whole millimetres, as they are told.
            const Vec3 shift = moves ? Vec3((body - box.middle()).array().round()) : Vec3(Vec3::Zero());
            if (fit_of(ct, wall, turn, shift).wrong() > good_fit) continue;
            // The keys move the CT to the vessels, where it is now to turnᵀ (x − shift).
            std::string text;
            const Vec3 about = angles_of(turn.transpose() * turned);
            const Vec3 by = turn.transpose() * (moved - shift);
            if (axis >= 0) text = "rotation_deg = " + text_of(about);
            if (moves || moved != Vec3::Zero())
                text += (text.empty() ? "shift_mm = " : " and shift_mm = ") + text_of(by);
            return text;
        }
    return {};
}

std::string require_fit(const CtImage& ct, const geometry::TriangleMesh& wall, const PatientFiles& files) {
    const bool partial = files.partial;
    const VesselFit fit = vessel_fit(ct, wall);
    constexpr double worth_a_word = 0.01;
    if (fit.wrong() < worth_a_word) return {};
    const std::string found =
        fmt::format("{:.0f} % of the vessels' wall lie outside it, and {:.0f} % in its air",
                    100 * fit.outside, 100 * fit.in_air);
    if ((partial ? fit.in_air : fit.wrong()) <= most_wrong) return "of the CT: " + found;
    const std::string other = better_placement(ct, wall, turn_by(files.rotation), files.shift);
    const bool half_turn = other.starts_with("rotation_deg = [0, 0, 180]");
    refuse_ct(
        files.ct, found,
        fmt::format("expected vessels of this patient, in its coordinates, at most {:.0f} % outside{}{}{}",
                    100 * most_wrong,
                    other.empty() ? "" : fmt::format("; {} in [patient] would bring them together", other),
                    half_turn ? ", or vessels imported with the other --axes" : "",
                    partial || fit.in_air > most_wrong
                        ? ""
                        : "; partial = true says that it shows only some of the vessels"));
}

}  // namespace patient
