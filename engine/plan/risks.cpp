#include "engine/plan/risks.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/vessel_paths.h"

namespace plan {
namespace {

struct Sample {
    geometry::Vec3 at;
    double radius;
    int branch, sample;
};

std::vector<Sample> samples_of(const anatomy::Anatomy& anatomy,
                               const std::vector<anatomy::VesselPaths::Piece>& route) {
    std::vector<Sample> samples;
    for (const auto& piece : route) {
        const auto& branch = anatomy.branches[static_cast<std::size_t>(piece.branch)];
        const int step = piece.to >= piece.from ? 1 : -1;
        for (int k = piece.from; k != piece.to + step; k += step)
            samples.push_back({branch.points[static_cast<std::size_t>(k)],
                               branch.radii[static_cast<std::size_t>(k)], piece.branch, k});
    }
    return samples;
}

double along_of(const anatomy::Anatomy& anatomy, const Sample& sample) {
    return anatomy::along(anatomy, {sample.branch, sample.sample, 0});
}

const std::string& name_of(const anatomy::Anatomy& anatomy, const Sample& sample) {
    return anatomy.branches[static_cast<std::size_t>(sample.branch)].name;
}

/// Radius of the circle through places one vessel's diameter before and after; infinite for a straight way.
double bend_at(const std::vector<Sample>& way, std::size_t k) {
    const double reach = 2 * way[k].radius;
    std::size_t before = k, after = k;
    // A turn into another branch is no bend.
    const auto same = [&](std::size_t other) { return way[other].branch == way[k].branch; };
    while (before > 0 && same(before - 1) && (way[before].at - way[k].at).norm() < reach) --before;
    while (after + 1 < way.size() && same(after + 1) && (way[after].at - way[k].at).norm() < reach) ++after;
    const geometry::Vec3 a = way[k].at - way[before].at, b = way[after].at - way[k].at;
    if (a.norm() < 0.7 * reach || b.norm() < 0.7 * reach) return std::numeric_limits<double>::infinity();
    const double area = a.cross(b).norm();
    return area > 1e-9 ? a.norm() * b.norm() * (a + b).norm() / (2 * area)
                       : std::numeric_limits<double>::infinity();
}

std::optional<Risk> arch_type(const anatomy::Anatomy& anatomy,
                              const std::vector<anatomy::VesselPaths::Piece>& route) {
    const auto trunk = anatomy::branch_named(anatomy, "brachiocephalic"),
               carotid = anatomy::branch_named(anatomy, "LCCA");
    if (!trunk || !carotid) return std::nullopt;
    const auto& mouth = anatomy.branches[static_cast<std::size_t>(*trunk)];
    if (std::ranges::none_of(route, [&](const auto& piece) { return piece.branch == mouth.parent; }))
        return std::nullopt;
    const auto& aorta = anatomy.branches[static_cast<std::size_t>(mouth.parent)];
    // Of the centrelines, as the presets are drawn: that of the trunk begins on the aorta's.
    double top = -std::numeric_limits<double>::infinity();
    for (const geometry::Vec3& point : aorta.points) top = std::max(top, point.z());
    const auto& left = anatomy.branches[static_cast<std::size_t>(*carotid)];
    const double height = top - mouth.points.front().z(), diameter = 2 * left.radii.front();
    const double ratio = height / diameter;
    const char* type = ratio < 1 ? "I" : ratio <= 2 ? "II" : "III";
    return Risk{"aortic arch",
                mouth.name,
                0,
                ratio,
                "diameters",
                fmt::format("The arch is of type {}: its top lies {:.0f} mm above the mouth of the "
                            "brachiocephalic trunk, {:.1f} diameters of {} ({:.1f} mm).",
                            type, height, ratio, left.name, diameter)};
}

}  // namespace

std::vector<Risk> risks(const anatomy::Anatomy& anatomy, const geometry::Vec3& from, const geometry::Vec3& to,
                        double thickest) {
    const anatomy::VesselPaths paths(anatomy);
    const auto route =
        paths.route(anatomy::nearest_place(anatomy, from), anatomy::nearest_place(anatomy, to));
    const std::vector<Sample> way = samples_of(anatomy, route);
    std::vector<Risk> all;
    if (way.size() < 3) return all;
    // The sharpest of each branch.
    for (const auto& piece : route) {
        std::optional<Risk> bend, thin;
        for (std::size_t k = 0; k < way.size(); ++k) {
            if (way[k].branch != piece.branch) continue;
            const double radius = bend_at(way, k), most = 4 * way[k].radius;
            const double place = along_of(anatomy, way[k]);
            if (place < anatomy::origin_of(anatomy, piece.branch)) continue;
            if (radius < most && (!bend || radius < bend->value))
                bend = Risk{
                    "sharp bend",
                    name_of(anatomy, way[k]),
                    place,
                    radius,
                    "mm",
                    fmt::format("{} bends with a radius of {:.0f} mm, {:.1f} of its diameters, {:.0f} mm "
                                "along it.",
                                name_of(anatomy, way[k]), radius, radius / (2 * way[k].radius), place)};
            const double room = 2 * way[k].radius - thickest;
            if (room < 0.3 && (!thin || 2 * way[k].radius < thin->value))
                thin = Risk{
                    "thin branch",
                    name_of(anatomy, way[k]),
                    place,
                    2 * way[k].radius,
                    "mm",
                    fmt::format("{} is {:.1f} mm wide, {:.0f} mm along it, where the thickest device has "
                                "{:.1f} mm.",
                                name_of(anatomy, way[k]), 2 * way[k].radius, place, thickest)};
        }
        if (bend) all.push_back(*bend);
        if (thin) all.push_back(*thin);
    }
    // Where the way turns from a vessel into one that leaves it.
    for (std::size_t k = 1; k < route.size(); ++k) {
        const auto& child = anatomy.branches[static_cast<std::size_t>(route[k].branch)];
        if (child.parent != route[k - 1].branch) continue;
        const double origin = anatomy::origin_of(anatomy, route[k].branch);
        std::size_t first = way.size();
        for (std::size_t i = 0; i < way.size(); ++i)
            if (way[i].branch == route[k].branch && along_of(anatomy, way[i]) >= origin) {
                first = i;
                break;
            }
        if (first >= way.size()) continue;
        const double reach = 2 * way[first].radius;
        std::size_t end = first, before = first;
        while (end + 1 < way.size() && (way[end].at - way[first].at).norm() < reach) ++end;
        while (before > 0 && way[before].branch != route[k - 1].branch) --before;
        std::size_t earlier = before;
        while (earlier > 0 && (way[earlier].at - way[before].at).norm() < way[before].radius) --earlier;
        const geometry::Vec3 in = way[before].at - way[earlier].at, out = way[end].at - way[first].at;
        if (in.norm() < 1e-6 || out.norm() < 1e-6) continue;
        const double angle =
            std::acos(std::clamp(in.normalized().dot(out.normalized()), -1.0, 1.0)) / geometry::degree;
        if (angle > 60)
            all.push_back({"angle of take-off", child.name, origin, angle, "deg",
                           fmt::format("{} is entered by a turn of {:.0f} degrees.", child.name, angle)});
        double narrow = way[first].radius, reference = 0;
        int count = 0;
        for (std::size_t i = first; i < way.size() && way[i].branch == route[k].branch; ++i) {
            const double past = along_of(anatomy, way[i]) - origin;
            if (past <= 8) narrow = std::min(narrow, way[i].radius);
            if (past > 12 && past < 30) reference += way[i].radius, ++count;
        }
        if (count > 0 && narrow < 0.5 * reference / count)
            all.push_back({"ostial stenosis", child.name, origin, 100 * (1 - narrow * count / reference), "%",
                           fmt::format("The mouth of {} is narrowed by {:.0f} % of the diameter.", child.name,
                                       100 * (1 - narrow * count / reference))});
    }
    if (const auto arch = arch_type(anatomy, route)) all.push_back(*arch);
    return all;
}

}  // namespace plan
