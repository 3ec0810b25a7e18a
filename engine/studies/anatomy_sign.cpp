#include "engine/studies/anatomy_sign.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/io/cpu_clock.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wire/crossings.h"

namespace studies {
namespace {

using geometry::CentrelineBranch;
using geometry::TriangleMesh;
using physics::LumenWall;
using physics::WallContact;

constexpr double clear = 0.1;      // distance from the wall at which a sign counts [mm]
constexpr double around = 1.0;     // distance outside the lumen within which places are drawn [mm]
constexpr double at_carina = 0.5;  // from the walls of both limbs [mm]
constexpr double past_end = 20;    // distance past an open end over which contacts are looked for [mm]
constexpr double sleeve = 10;      // distance past an end over which a distance field continues straight [mm]
constexpr double sample_step = 0.02;  // along a segment, for its truth [mm]

WallContact ask(const LumenWall& wall, const Vec3& x, int station = -1) {
    WallContact c;
    c.station = station;
    wall.contacts({&x, 1}, {&c, 1});
    return c;
}

struct Place {
    Vec3 x;
    bool inside;
};
struct Segment {
    Vec3 from, to;
    double depth;  // of its deepest place outside the lumen [mm]
};

/// A vessel tree, its lumen and the truth about random places in it.
class Truth {
public:
    Truth(std::string_view preset, const StudyOptions& options)
        : spec_(anatomy::vessel_preset(preset)),
          tree_(anatomy::grow(spec_)),
          lumen_(tree_, anatomy::grid_cell(tree_)),
          anatomy_(anatomy::generated_anatomy(spec_, options.cache)) {
        const int count = options.quick ? 2000 : 20000;
        const auto keep = [&](std::vector<Place>& places, const Vec3& x) {
            const double distance = lumen_.at(x).distance;
            if (std::abs(distance) > clear && !past_an_end(x)) places.push_back({x, distance < 0});
        };
        while (static_cast<int>(anywhere_.size()) < count) keep(anywhere_, random_place(random_branch(), 0));
        for (int tries = 0; tries < 200 * count && static_cast<int>(at_carinas_.size()) < count; ++tries)
            if (const std::optional<Vec3> x = place_at_a_carina()) keep(at_carinas_, *x);
        for (int tries = 0; tries < 100 * count; ++tries) {
            const std::vector<Place>& near = tries % 4 == 0 || at_carinas_.empty() ? anywhere_ : at_carinas_;
            const auto at = static_cast<std::size_t>(unit() * static_cast<double>(near.size()));
            add_segment(near[at].x + 2 * clear * unit() * direction(), tries % 2 == 0 ? 1.0 : 2.0);
        }
    }

    const anatomy::Anatomy& anatomy() const { return anatomy_; }
    const std::vector<Place>& anywhere() const { return anywhere_; }
    const std::vector<Place>& at_carinas() const { return at_carinas_; }
    const std::vector<Segment>& segments() const { return segments_; }  // that may cross

    /// Places past the open ends where a wire that left through them touches nothing, and the ends they
    /// belong to.
    std::vector<std::pair<Vec3, const geometry::OpenEnd*>> past_ends() {
        std::vector<std::pair<Vec3, const geometry::OpenEnd*>> places;
        for (const anatomy::VesselEnd& end : anatomy_.ends) {
            const geometry::OpenEnd& opening = end.opening;
            for (int k = 0; k < 500; ++k) {
                const double past = past_end * unit();
                const double radius = past > sleeve ? 2 * opening.radius : opening.radius - clear;
                Vec3 side = direction().cross(opening.outward_normal).normalized();
                places.emplace_back(
                    opening.centre + past * opening.outward_normal + radius * std::sqrt(unit()) * side,
                    &opening);
            }
        }
        return places;
    }

private:
    double unit() { return random_() / 4294967296.0; }
    Vec3 direction() {
        const double z = 2 * unit() - 1, angle = 2 * std::numbers::pi * unit();
        return {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
    }
    const anatomy::SampledBranch& random_branch() {
        return tree_.branches[static_cast<std::size_t>(unit() * static_cast<double>(tree_.branches.size()))];
    }
    Vec3 random_place(const anatomy::SampledBranch& branch, int first, int last = -1) {
        if (last < 0) last = static_cast<int>(branch.points.size()) - 1;
        const int sample = first + static_cast<int>(unit() * (last - first + 1));
        return branch.points[sample] + (branch.radii[sample] + around) * unit() * direction();
    }
    bool past_an_end(const Vec3& x) const {
        return std::any_of(anatomy_.ends.begin(), anatomy_.ends.end(),
                           [&](const anatomy::VesselEnd& end) { return end.opening.beyond(x, around) > 0; });
    }
    /// Distance to the ball of a branch that holds a place deepest [mm].
    static double to_balls(const anatomy::SampledBranch& branch, const Vec3& x) {
        double least = 1e9;
        for (std::size_t i = 0; i < branch.points.size(); ++i)
            least = std::min(least, (x - branch.points[i]).norm() - branch.radii[i]);
        return least;
    }
    std::optional<Vec3> place_at_a_carina() {
        const anatomy::SampledBranch& child = random_branch();
        if (child.parent < 0) return std::nullopt;
        const Vec3 x = random_place(child, child.exit, child.separation);
        if (std::abs(to_balls(child, x)) > at_carina ||
            std::abs(to_balls(tree_.branches[child.parent], x)) > at_carina)
            return std::nullopt;
        return x;
    }
    void add_segment(const Vec3& from, double length) {
        const Vec3 heading = direction(), to = from + length * heading;
        const double first = lumen_.at(from).distance;
        if (first >= 0 || past_an_end(from) || past_an_end(to)) return;
        const double last = lumen_.at(to).distance;
        if (last >= 0 || first + last <= -length) return;
        double deepest = -1e9;
        for (double at = 0; at < length;) {
            const double distance = lumen_.at(from + at * heading).distance;
            deepest = std::max(deepest, distance);
            at += std::max(sample_step, -distance);
        }
        segments_.push_back({from, to, deepest});
    }

    anatomy::VesselTreeSpec spec_;
    anatomy::VesselTree tree_;
    anatomy::ImplicitLumen lumen_;
    anatomy::Anatomy anatomy_;
    std::mt19937 random_{7};
    std::vector<Place> anywhere_, at_carinas_;
    std::vector<Segment> segments_;
};

double percent_wrong(const LumenWall& wall, const std::vector<Place>& places) {
    int wrong = 0;
    for (const Place& place : places) wrong += (ask(wall, place.x).penetration < 0) != place.inside;
    return 100.0 * wrong / std::max<double>(1, static_cast<double>(places.size()));
}

/// Time of a query at a place whose station is known, as a joint's is.
double query_seconds(const LumenWall& wall, const std::vector<Place>& places) {
    std::vector<Vec3> joints;
    for (const Place& place : places) joints.push_back(place.x);
    std::vector<WallContact> contacts(joints.size());
    wall.contacts(joints, contacts);
    const double start = io::thread_cpu_seconds();
    wall.contacts(joints, contacts);
    return (io::thread_cpu_seconds() - start) / static_cast<double>(joints.size());
}

int contacts_past_ends(const LumenWall& wall, Truth& truth) {
    int touching = 0;
    for (const auto& [x, end] : truth.past_ends()) {
        const int station = ask(wall, end->centre - 0.5 * end->outward_normal).station;
        touching += ask(wall, x, station).touches();
    }
    return touching;
}

struct Misses {
    int deep = 0, missed = 0;
    double deepest_missed = 0;  // [mm]
};
Misses misses(const LumenWall& wall, const std::vector<Segment>& segments) {
    Misses result;
    for (const Segment& s : segments) {
        if (s.depth <= clear) continue;
        ++result.deep;
        const WallContact from = ask(wall, s.from), to = ask(wall, s.to);
        const auto found = physics::crossing_between(wall, s.from, s.to, from, to);
        if (found) continue;
        ++result.missed;
        result.deepest_missed = std::max(result.deepest_missed, s.depth);
    }
    return result;
}

void turn_over(geometry::TriangleMesh& mesh, unsigned one_in) {
    std::mt19937 random(3);
    for (auto& triangle : mesh.triangles)
        if (random() % one_in == 0) std::swap(triangle[1], triangle[2]);
}

void add_wall(io::Table& table, const std::string& preset, const std::string& mesh,
              const std::string& loading, const std::string& name, const LumenWall& wall, Truth& truth) {
    const double anywhere = percent_wrong(wall, truth.anywhere()),
                 each = query_seconds(wall, truth.anywhere());
    const Misses crossings = misses(wall, truth.segments());
    table.add({preset, mesh, loading, name, anywhere, percent_wrong(wall, truth.at_carinas()),
               truth.at_carinas().size(), contacts_past_ends(wall, truth), 1e6 * each, crossings.deep,
               crossings.missed, crossings.deepest_missed});
}

bool near_junction(const std::vector<CentrelineBranch>& branches, std::size_t own, std::size_t sample) {
    const Vec3& p = branches[own].points[sample];
    const double r = branches[own].radii[sample];
    for (std::size_t b = 0; b < branches.size(); ++b) {
        if (b == own) continue;
        for (std::size_t i = 0; i < branches[b].points.size(); ++i) {
            const double other = branches[b].radii[i];
            if ((branches[b].points[i] - p).norm() < r + other + 0.8 * std::min(r, other)) return true;
        }
    }
    return false;
}

bool near_end(const anatomy::Anatomy& anatomy, const Vec3& p) {
    return std::any_of(anatomy.ends.begin(), anatomy.ends.end(), [&](const anatomy::VesselEnd& end) {
        const Vec3 from = p - end.opening.centre;
        return from.norm() < 2 * end.opening.radius &&
               from.dot(end.opening.outward_normal) > -end.opening.radius;
    });
}

/// Number of branches in `wanted` with a branch of `given` that ends within 1.5 radii of their end.
int matched(const std::vector<CentrelineBranch>& wanted, const std::vector<CentrelineBranch>& given) {
    return static_cast<int>(std::count_if(wanted.begin(), wanted.end(), [&](const CentrelineBranch& branch) {
        return std::any_of(given.begin(), given.end(), [&](const CentrelineBranch& other) {
            return (branch.points.back() - other.points.back()).norm() < 1.5 * branch.radii.back();
        });
    }));
}

double at(const std::vector<double>& sorted, double part) {
    return sorted.empty() ? 0
                          : sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

io::Table sign_table() {
    return {"sign",
            {"preset", "mesh", "load_anatomy", "wall", "wrong_anywhere_percent", "wrong_at_carinas_percent",
             "places_at_carinas", "contacts_past_ends", "query_us", "crossings", "missed_crossings",
             "deepest_missed_mm"}};
}

void add_signs(io::Table& table, std::string_view preset, const StudyOptions& options) {
    Truth truth(preset, options);
    const std::pair<const char*, unsigned> states[] = {
        {"as generated", 0}, {"inverted", 1}, {"5 % turned", 20}};
    for (const auto& [state, one_in] : states) {
        anatomy::Anatomy anatomy = truth.anatomy();
        if (one_in > 0) turn_over(anatomy.lumen, one_in);
        const std::string loading = anatomy::problems(anatomy).empty() ? "accepts" : "refuses";
        add_wall(table, std::string(preset), state, loading, "distance field",
                 *anatomy::cached_distance_field(anatomy, 1, 0, options.cache), truth);
        add_wall(table, std::string(preset), state, loading, "mesh",
                 physics::MeshWall(anatomy.lumen, anatomy.branches, anatomy.openings(), 1), truth);
    }
}

TriangleMesh corrupted(const TriangleMesh& mesh, std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto draw = [&] { return random() / 4294967296.0; };
    TriangleMesh result;
    for (const Vec3& v : mesh.vertices) {
        const double x = draw(), y = draw(), z = draw();
        result.vertices.push_back(v + 0.02 * (Vec3(x, y, z) - Vec3::Constant(0.5)));
    }
    for (auto t : mesh.triangles) {
        const double fate = draw();
        if (fate < 0.01) continue;
        if (fate < 0.06) std::swap(t[1], t[2]);
        result.triangles.push_back(t);
        if (fate < 0.99) continue;
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        result.vertices.push_back((a + b) / 2 + 0.8 * (b - a).cross(c - a).normalized() * (b - a).norm());
        result.triangles.push_back({t[0], t[1], static_cast<int>(result.vertices.size()) - 1});
    }
    return result;
}

TriangleMesh flat_capped(const TriangleMesh& mesh) {
    TriangleMesh result = mesh;
    for (const geometry::BoundaryLoop& loop : geometry::topology(mesh).loops) {
        const int count = static_cast<int>(loop.vertices.size()),
                  first = static_cast<int>(result.vertices.size());
        const Vec3 centre = geometry::rim_centre(mesh, loop);
        for (const int v : loop.vertices) result.vertices.push_back((mesh.vertices[v] + centre) / 2);
        result.vertices.push_back(centre);
        for (int i = 0; i < count; ++i) {
            const int n = (i + 1) % count;
            result.triangles.push_back({loop.vertices[i], loop.vertices[n], first + i});
            result.triangles.push_back({loop.vertices[n], first + n, first + i});
            result.triangles.push_back({first + i, first + n, first + count});
        }
    }
    return result;
}

CentrelinePlace nearest_on(const std::vector<CentrelineBranch>& branches, const Vec3& p) {
    CentrelinePlace best{std::numeric_limits<double>::infinity(), 0};
    for (const CentrelineBranch& branch : branches) {
        for (std::size_t i = 0; i + 1 < branch.points.size(); ++i) {
            const Vec3 along = branch.points[i + 1] - branch.points[i];
            const double square = along.squaredNorm();
            const double part =
                square > 0 ? std::clamp((p - branch.points[i]).dot(along) / square, 0.0, 1.0) : 0;
            const double distance = (branch.points[i] + part * along - p).norm();
            if (distance < best.distance)
                best = {distance, (1 - part) * branch.radii[i] + part * branch.radii[i + 1]};
        }
    }
    return best;
}

ImportErrors import_errors(const anatomy::Anatomy& truth, const anatomy::Anatomy& found) {
    ImportErrors errors;
    errors.true_branches = static_cast<int>(truth.branches.size());
    errors.branches = matched(truth.branches, found.branches);
    errors.invented = static_cast<int>(found.branches.size()) - matched(found.branches, truth.branches);
    errors.true_ends = static_cast<int>(truth.ends.size());
    for (const anatomy::VesselEnd& end : truth.ends) {
        const geometry::OpenEnd& wanted = end.opening;
        const auto other = std::find_if(found.ends.begin(), found.ends.end(), [&](const auto& candidate) {
            return (candidate.opening.centre - wanted.centre).norm() < 0.5 * wanted.radius;
        });
        if (other == found.ends.end()) continue;
        ++errors.ends;
        const geometry::OpenEnd& own = other->opening;
        errors.end_centre = std::max(errors.end_centre, (own.centre - wanted.centre).norm());
        errors.end_radius = std::max(errors.end_radius, std::abs(own.radius / wanted.radius - 1));
        const double along = own.outward_normal.dot(wanted.outward_normal);
        errors.end_normal = std::max(errors.end_normal, std::acos(std::clamp(along, -1.0, 1.0)));
    }
    std::vector<double> centres, radii;
    for (std::size_t b = 0; b < truth.branches.size(); ++b) {
        const CentrelineBranch& branch = truth.branches[b];
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (near_end(truth, branch.points[i]) || near_junction(truth.branches, b, i)) continue;
            const CentrelinePlace place = nearest_on(found.branches, branch.points[i]);
            centres.push_back(place.distance);
            radii.push_back(std::abs(place.radius / branch.radii[i] - 1));
        }
    }
    std::sort(centres.begin(), centres.end());
    std::sort(radii.begin(), radii.end());
    errors.centre_p50 = at(centres, 0.5), errors.centre_p95 = at(centres, 0.95),
    errors.centre_max = at(centres, 1);
    errors.radius_p50 = at(radii, 0.5), errors.radius_p95 = at(radii, 0.95);
    return errors;
}

}  // namespace studies
