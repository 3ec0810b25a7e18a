#include "engine/anatomy/anatomy.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <limits>

#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wall/past_end.h"

namespace anatomy {
namespace {

/// An opening matches its declaration when the rim's centre lies this near to the declared centre.
double tolerance(const geometry::OpenEnd& end) {
    return 0.25 * end.radius;
}

void check_mesh(const Anatomy& anatomy, std::vector<std::string>& found) {
    const auto& [vertices, triangles] = anatomy.lumen;
    if (triangles.empty()) {
        found.push_back("the lumen has no triangles");
        return;
    }
    for (const Vec3& v : vertices) {
        if (v.allFinite()) continue;
        found.push_back("the lumen has a corner that is not a finite number");
        return;
    }
    for (const auto& t : triangles) {
        const auto [least, most] = std::minmax({t[0], t[1], t[2]});
        if (least >= 0 && most < static_cast<int>(vertices.size())) continue;
        found.push_back("a triangle of the lumen names a corner that does not exist");
        return;
    }
    const geometry::Topology edges = geometry::topology(anatomy.lumen);
    if (edges.non_manifold_edges > 0) {
        found.push_back(
            fmt::format("the lumen has {} edges shared by three triangles or by two that disagree about "
                        "outside; expected a surface without them",
                        edges.non_manifold_edges));
    }
    if (edges.loops.empty()) {
        found.push_back("the lumen is closed; a wire needs an open end to enter by");
    }
    std::vector<bool> declared(edges.loops.size(), false);
    for (const VesselEnd& end : anatomy.ends) {
        std::size_t nearest = edges.loops.size();
        double least = tolerance(end.opening);
        for (std::size_t i = 0; i < edges.loops.size(); ++i) {
            const double distance =
                (geometry::rim_centre(anatomy.lumen, edges.loops[i]) - end.opening.centre).norm();
            if (distance <= least) least = distance, nearest = i;
        }
        if (nearest == edges.loops.size()) {
            found.push_back(fmt::format("end '{}' at {} has no opening of the mesh within {:.2f} mm of it",
                                        end.opening.name, io::place_text(end.opening.centre),
                                        tolerance(end.opening)));
        } else {
            declared[nearest] = true;
        }
    }
    for (std::size_t i = 0; i < edges.loops.size(); ++i) {
        if (declared[i]) continue;
        found.push_back(
            fmt::format("the mesh is open at {} ({} edges), where no end is declared; expected a mesh that "
                        "is closed except at its ends",
                        io::place_text(edges.loops[i].centroid), edges.loops[i].vertices.size()));
    }
    if (edges.non_manifold_edges == 0 &&
        geometry::signed_volume(geometry::capped(anatomy.lumen, edges.loops)) <= 0) {
        found.push_back("the normals of the lumen point inward; expected outward: reverse the triangles");
    }
}

void check_branches(const Anatomy& anatomy, std::vector<std::string>& found) {
    const int count = static_cast<int>(anatomy.branches.size());
    if (count == 0) found.push_back("there is no centreline; expected one branch at least");
    for (int b = 0; b < count; ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        if (branch.points.size() < 2 || branch.points.size() != branch.radii.size()) {
            found.push_back(
                fmt::format("branch '{}' has {} points and {} radii; expected two or more of each",
                            branch.name, branch.points.size(), branch.radii.size()));
            continue;
        }
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (branch.points[i].allFinite() && std::isfinite(branch.radii[i]) && branch.radii[i] > 0)
                continue;
            found.push_back(fmt::format("branch '{}', point {}: expected finite numbers and a radius above 0",
                                        branch.name, i));
            break;
        }
        if (branch.parent == -1) continue;
        // A parent listed before its children cannot be part of a cycle.
        if (branch.parent < 0 || branch.parent >= b) {
            found.push_back(fmt::format("branch '{}': its parent must be listed before it", branch.name));
        } else if (branch.parent_sample < 0 ||
                   branch.parent_sample >= static_cast<int>(anatomy.branches[branch.parent].points.size())) {
            found.push_back(
                fmt::format("branch '{}': its parent has no sample {}", branch.name, branch.parent_sample));
        }
    }
}

/// How deep in the branch's inscribed balls a point is, < 0 outside [mm].
double depth_in(const CentrelineBranch& branch, const Vec3& x) {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < branch.points.size(); ++i)
        most = std::max(most, branch.radii[i] - (x - branch.points[i]).norm());
    return most;
}

/// Checks that centrelines and ends lie where the mesh is. It is cheap and so made at every load;
/// anatomy_check looks closer.
void check_extent(const Anatomy& anatomy, std::vector<std::string>& found) {
    Eigen::AlignedBox3d box;
    for (const Vec3& v : anatomy.lumen.vertices) box.extend(v);
    const double widest = 0.5 * box.diagonal().norm();
    // A mesh is cut open up to a sample before the centreline ends, and its rim is that much off the plane.
    constexpr double rim = 0.1;
    const auto outside = [&](const std::string& what, const Vec3& place, double radius, double step = 1) {
        const Vec3 margin = Vec3::Constant(std::max(1.0, step) + rim);
        const Eigen::AlignedBox3d near(box.min() - margin, box.max() + margin);
        if (near.contains(place) && radius <= widest) return false;
        found.push_back(
            fmt::format("{} is at ({:.6g}, {:.6g}, {:.6g}) with a radius of {:.6g} mm; the mesh reaches from "
                        "({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}); expected places within it and "
                        "radii of up to {:.6g} mm",
                        what, place.x(), place.y(), place.z(), radius, box.min().x(), box.min().y(),
                        box.min().z(), box.max().x(), box.max().y(), box.max().z(), widest));
        return true;
    };
    for (const CentrelineBranch& branch : anatomy.branches) {
        const auto& points = branch.points;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const bool is_end = i == 0 || i + 1 == points.size();
            const std::size_t k = std::max<std::size_t>(i, 1);
            const double step = is_end && points.size() > 1 ? (points[k] - points[k - 1]).norm() : 0;
            if (outside(fmt::format("branch '{}': sample {}", branch.name, i), points[i], branch.radii[i],
                        step))
                break;
        }
    }
    for (const VesselEnd& end : anatomy.ends) {
        const geometry::OpenEnd& opening = end.opening;
        for (const CentrelineBranch& branch : anatomy.branches) {
            const bool own = (branch.points.front() - opening.centre).norm() < 2 * opening.radius ||
                             (branch.points.back() - opening.centre).norm() < 2 * opening.radius;
            if (own || depth_in(branch, opening.centre) < opening.radius) continue;
            found.push_back(
                fmt::format("end '{}' at {} lies inside branch '{}': no vessel can go on past it; expected "
                            "an end outside all other branches",
                            opening.name, io::place_text(opening.centre), branch.name));
        }
        if (outside(fmt::format("end '{}'", opening.name), opening.centre, opening.radius)) continue;
        // Seen from its end, the vessel lies inside.
        const VesselPlace place = place_behind(anatomy, opening, 2 * opening.radius);
        const Vec3& within = anatomy.branches[place.branch].points[place.sample];
        if ((within - opening.centre).dot(opening.outward_normal) > 0) {
            found.push_back(fmt::format(
                "end '{}': its normal points into branch '{}'; expected one that points out of the lumen",
                opening.name, anatomy.branches[place.branch].name));
        }
    }
}

/// Checks that radii are those of the mesh, by some samples of each branch. Single samples may lie off the
/// axis or in an aneurysm; half of a branch does not.
void check_radii(const Anatomy& anatomy, std::vector<std::string>& found) {
    constexpr double least = 0.3, most = 2.5;  // of the distance to the wall
    constexpr std::size_t most_samples = 40;   // of a branch
    const geometry::MeshQuery wall(anatomy.lumen);
    for (const CentrelineBranch& branch : anatomy.branches) {
        struct Ratio {
            double of_wall;
            std::size_t sample;
        };
        std::vector<Ratio> ratios;
        const std::size_t stride = std::max<std::size_t>(1, branch.points.size() / most_samples);
        for (std::size_t i = 0; i < branch.points.size(); i += stride) {
            const bool at_end = std::ranges::any_of(anatomy.ends, [&](const VesselEnd& end) {
                return (branch.points[i] - end.opening.centre).norm() < 2 * end.opening.radius;
            });
            if (at_end) continue;
            const double distance = std::max(wall.distance(branch.points[i]), 1e-6);
            ratios.push_back({branch.radii[i] / distance, i});
        }
        if (ratios.empty()) continue;
        const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
        std::nth_element(ratios.begin(), middle, ratios.end(),
                         [](const Ratio& a, const Ratio& b) { return a.of_wall < b.of_wall; });
        if (middle->of_wall >= least && middle->of_wall <= most) continue;
        const std::size_t at = middle->sample;
        found.push_back(fmt::format(
            "branch '{}', sample {} at {}: a radius of {:.4g} mm, where the wall of the mesh is {:.4g} mm "
            "away, and so in half of the branch; expected radii of {:g} to {:g} times the distance",
            branch.name, at, io::place_text(branch.points[at]), branch.radii[at],
            wall.distance(branch.points[at]), least, most));
    }
}

/// From the axis of a root to the mouths of the coronary arteries, that is of what leaves within two radii.
/// The sinuses are thirds of a circle: of two mouths, the mean that faces both as well as can be.
Vec3 facing_mouths(const std::vector<CentrelineBranch>& branches, const geometry::OpenEnd& end) {
    Vec3 u, v;
    geometry::tangent_basis(end.outward_normal, u, v);
    std::complex<double> sum;
    for (const CentrelineBranch& branch : branches) {
        if (branch.parent < 0 || (branch.points[0] - end.centre).norm() > 2 * end.radius) continue;
        for (const Vec3& point : branch.points) {
            const Vec3 offset = point - branch.points[0];
            const std::complex<double> aside(offset.dot(u), offset.dot(v));
            if (std::abs(aside) < end.radius) continue;
            const std::complex<double> way = aside / std::abs(aside);
            sum += way * way * way;
            break;
        }
    }
    if (std::abs(sum) < 1e-6) return Vec3::Zero();
    const double angle = geometry::atan2(sum.imag(), sum.real()) / 3;
    return geometry::cos(angle) * u + geometry::sin(angle) * v;
}

}  // namespace

std::vector<geometry::OpenEnd> Anatomy::openings() const {
    std::vector<geometry::OpenEnd> result;
    const auto is_root = [&](const geometry::OpenEnd& end) {
        return body && body->landmark == geometry::Landmark::AorticValve &&
               (body->at - end.centre).norm() < end.radius;
    };
    for (const VesselEnd& end : ends) {
        result.push_back(end.opening);
        if (!is_root(end.opening)) continue;
        result.back().goes_on = geometry::Continuation::Root;
        result.back().faces = facing_mouths(branches, end.opening);
    }
    return result;
}

std::vector<BlockedEnd> blocked_ends(const Anatomy& anatomy) {
    std::vector<BlockedEnd> found;
    const std::vector<geometry::OpenEnd> ends = anatomy.openings();
    for (int e = 0; e < static_cast<int>(ends.size()); ++e) {
        geometry::OpenEnd end = ends[e];
        if (end.goes_on != geometry::Continuation::Artery) continue;
        end.length = std::numeric_limits<double>::infinity();  // though it has been closed
        const physics::RoundCone cone = physics::cones_past(end).cones[0];
        const double step = 0.25 * end.radius;
        BlockedEnd blocked{e, -1, cone.last};
        for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
            const CentrelineBranch& branch = anatomy.branches[b];
            for (std::size_t i = 0; i < branch.points.size(); ++i) {
                const Vec3 offset = branch.points[i] - end.centre;
                const double ahead = offset.dot(end.outward_normal), near = branch.radii[i] + end.radius;
                // What is there at the plane already is the vessel itself, or one beside it.
                if (ahead <= 0 || offset.norm() < near) continue;
                const double aside = std::sqrt(std::max(0.0, offset.squaredNorm() - ahead * ahead));
                if (aside > near || ahead - near > blocked.free) continue;
                for (double t = step; t <= blocked.free; t += step)
                    if (geometry::hypot(aside, ahead - t) <
                        branch.radii[i] + cone.radius - cone.narrows * std::max(0.0, t - 0.5 * step)) {
                        blocked = {e, b, t - step};
                        break;
                    }
            }
        }
        if (blocked.branch >= 0) found.push_back(blocked);
    }
    return found;
}

void close_blocked_ends(Anatomy& anatomy, const std::vector<BlockedEnd>& blocked) {
    for (const BlockedEnd& b : blocked) anatomy.ends[b.end].opening.length = b.free;
}

std::string text_of(const Anatomy& anatomy, const BlockedEnd& blocked) {
    const geometry::OpenEnd& end = anatomy.ends[blocked.end].opening;
    return fmt::format(
        "the artery past end '{}' at {} would run into branch '{}': it is closed {:.3g} mm past "
        "the end",
        end.name, io::place_text(end.centre), anatomy.branches[blocked.branch].name, blocked.free);
}

std::uint64_t hash_of(const Anatomy& anatomy) {
    geometry::Hash hash;
    const auto add_place = [&hash](const Vec3& place) {
        for (int k = 0; k < 3; ++k) hash.add(place[k] + 0.0);
    };
    const auto add_text = [&hash](const std::string& text) {
        hash.add(std::uint64_t{text.size()});
        hash.add(text.data(), text.size());
    };
    const auto add_count = [&hash](std::size_t count) { hash.add(std::uint64_t{count}); };
    add_count(anatomy.lumen.vertices.size());
    for (const Vec3& v : anatomy.lumen.vertices) add_place(v);
    add_count(anatomy.lumen.triangles.size());
    for (const auto& t : anatomy.lumen.triangles)
        for (const int corner : t) hash.add(static_cast<std::uint64_t>(corner));
    add_count(anatomy.branches.size());
    for (const CentrelineBranch& branch : anatomy.branches) {
        add_text(branch.name);
        hash.add(static_cast<std::uint64_t>(branch.parent));
        hash.add(static_cast<std::uint64_t>(branch.parent_sample));
        add_count(branch.points.size());
        for (const Vec3& p : branch.points) add_place(p);
        for (const double radius : branch.radii) hash.add(radius);
    }
    add_count(anatomy.ends.size());
    for (const VesselEnd& end : anatomy.ends) {
        add_text(end.opening.name);
        add_place(end.opening.centre);
        add_place(end.opening.outward_normal);
        hash.add(end.opening.radius);
    }
    add_count(anatomy.targets.size());
    for (const VesselTarget& target : anatomy.targets) {
        add_text(target.name);
        add_place(target.centre);
    }
    if (anatomy.calcium.empty()) return hash.value();  // as before there was any
    add_count(anatomy.calcium.size());
    for (const CalciumDeposit& deposit : anatomy.calcium) {
        add_count(deposit.points.size());
        for (const Vec3& p : deposit.points) add_place(p);
        for (const double radius : deposit.radii) hash.add(radius);
    }
    return hash.value();
}

std::vector<std::string> problems(const Anatomy& anatomy) {
    std::vector<std::string> found;
    for (const VesselEnd& end : anatomy.ends) {
        const geometry::OpenEnd& opening = end.opening;
        if (!opening.centre.allFinite() || !(opening.radius > 0) ||
            !(std::abs(opening.outward_normal.norm() - 1) < 1e-3)) {
            found.push_back(fmt::format(
                "end '{}': expected a finite centre, a unit normal and a radius above 0", opening.name));
        }
    }
    check_branches(anatomy, found);
    for (const VesselTarget& target : anatomy.targets) {
        if (target.centre.allFinite()) continue;
        found.push_back(fmt::format("target '{}' is not at a finite place", target.name));
    }
    for (const Vec3& v : anatomy.lumen.vertices)
        if (!(v.cwiseAbs().maxCoeff() <= largest_coordinate)) {
            found.push_back(
                fmt::format("a corner at ({:g}, {:g}, {:g}) mm; expected coordinates up to {:g} mm", v.x(),
                            v.y(), v.z(), largest_coordinate));
            break;
        }
    if (found.empty()) check_mesh(anatomy, found);
    if (found.empty()) check_extent(anatomy, found);
    if (found.empty()) check_radii(anatomy, found);
    return found;
}

geometry::TriangleMesh closed_lumen(const Anatomy& anatomy) {
    const geometry::TriangleMesh closed =
        geometry::capped(anatomy.lumen, geometry::topology(anatomy.lumen).loops);
    const geometry::Topology left = geometry::topology(closed);
    if (left.boundary_edges > 0 || left.non_manifold_edges > 0) {
        throw io::InputError(
            "{}: the lumen stays open at {} edges and ambiguous at {} when its ends are capped; a closed "
            "mesh is needed for imaging",
            anatomy.name, left.boundary_edges, left.non_manifold_edges);
    }
    return closed;
}

double along(const Anatomy& anatomy, const VesselPlace& place) {
    return geometry::length_of(std::span(anatomy.branches[static_cast<std::size_t>(place.branch)].points)
                                   .first(static_cast<std::size_t>(place.sample) + 1));
}

VesselPlace nearest_place(const Anatomy& anatomy, const Vec3& point) {
    VesselPlace best{-1, -1, std::numeric_limits<double>::infinity()};
    for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
            const double distance = (point - branch.points[i]).norm() - branch.radii[i];
            if (distance < best.distance) best = {b, i, distance};
        }
    }
    return best;
}

std::optional<VesselPlace> joint_of(const Anatomy& anatomy, int branch) {
    const int joined = geometry::joined_branch(anatomy.branches, anatomy.openings(), branch);
    if (joined < 0) return std::nullopt;
    const Vec3& last = anatomy.branches[branch].points.back();
    const CentrelineBranch& other = anatomy.branches[joined];
    VesselPlace deepest;
    for (int i = 0; i < static_cast<int>(other.points.size()); ++i) {
        const double distance = (last - other.points[i]).norm() - other.radii[i];
        if (distance < deepest.distance) deepest = {joined, i, distance};
    }
    return deepest;
}

double origin_of(const Anatomy& anatomy, int branch) {
    const CentrelineBranch& of = anatomy.branches[static_cast<std::size_t>(branch)];
    if (of.parent < 0) return 0;
    const CentrelineBranch& parent = anatomy.branches[static_cast<std::size_t>(of.parent)];
    if (geometry::goes_on_in(parent, of)) return 0;
    const auto held = [&](const Vec3& x) {
        for (std::size_t i = 0; i < parent.points.size(); ++i)
            if ((x - parent.points[i]).squaredNorm() < parent.radii[i] * parent.radii[i]) return true;
        return false;
    };
    std::size_t i = 0;
    while (i + 1 < of.points.size() && held(of.points[i])) ++i;
    return geometry::length_of(std::span(of.points).first(i + 1));
}

std::optional<int> branch_named(const Anatomy& anatomy, std::string_view name) {
    const auto index_of = [&](auto is_it) -> std::optional<int> {
        const auto found = std::ranges::find_if(anatomy.branches, is_it, &CentrelineBranch::name);
        if (found == anatomy.branches.end()) return std::nullopt;
        return static_cast<int>(found - anatomy.branches.begin());
    };
    if (const auto own = index_of([&](const std::string& known) { return known == name; })) return own;
    return index_of(
        [&, start = std::string(name) + "+"](const std::string& known) { return known.starts_with(start); });
}

bool inside(const Anatomy& anatomy, const Vec3& point) {
    return point.allFinite() && nearest_place(anatomy, point).distance <= 0;
}

std::optional<int> find_end(const Anatomy& anatomy, const std::string& name) {
    for (std::size_t i = 0; i < anatomy.ends.size(); ++i) {
        if (anatomy.ends[i].opening.name == name) return static_cast<int>(i);
    }
    std::optional<int> found;
    for (std::size_t i = 0; i < anatomy.ends.size(); ++i) {
        if (name.empty() || !anatomy.ends[i].opening.name.ends_with("+" + name)) continue;
        if (found) return std::nullopt;
        found = static_cast<int>(i);
    }
    return found;
}

EntryPath path_from(const Anatomy& anatomy, int end) {
    const geometry::OpenEnd& opening = anatomy.ends[end].opening;
    int branch = 0;
    bool at_start = true;
    double least = std::numeric_limits<double>::infinity();
    for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
        const geometry::Polyline& points = anatomy.branches[b].points;
        const double to_start = (points.front() - opening.centre).norm();
        const double to_end = (points.back() - opening.centre).norm();
        if (to_start < least && anatomy.branches[b].parent < 0) least = to_start, branch = b, at_start = true;
        if (to_end < least) least = to_end, branch = b, at_start = false;
    }

    EntryPath path;
    const auto append = [&path](const CentrelineBranch& from, int sample) {
        path.points.push_back(from.points[sample]);
        path.radii.push_back(from.radii[sample]);
    };
    const CentrelineBranch* at = &anatomy.branches[branch];
    if (at_start) {
        for (int i = 0; i < static_cast<int>(at->points.size()); ++i) append(*at, i);
    } else {
        int sample = static_cast<int>(at->points.size()) - 1;
        while (true) {
            for (int i = sample; i >= 0; --i) append(*at, i);
            if (at->parent < 0) break;
            sample = at->parent_sample;
            at = &anatomy.branches[at->parent];
        }
    }
    // Centrelines continue past the plane of the opening; the wire starts on the plane.
    std::size_t beyond = 0;
    while (beyond + 1 < path.points.size() &&
           (path.points[beyond] - opening.centre).dot(opening.outward_normal) > -1e-6) {
        ++beyond;
    }
    path.points.erase(path.points.begin(), path.points.begin() + static_cast<std::ptrdiff_t>(beyond));
    path.radii.erase(path.radii.begin(), path.radii.begin() + static_cast<std::ptrdiff_t>(beyond));
    path.points.insert(path.points.begin(), opening.centre);
    path.radii.insert(path.radii.begin(), opening.radius);
    return path;
}

double ball_behind(const geometry::MeshQuery& wall, const geometry::Vec3& centre,
                   const geometry::Vec3& outward, double radius) {
    double largest = 0;
    for (double depth = 0.25; depth <= 2; depth += 0.25)
        largest = std::max(largest, wall.distance(centre - depth * radius * outward));
    return largest;
}

VesselPlace place_behind(const Anatomy& anatomy, const geometry::OpenEnd& end, double distance) {
    VesselPlace place = nearest_place(anatomy, end.centre);
    const geometry::Polyline& line = anatomy.branches[place.branch].points;
    const int last = static_cast<int>(line.size()) - 1, step = place.sample > last / 2 ? -1 : 1;
    int& at = place.sample;
    for (double passed = 0; passed < distance && at + step >= 0 && at + step <= last; at += step)
        passed += (line[at + step] - line[at]).norm();
    return place;
}

}  // namespace anatomy
