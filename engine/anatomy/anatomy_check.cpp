#include "engine/anatomy/anatomy_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <limits>
#include <set>
#include <unordered_map>

#include "engine/anatomy/anatomy.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

double smallest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto angle = [](const Vec3& u, const Vec3& v) {
        return geometry::atan2(u.cross(v).norm(), u.dot(v));
    };
    return std::min({angle(b - a, c - a), angle(c - b, a - b), angle(a - c, b - c)});
}

/// Whether the segment from p to q crosses the triangle (Möller and Trumbore 1997).
bool crosses(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 along = q - p, u = b - a, v = c - a, normal = along.cross(v);
    const double determinant = u.dot(normal);
    if (std::abs(determinant) < 1e-14) return false;
    const Vec3 from = p - a, other = from.cross(u);
    const double s = from.dot(normal) / determinant, t = along.dot(other) / determinant,
                 at = v.dot(other) / determinant;
    return s >= 0 && t >= 0 && s + t <= 1 && at >= 0 && at <= 1;
}

class Boxes {
public:
    explicit Boxes(const TriangleMesh& mesh) : mesh_(mesh) {
        double sum = 0;
        for (const auto& t : mesh.triangles) sum += (corner(t, 1) - corner(t, 0)).norm();
        edge_ = 2 * sum / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size()));
        for (int i = 0; i < static_cast<int>(mesh.triangles.size()); ++i)
            for_boxes(i, [&](std::uint64_t box) { held_[box].push_back(i); });
    }
    std::vector<std::pair<int, int>> crossing_pairs() const {
        std::vector<std::pair<int, int>> pairs;
        std::vector<int> near;
        for (int i = 0; i < static_cast<int>(mesh_.triangles.size()); ++i) {
            near.clear();
            for_boxes(i, [&](std::uint64_t box) {
                for (const int j : held_.at(box))
                    if (j > i) near.push_back(j);
            });
            std::ranges::sort(near);
            near.erase(std::unique(near.begin(), near.end()), near.end());
            for (const int j : near)
                if (cross(mesh_.triangles[i], mesh_.triangles[j])) pairs.emplace_back(i, j);
        }
        return pairs;
    }

private:
    using Triangle = std::array<int, 3>;
    const Vec3& corner(const Triangle& t, int k) const { return mesh_.vertices[t[k]]; }
    template <class Visit>
    void for_boxes(int triangle, Visit visit) const {
        const Triangle& t = mesh_.triangles[triangle];
        const Vec3 low = corner(t, 0).cwiseMin(corner(t, 1)).cwiseMin(corner(t, 2)) / edge_,
                   high = corner(t, 0).cwiseMax(corner(t, 1)).cwiseMax(corner(t, 2)) / edge_;
        const auto cell = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
        for (auto z = cell(low.z()); z <= cell(high.z()); ++z)
            for (auto y = cell(low.y()); y <= cell(high.y()); ++y)
                for (auto x = cell(low.x()); x <= cell(high.x()); ++x)
                    visit(static_cast<std::uint64_t>((z & 0x1fffff) << 42 | (y & 0x1fffff) << 21 |
                                                     (x & 0x1fffff)));
    }
    bool cross(const Triangle& s, const Triangle& t) const {
        for (const int a : s)
            for (const int b : t)
                if (a == b) return false;
        for (int k = 0; k < 3; ++k) {
            if (crosses(corner(s, k), corner(s, (k + 1) % 3), corner(t, 0), corner(t, 1), corner(t, 2)) ||
                crosses(corner(t, k), corner(t, (k + 1) % 3), corner(s, 0), corner(s, 1), corner(s, 2)))
                return true;
        }
        return false;
    }

    const TriangleMesh& mesh_;
    double edge_ = 1;
    std::unordered_map<std::uint64_t, std::vector<int>> held_;
};

using Verdict = Check::Verdict;

/// The inner side of a vessel wall, about half of its surface, looks into a tube; that of a lumen looks out.
constexpr double most_surrounded = 0.2;
/// Rays about the normal that find out, how many may escape, and from how many triangles they are cast.
constexpr int outward_rays = 16, most_escaped = 1, most_viewpoints = 3'000;
constexpr double least_median = 0.2, largest_median = 20;  // of the median [mm]
constexpr double largest_edge_ratio = 1.5;
constexpr int most_rays = 20'000;
constexpr double least_end_width = 0.6, most_askew = 45;  // of the radius behind; [deg]

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
    const Unit* used = std::ranges::find(units, taken, &Unit::name);
    std::string text;
    for (const Unit& unit : units) {
        const double radius = median / used->mm * unit.mm;
        if (&unit == used || radius < least_median || radius > largest_median) continue;
        text +=
            fmt::format("{}--unit {} would make it {:.2g} mm", text.empty() ? " (" : ", ", unit.name, radius);
    }
    return text.empty() ? text : text + ")";
}

/// Fraction of the triangles from which nearly every ray outward, spread by the cosine law about the normal,
/// meets the surface again.
double surrounded_fraction(const TriangleMesh& closed, const geometry::MeshQuery& query) {
    const int total = static_cast<int>(closed.triangles.size());
    const int stride = std::max(1, total / most_viewpoints);
    int surrounded = 0, seen = 0;
    for (int i = 0; i < total; i += stride) {
        const auto& t = closed.triangles[i];
        const Vec3 &a = closed.vertices[t[0]], &b = closed.vertices[t[1]], &c = closed.vertices[t[2]];
        const Vec3 area = (b - a).cross(c - a);
        if (area.norm() == 0) continue;
        const Vec3 normal = area.normalized(), u = normal.unitOrthogonal(), v = normal.cross(u);
        const Vec3 origin = (a + b + c) / 3 + 1e-3 * (b - a).norm() * normal;
        int escaped = 0;
        for (int k = 0; k < outward_rays && escaped <= most_escaped; ++k) {
            const double square = (k + 0.5) / outward_rays, angle = 2.399963 * k;  // the golden angle
            const Vec3 direction = std::sqrt(1 - square) * normal +
                                   std::sqrt(square) * (geometry::cos(angle) * u + geometry::sin(angle) * v);
            escaped += !std::isfinite(query.first_hit(origin, direction));
        }
        ++seen;
        surrounded += escaped <= most_escaped;
    }
    return seen > 0 ? static_cast<double>(surrounded) / seen : 0;
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
    double least = std::numeric_limits<double>::infinity();
    std::string where;
    std::string fitting;
    for (const auto& branch : anatomy.branches) {
        for (std::size_t i = 0; i < branch.radii.size(); ++i) {
            if (branch.radii[i] >= least) continue;
            least = branch.radii[i];
            where = fmt::format("{}, sample {} at {}", branch.name, i, io::place_text(branch.points[i]));
        }
    }
    constexpr double inch = 25.4;  // [mm]
    for (const double width : {0.014, 0.018, 0.035})
        if (0.5 * width * inch <= least + 1e-3) fitting += fmt::format(" {:g}", width);
    return {"smallest radius",
            fmt::format("{:.3f} mm in {}; passed by {}", least, where,
                        fitting.empty() ? "no wire" : "wires of" + fitting + " in"),
            fmt::format("{:.3f} mm, the thinnest wire's, or more", thinnest_wire_radius),
            failed_unless(least >= thinnest_wire_radius)};
}

std::vector<Check> centreline_checks(const Anatomy& anatomy, const TriangleMesh& closed) {
    const geometry::MeshQuery wall(anatomy.lumen), whole(closed);
    int samples = 0, outside = 0;
    double ratio = 0;
    std::string where_outside, where_ratio;
    for (const auto& branch : anatomy.branches) {
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const Vec3& p = branch.points[i];
            const bool at_end = std::ranges::any_of(anatomy.ends, [&](const VesselEnd& end) {
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

Check ends_that_go_on(const Anatomy& anatomy) {
    std::vector<std::string> closed;
    for (const BlockedEnd& blocked : blocked_ends(anatomy)) closed.push_back(text_of(anatomy, blocked));
    return {"ends past which an artery cannot go on", closed.empty() ? "0" : io::joined(closed, "; "),
            "0; an end clear of other branches for 14 of its radii", warned_unless(closed.empty())};
}

/// Ends much narrower than the vessel behind them, or askew to it.
std::vector<Check> end_checks(const Anatomy& anatomy, const geometry::MeshQuery& wall) {
    std::vector<std::string> narrow, askew;
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (const VesselEnd& end : anatomy.ends) {
        const geometry::OpenEnd& opening = end.opening;
        const double inside = ball_behind(wall, opening.centre, opening.outward_normal, opening.radius);
        const VesselPlace place = place_behind(anatomy, opening, opening.radius);
        const Vec3& behind = anatomy.branches[place.branch].points[place.sample];
        const Vec3 along = (opening.centre - behind).normalized();
        const double ratio = opening.radius / inside,
                     angle = geometry::acos(std::clamp(along.dot(opening.outward_normal), -1.0, 1.0)) /
                             geometry::degree;
        least = std::min(least, ratio), most = std::max(most, angle);
        if (ratio < least_end_width)
            narrow.push_back(fmt::format("{} has {:.2f} of {:.2f} mm", opening.name, opening.radius, inside));
        if (angle > most_askew) askew.push_back(fmt::format("{} by {:.0f}°", opening.name, angle));
    }
    return {{"radius of an end over that of the vessel behind it",
             narrow.empty() ? fmt::format("{:.2f} at least", least) : io::joined(narrow),
             fmt::format("{} or more: a vessel cut across", least_end_width), warned_unless(narrow.empty())},
            {"angle between an end and its vessel",
             askew.empty() ? fmt::format("{:.0f}° at most", most) : io::joined(askew),
             fmt::format("{:.0f}° or less", most_askew), warned_unless(askew.empty())}};
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

TriangleAngles smallest_angles(const TriangleMesh& mesh) {
    std::vector<double> angles;
    for (const auto& t : mesh.triangles)
        angles.push_back(smallest_angle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    if (angles.empty()) return {};
    std::ranges::sort(angles);
    return {angles.front(), angles[angles.size() / 100]};
}

int euler_characteristic(const TriangleMesh& mesh) {
    std::set<int> corners;
    std::vector<std::uint64_t> edges;
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            corners.insert(a);
            edges.push_back(static_cast<std::uint64_t>(std::min(a, b)) << 32 |
                            static_cast<std::uint32_t>(std::max(a, b)));
        }
    }
    std::ranges::sort(edges);
    const auto distinct = std::unique(edges.begin(), edges.end()) - edges.begin();
    return static_cast<int>(corners.size()) - static_cast<int>(distinct) +
           static_cast<int>(mesh.triangles.size());
}

std::vector<std::pair<int, int>> crossing_pairs(const TriangleMesh& mesh) {
    return Boxes(mesh).crossing_pairs();
}

int self_intersections(const TriangleMesh& mesh) {
    return static_cast<int>(crossing_pairs(mesh).size());
}

std::string text_of(const Check& check) {
    const char* verdict = check.verdict == Verdict::Pass   ? "pass"
                          : check.verdict == Verdict::Fail ? "FAIL"
                                                           : "note";
    return fmt::format("{}  {}: {}; expected: {}", verdict, check.what, check.found, check.accepted);
}

SurfaceFigures surface_figures(const TriangleMesh& closed) {
    const geometry::MeshQuery query(closed);
    const int total = static_cast<int>(closed.triangles.size()), stride = std::max(1, total / most_rays);
    std::vector<double> radii, ratios;
    for (int i = 0; i < total; i += stride) {
        const auto& t = closed.triangles[i];
        const Vec3 &a = closed.vertices[t[0]], &b = closed.vertices[t[1]], &c = closed.vertices[t[2]];
        const Vec3 normal = (b - a).cross(c - a);
        if (normal.norm() == 0) continue;
        const Vec3 origin = (a + b + c) / 3, inward = -normal.normalized();
        const double edge = ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3, skip = 1e-3 * edge;
        const double exit = query.first_hit(origin + skip * inward, inward);
        if (!std::isfinite(exit)) continue;
        radii.push_back((skip + exit) / 2);
        ratios.push_back(edge / radii.back());
    }
    SurfaceFigures figures;
    if (radii.empty()) return figures;
    std::ranges::sort(radii);
    std::ranges::sort(ratios);
    figures.surrounded = surrounded_fraction(closed, query);
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
            {"surface that looks into a tube", fmt::format("{:.0f} %", 100 * figures.surrounded),
             fmt::format("{:.0f} % or less; more is a vessel wall, not a lumen: give its inner surface",
                         100 * most_surrounded),
             failed_unless(figures.surrounded <= most_surrounded)},
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
    append(end_checks(anatomy, geometry::MeshQuery(anatomy.lumen)));
    checks.push_back(ends_that_go_on(anatomy));
    return checks;
}

}  // namespace anatomy
