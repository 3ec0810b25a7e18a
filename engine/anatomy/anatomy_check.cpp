#include "engine/anatomy/anatomy_check.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/anatomy/mesh_quality.h"
#include "engine/io/text.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wire/guidewire_presets.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using Verdict = Check::Verdict;

/// In lumens 86 % or more of the rays cross once, between the two sides of a wall 57 % or fewer.
constexpr double least_once = 0.75;
constexpr double least_median = 0.2, largest_median = 20;  // of the median [mm]
constexpr double largest_edge_ratio = 1.5;
constexpr int most_rays = 20'000;

Verdict failed_unless(bool fine) {
    return fine ? Verdict::Pass : Verdict::Fail;
}
Verdict warned_unless(bool fine) {
    return fine ? Verdict::Pass : Verdict::Warning;
}

struct Unit {
    const char* name;
    double mm;
};
constexpr Unit units[] = {{"mm", 1}, {"cm", 10}, {"m", 1000}};

/// Units in which the vessels would have a usual size.
std::string other_units(double median, const std::string& taken) {
    const Unit* used =
        std::find_if(std::begin(units), std::end(units), [&](const Unit& u) { return u.name == taken; });
    std::string text;
    for (const Unit& unit : units) {
        const double radius = median / used->mm * unit.mm;
        if (&unit == used || radius < least_median || radius > largest_median) continue;
        text +=
            fmt::format("{}--unit {} would make it {:.2g} mm", text.empty() ? " (" : ", ", unit.name, radius);
    }
    return text.empty() ? text : text + ")";
}

Check surface_crossings(const TriangleMesh& mesh) {
    const auto pairs = crossing_pairs(mesh);
    std::string found = std::to_string(pairs.size());
    if (!pairs.empty()) {
        const auto& t = mesh.triangles[pairs[0].first];
        found += " pairs, the first at " +
                 io::place_text((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
    }
    return {"triangles that cross", found, "0", warned_unless(pairs.empty())};
}

Check narrowest(const Anatomy& anatomy) {
    const double thinnest = thinnest_wire_radius();
    double least = std::numeric_limits<double>::infinity();
    std::string where;
    std::vector<std::string_view> fitting;
    for (const auto& branch : anatomy.branches) {
        for (std::size_t i = 0; i < branch.radii.size(); ++i) {
            if (branch.radii[i] >= least) continue;
            least = branch.radii[i];
            where = fmt::format("{}, sample {} at {}", branch.name, i, io::place_text(branch.points[i]));
        }
    }
    for (const physics::GuidewirePreset& preset : physics::guidewire_presets()) {
        if (preset.spec.diameter / 2 <= least) fitting.push_back(preset.name);
    }
    return {"smallest radius",
            fmt::format("{:.3f} mm in {}; passed by: {}", least, where,
                        fitting.empty() ? "no wire" : io::joined(fitting, " ")),
            fmt::format("{:.3f} mm, the thinnest wire's, or more", thinnest),
            failed_unless(least >= thinnest)};
}

std::vector<Check> centreline_checks(const Anatomy& anatomy, const TriangleMesh& closed) {
    const geometry::MeshQuery wall(anatomy.lumen), whole(closed);
    int samples = 0, outside = 0;
    double ratio = 0;
    std::string where_outside, where_ratio;
    for (const auto& branch : anatomy.branches) {
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const Vec3& p = branch.points[i];
            const bool at_end =
                std::any_of(anatomy.ends.begin(), anatomy.ends.end(), [&](const VesselEnd& end) {
                    return (p - end.opening.centre).norm() < 2 * end.opening.radius;
                });
            if (at_end) continue;
            ++samples;
            const std::string where = fmt::format("{}, sample {} at {}", branch.name, i, io::place_text(p));
            if (!whole.encloses(p)) {
                if (outside++ == 0) where_outside = ", the first in " + where;
                continue;
            }
            if (const double own = branch.radii[i] / wall.distance(p); own > ratio)
                ratio = own, where_ratio = where;
        }
    }
    return {{"centreline samples outside the lumen",
             fmt::format("{} of {}{}", outside, samples, where_outside), "0", failed_unless(outside == 0)},
            {"radius over the distance to the wall", fmt::format("{:.2f} at most, in {}", ratio, where_ratio),
             "1.25 or less", warned_unless(ratio <= 1.25)}};
}

Check ends_reached(const Anatomy& anatomy) {
    std::vector<std::string> missed;
    for (const VesselEnd& end : anatomy.ends) {
        double least = std::numeric_limits<double>::infinity();
        for (const auto& branch : anatomy.branches)
            for (const Vec3& p : {branch.points.front(), branch.points.back()})
                least = std::min(least, (p - end.opening.centre).norm());
        if (least > end.opening.radius)
            missed.push_back(fmt::format("{} by {:.2f} mm", end.opening.name, least));
    }
    return {"ends that no centreline reaches", missed.empty() ? "0" : io::joined(missed), "0",
            failed_unless(missed.empty())};
}

}  // namespace

std::string text_of(const Check& check) {
    const char* verdict = check.verdict == Verdict::Pass   ? "pass"
                          : check.verdict == Verdict::Fail ? "FAIL"
                                                           : "note";
    return fmt::format("{}  {}: {}; accepted: {}", verdict, check.what, check.found, check.accepted);
}

double thinnest_wire_radius() {
    double thinnest = std::numeric_limits<double>::infinity();
    for (const physics::GuidewirePreset& preset : physics::guidewire_presets())
        thinnest = std::min(thinnest, preset.spec.diameter / 2);
    return thinnest;
}

SurfaceFigures surface_figures(const TriangleMesh& closed) {
    const geometry::MeshQuery query(closed);
    const int total = static_cast<int>(closed.triangles.size()), stride = std::max(1, total / most_rays);
    std::vector<double> radii, ratios;
    int once = 0, rays = 0;
    for (int i = 0; i < total; i += stride) {
        const auto& t = closed.triangles[i];
        const Vec3 &a = closed.vertices[t[0]], &b = closed.vertices[t[1]], &c = closed.vertices[t[2]];
        const Vec3 normal = (b - a).cross(c - a);
        if (normal.norm() == 0) continue;
        const Vec3 origin = (a + b + c) / 3, inward = -normal.normalized();
        const double edge = ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3, skip = 1e-3 * edge;
        ++rays;
        const int crossed = query.crossings(origin + skip * inward, inward);
        once += crossed == 1;
        if (crossed == 0) continue;
        radii.push_back((skip + query.first_hit(origin + skip * inward, inward)) / 2);
        ratios.push_back(edge / radii.back());
    }
    SurfaceFigures figures;
    if (radii.empty()) return figures;
    std::sort(radii.begin(), radii.end());
    std::sort(ratios.begin(), ratios.end());
    figures.once = static_cast<double>(once) / rays;
    figures.median_radius = radii[radii.size() / 2];
    figures.thin_radius = radii[radii.size() / 50];
    figures.edge_ratio = ratios[ratios.size() / 2];
    return figures;
}

std::vector<Check> surface_checks(const SurfaceFigures& figures, const std::string& unit) {
    const bool usual = figures.median_radius >= least_median && figures.median_radius <= largest_median;
    const std::string range = fmt::format("{} to {} mm{}", least_median, largest_median,
                                          usual ? "" : other_units(figures.median_radius, unit));
    return {{"median radius", fmt::format("{:.3g} mm", figures.median_radius), range, failed_unless(usual)},
            {"rays inward that cross the surface once", fmt::format("{:.0f} %", 100 * figures.once),
             fmt::format("{:.0f} % or more, as a lumen has and the two sides of a vessel wall have not",
                         100 * least_once),
             failed_unless(figures.once >= least_once)},
            {"median edge", fmt::format("{:.2f} of the radius", figures.edge_ratio),
             fmt::format("{} or less; a coarser mesh needs to be made finer, or centrelines beside it",
                         largest_edge_ratio),
             failed_unless(figures.edge_ratio <= largest_edge_ratio)}};
}

std::vector<Check> anatomy_checks(const Anatomy& anatomy) {
    const geometry::Topology edges = geometry::topology(anatomy.lumen);
    const TriangleMesh closed = geometry::capped(anatomy.lumen, edges.loops);
    std::vector<Check> checks = {
        {"triangles", std::to_string(anatomy.lumen.triangles.size()), "any number", Verdict::Pass},
        {"edges of three or more triangles", std::to_string(edges.non_manifold_edges), "0",
         failed_unless(edges.non_manifold_edges == 0)},
        {"openings that are not ends",
         std::to_string(edges.loops.size() - std::min(edges.loops.size(), anatomy.ends.size())), "0",
         failed_unless(edges.loops.size() <= anatomy.ends.size())},
        {"volume", fmt::format("{:.4g} mm³", geometry::signed_volume(closed)), "above 0, normals outward",
         failed_unless(geometry::signed_volume(closed) > 0)},
        {"open ends", std::to_string(anatomy.ends.size()), "2 or more",
         failed_unless(anatomy.ends.size() >= 2)}};
    const int loops = 1 - euler_characteristic(closed) / 2;
    checks.push_back(
        {"loops of vessels", std::to_string(loops), "0, and loops are kept", warned_unless(loops == 0)});
    const auto append = [&checks](const std::vector<Check>& more) {
        checks.insert(checks.end(), more.begin(), more.end());
    };
    append(surface_checks(surface_figures(closed)));
    checks.push_back(surface_crossings(anatomy.lumen));
    checks.push_back(narrowest(anatomy));
    append(centreline_checks(anatomy, closed));
    checks.push_back(ends_reached(anatomy));
    return checks;
}

}  // namespace anatomy
