#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <memory>

#include "engine/anatomy/scenes.h"
#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/plain_wire.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/geometry/centreline_tree.h"
#include "physics/geometry/mesh_query.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Mat3;
using physics::WallContact;

constexpr double wall_stiffness = 42, rigidity = 50, radius = 1, segment_length = 1;
constexpr double still = 1e-6;     // mean turn of an update in the last cycle [-]
constexpr double balanced = 1e-4;  // |g|/C of a wire that is where its energy is least [-]
constexpr double same_facet = 1e-12;
// The first bend of the sharp tube, to the left, and a ring of corners of its coarsest mesh there [mm].
constexpr double bend_begins = 20, bend_radius = 3, first_ring = 20.9;

/// The closest point of the mesh to a joint, on a face, an edge or a corner: its distance outside a convex
/// wall has a continuous slope, and a curvature that jumps where the kind of feature changes.
class ClosestFeatureWall final : public physics::LumenWall {
public:
    explicit ClosestFeatureWall(const anatomy::Anatomy& tube)
        : mesh_(tube.lumen), query_(tube.lumen), tree_(tube.branches, tube.openings()) {}

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        physics::require_finite(joints);
        for (std::size_t i = 0; i < joints.size(); ++i) contacts[i] = contact(joints[i], contacts[i].station);
    }
    bool smooth() const override { return false; }

private:
    WallContact contact(const Vec3& x, int hint) const;

    geometry::TriangleMesh mesh_;
    geometry::MeshQuery query_;
    geometry::CentrelineTree tree_;
};

/// The closest point of a triangle, and the inverse of the distance's radii of curvature there.
struct Feature {
    Vec3 point;
    Mat3 flat = Mat3::Identity();  // directions in which the distance is not curved, as a projector
};

Feature closest_feature(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
    const Vec3 normal = (b - a).cross(c - a).normalized(), foot = x - normal.dot(x - a) * normal;
    const Vec3* corners[] = {&a, &b, &c};
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
        const Vec3 &p = *corners[k], &q = *corners[(k + 1) % 3];
        inside = inside && (q - p).cross(foot - p).dot(normal) >= 0;
    }
    if (inside) return {foot};
    Feature best{a, Mat3::Zero()};
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        const Vec3 &p = *corners[k], &q = *corners[(k + 1) % 3];
        const double fraction = geometry::closest_fraction(p, q, x);
        const Vec3 on = p + fraction * (q - p);
        if ((on - x).squaredNorm() >= least) continue;
        least = (on - x).squaredNorm();
        const Vec3 along = (q - p).normalized();
        best = {on, fraction > 0 && fraction < 1 ? Mat3(along * along.transpose()) : Mat3(Mat3::Zero())};
    }
    return best;
}

WallContact ClosestFeatureWall::contact(const Vec3& x, int hint) const {
    WallContact c;
    c.stiffness = wall_stiffness;
    c.station = tree_.locate(x, hint);
    c.clearance = tree_.stations()[c.station].radius;
    const Vec3 origin = tree_.closest_point(c.station, x), out = x - origin;
    const double from_axis = out.norm();
    c.penetration = -1e-3;
    if (from_axis < 1e-9 || tree_.beyond_an_end(x)) return c;
    const bool outside = query_.first_hit(origin, out / from_axis) < from_axis;
    const auto nearest = query_.nearest(x);
    c.trust = outside ? 0 : 0.999 * nearest.distance;
    c.penetration = -std::max(nearest.distance, 1e-12);
    if (!outside) return c;
    const auto& t = mesh_.triangles[nearest.triangle];
    const Feature feature =
        closest_feature(mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]], x);
    const double distance = (x - feature.point).norm();
    c.penetration = distance;
    if (distance < 1e-12) return c;
    c.normal = (x - feature.point) / distance;
    if (!feature.flat.isIdentity(0))
        c.curvature = (Mat3::Identity() - feature.flat - c.normal * c.normal.transpose()) / distance;
    return c;
}

struct Fineness {
    int around;
    double step;  // [mm]
    std::string text() const { return fmt::format("{} × {:g} mm", around, step); }
};

struct TubeOfTriangles {
    std::string name, what;
    geometry::Polyline line;
    Chain start;
};

/// A wall of a tube, named as tables and pictures do.
struct NamedWall {
    std::string kind, fineness;
    std::shared_ptr<const physics::LumenWall> wall;
    int tube = 0;
    bool planes = false;
};

struct TriangleWallSizes {
    int segments = 60, cycles = 60;
    std::vector<Fineness> finenesses = {{8, 1.0}, {16, 0.5}, {48, 0.2}};
};
TriangleWallSizes triangle_wall_sizes(const StudyOptions& options) {
    if (!options.quick) return {};
    return {40, 6, {{8, 1.0}, {24, 0.5}}};
}

std::vector<anatomy::PenMove> sharp_path() {
    using anatomy::Arc, anatomy::Run;
    return {Run{20},     Arc{3, 1.2}, Run{14},      Arc{3, -1.6}, Run{12},
            Arc{3, 1.0}, Run{10},     Arc{3, -1.4}, Run{12}};
}

std::vector<TubeOfTriangles> tubes(const TriangleWallSizes& size) {
    const auto spec = PlainWire::uniform(rigidity, segment_length, physics::EndCells::Paper);
    std::vector<TubeOfTriangles> all;
    const auto add = [&](const char* name, const char* what, const std::vector<anatomy::PenMove>& path) {
        const geometry::Polyline line = anatomy::draw(path);
        all.push_back({name, what, line, wire_along(spec, line, size.segments)});
    };
    add("sinuous", "bends of 12 to 30 mm", anatomy::find_scene("sinuous")->path);
    add("sharp", "bends of 3 mm", sharp_path());
    return all;
}

std::vector<NamedWall> walls(const std::vector<TubeOfTriangles>& tubes, const TriangleWallSizes& size) {
    std::vector<NamedWall> all;
    for (int t = 0; t < static_cast<int>(tubes.size()); ++t) {
        for (const Fineness& fineness : size.finenesses) {
            const anatomy::Anatomy tube =
                anatomy::tube_anatomy("tube", tubes[t].line, radius, fineness.around, fineness.step);
            const auto add = [&](const char* kind, std::shared_ptr<const physics::LumenWall> wall) {
                all.push_back({kind, fineness.text(), std::move(wall), t, kind == std::string("plane")});
            };
            add("plane", std::make_shared<physics::MeshWall>(tube.lumen, tube.branches, tube.openings(),
                                                             wall_stiffness));
            add("closest", std::make_shared<ClosestFeatureWall>(tube));
            add("field", std::make_shared<physics::DistanceField>(tube.lumen, tube.branches, tube.openings(),
                                                                  wall_stiffness));
        }
        all.push_back({"closed form", "round",
                       std::make_shared<physics::TubeWall>(tubes[t].line, radius, wall_stiffness), t, false});
    }
    return all;
}

struct Ending {
    std::vector<double> turns;  // mean |ε| of each cycle's updates
    double gradient = 0, energy = 0;
    double rise = 0;      // the largest of the energy by an update of the last cycle [N·mm]
    double hops = 0;      // changes of plane under a touching joint in the last cycle, over such joints
    double moved = 0;     // the farthest joint from the rest in the round tube [mm]
    bool stands = false;  // nothing moves any more
    bool rests() const { return stands && gradient <= balanced; }
    const char* state() const { return rests() ? "rests" : stands ? "stuck" : "moves"; }
};

/// Energy and facets as the updates of one cycle leave them.
class LastCycle {
public:
    LastCycle(const physics::LumenWall& wall, const Chain& wire)
        : wall_(wall), contacts_(physics::all_contacts(wire, wall)) {
        energy_ = physics::total_energy(wire, contacts_).total();
    }
    void observe(const Chain& wire) {
        const auto now = physics::all_contacts(wire, wall_);
        const double energy = physics::total_energy(wire, now).total();
        rise = std::max(rise, energy - energy_);
        energy_ = energy;
        for (std::size_t i = 1; i < now.size(); ++i)
            if (now[i].touches() && contacts_[i].touches())
                hops += 1 - now[i].normal.dot(contacts_[i].normal) > same_facet;
        contacts_ = now;
    }
    int touching() const {
        return static_cast<int>(std::count_if(contacts_.begin() + 1, contacts_.end(),
                                              [](const WallContact& c) { return c.touches(); }));
    }
    double rise = 0;
    long long hops = 0;

private:
    const physics::LumenWall& wall_;
    std::vector<WallContact> contacts_;
    double energy_;
};

Ending relaxed(const physics::RelaxerConfig& method, const NamedWall& wall, const Chain& start,
               const Chain& reference, int cycles) {
    Ending ending;
    Chain wire = start;
    const auto relaxer = physics::make_relaxer(method, *wall.wall);
    if (method.kind == physics::RelaxerKind::Global) {
        relaxer->relax(wire, {1'000'000'000, 0, 0});
        ending.stands = true;  // it ends where it finds no lower energy
    } else {
        for (int cycle = 0; cycle < cycles; ++cycle) {
            std::vector<Vec3> before = wire.tangents;
            double sum = 0;
            LastCycle last(*wall.wall, wire);
            const bool looked_at = cycle == cycles - 1;
            const auto report = relaxer->relax(wire, physics::whole_cycles(wire.segments(), 1),
                                               [&](int first, const Chain& now) {
                                                   for (int i = first; i <= now.segments(); ++i) {
                                                       sum += (now.tangents[i] - before[i]).norm();
                                                       before[i] = now.tangents[i];
                                                   }
                                                   if (looked_at) last.observe(now);
                                               });
            ending.turns.push_back(report.updates > 0 ? sum / report.updates : 0.0);
            if (!looked_at) continue;
            ending.rise = last.rise;
            ending.hops = last.touching() > 0 ? static_cast<double>(last.hops) / last.touching() : 0.0;
        }
        ending.stands = ending.turns.back() < still;
    }
    const Rest rest = as_it_is(*wall.wall, std::move(wire));
    ending.gradient = rest.gradient;
    ending.energy = rest.energy;
    ending.moved = farthest_joint(rest.wire, reference);
    return ending;
}

/// What one joint has from each wall of the coarsest mesh as it passes an edge between two facets: its energy
/// [N·mm], and the part of the push that drives it along the way [N].
io::Table edge_table(std::span<const NamedWall> walls) {
    io::Table table{"triangle_walls_edge", {"line", "place_mm"}};
    for (const char* unit : {"N_mm", "N"})
        for (const NamedWall& wall : walls)
            table.columns.push_back(
                fmt::format("{}_{}", wall.kind == "closed form" ? "round" : wall.kind, unit));
    const auto add = [&](const char* line, double place, const Vec3& x, const Vec3& along) {
        std::vector<io::TableCell> row = {line, place};
        std::vector<WallContact> contacts;
        for (const NamedWall& wall : walls) wall.wall->contacts({&x, 1}, {&contacts.emplace_back(), 1});
        for (const WallContact& c : contacts) row.emplace_back(c.touches() ? c.energy() : 0.0);
        for (const WallContact& c : contacts) row.emplace_back(-c.push().dot(along));
        table.add(std::move(row));
    };
    constexpr double from_axis = 1.02 * radius, span = 0.25;  // [mm]
    constexpr int points = 500;
    for (int k = -points; k <= points;
         ++k) {  // round the straight run before the bend, past a line of corners
        const double place = span * k / points, angle = 0.25 * M_PI + place / from_axis;
        add("around", place, Vec3(10.3, -from_axis * std::cos(angle), from_axis * std::sin(angle)),
            Vec3(0, std::sin(angle), std::cos(angle)));
    }
    for (int k = -points; k <= points; ++k) {  // along the outside of the bend, past a ring of corners
        const double place = span * k / points, turned = (first_ring + place - bend_begins) / bend_radius;
        const Vec3 out(std::sin(turned), -std::cos(turned), 0), centre(bend_begins, bend_radius, 0);
        add("along", place,
            centre + (bend_radius + from_axis * std::cos(0.3)) * out +
                from_axis * std::sin(0.3) * Vec3::UnitZ(),
            Vec3(std::cos(turned), std::sin(turned), 0));
    }
    return table;
}

struct TriangleMethod {
    const char* name;
    physics::RelaxerConfig config;
};
std::vector<TriangleMethod> methods() {
    std::vector<TriangleMethod> all = {{"first order", paper_method(1).config}};
    all[0].config.kind = physics::RelaxerKind::FirstOrder;
    for (int m = 1; m <= 3; ++m)
        all.push_back({m == 1 ? "M = 1" : m == 2 ? "M = 2" : "M = 3", paper_method(m).config});
    all.push_back({"M = 2 safeguarded", paper_method(2).config});
    all.back().config.safeguard = true;
    all.push_back({"global", {}});
    return all;
}

io::Plot edge_plot(const TriangleWallSizes& size) {
    return filled_plot(
        "triangle_walls_edge", 1000, 760,
        {{"from_axis", 1.02 * radius}, {"radius", radius}, {"facets", size.finenesses.front().text()}});
}

TemplateRows titles(const std::vector<TubeOfTriangles>& tubes) {
    return rows_of(tubes.size(), [&](std::size_t t) -> TemplateValues {
        return {{"tube", tubes[t].name}, {"what", tubes[t].what}};
    });
}

io::Plot turns_plot(const std::vector<TubeOfTriangles>& tubes, const TriangleWallSizes& size) {
    constexpr const char* reds[] = {"#7A2E00", "#D55E00", "#F5A26F"};
    TemplateRows walls;
    const auto add = [&](const std::string& kind, const std::string& facets, const std::string& look) {
        walls.push_back({{"kind", kind},
                         {"facets", facets},
                         {"look", look},
                         {"title", kind == "closed form" ? "round" : kind + ", " + facets}});
    };
    for (std::size_t k = 0; k < size.finenesses.size(); ++k)
        add("plane", size.finenesses[k].text(), fmt::format("lc rgb '{}'", reds[k]));
    add("closest", size.finenesses.back().text(), "lc rgb '#0072B2'");
    add("field", size.finenesses.back().text(), "lc rgb '#009E73'");
    add("closed form", "round", "dt 2 lc rgb '#666666'");
    return filled_plot("triangle_walls_cycles", 1100, 480,
                       {{"segments", size.segments}, {"tubes", titles(tubes)}, {"walls", walls}});
}

io::Plot states_plot(const std::vector<TubeOfTriangles>& tubes, const std::vector<TriangleMethod>& tried,
                     const TriangleWallSizes& size) {
    constexpr const char* colours[] = {"#999999", "#E69F00", "#0072B2", "#009E73", "#56B4E9", "#000000"};
    constexpr int shapes[] = {2, 9, 7, 5, 6, 13};
    const int fine = static_cast<int>(size.finenesses.size()), walls = 3 * fine + 1;
    std::string names;
    int place = 0;
    for (const char* kind : {"plane", "closest", "field"})
        for (const Fineness& fineness : size.finenesses)
            names += fmt::format("'{} {}' {}, ", kind, fineness.text(), place++);
    TemplateRows panels = titles(tubes);
    for (std::size_t t = 0; t < tubes.size(); ++t) panels[t].push_back({"before", t * walls});
    const auto method = [&](std::size_t m) -> TemplateValues {
        return {{"method", tried[m].name}, {"shape", shapes[m]}, {"colour", colours[m]}};
    };
    return filled_plot("triangle_walls", 1100, 600,
                       {{"last", walls - 1},
                        {"walls", names},
                        {"fine", fine},
                        {"balanced", balanced},
                        {"tubes", panels},
                        {"count", tried.size()},
                        {"methods", rows_of(tried.size(), method)},
                        {"cycles", size.cycles},
                        {"segments", size.segments}});
}

/// Largest change of a column between neighbouring places of one line, 0.5 µm apart.
double largest_step(const io::Table& edge, const std::string& line, const std::string& column) {
    double largest = 0;
    for (std::size_t row = 1; row < edge.rows.size(); ++row)
        if (edge.word(row, "line") == line && edge.word(row - 1, "line") == line)
            largest = std::max(largest, std::abs(edge.number(row, column) - edge.number(row - 1, column)));
    return largest;
}

std::vector<Claim> claims(const std::vector<NamedWall>& walls, const std::vector<TriangleMethod>& tried,
                          const std::vector<Ending>& endings, const io::Table& edge) {
    const auto at_rest = [&](const std::string& kind, std::initializer_list<int> methods) {
        int all = 0, resting = 0;
        for (std::size_t w = 0; w < walls.size(); ++w) {
            if (walls[w].kind != kind) continue;
            for (const int m : methods) ++all, resting += endings[w * tried.size() + m].rests();
        }
        return std::pair(resting, all);
    };
    std::vector<Claim> list;
    const auto claim = [&](const std::string& text, bool should, std::pair<int, int> found,
                           const std::string& note) {
        list.push_back({"Extension: " + text + " [cases at rest]", should ? "all" : "none",
                        fmt::format("{} of {}", found.first, found.second),
                        should ? found.first == found.second : found.first == 0, note});
    };
    claim("on planes first order and M = 1, 2, 3 do not come to rest", false, at_rest("plane", {0, 1, 2, 3}),
          "By fineness and tube. Joints hop between facets.");
    claim("on planes the safeguard brings no rest either", false, at_rest("plane", {4}),
          "A wire that stands still on planes has a gradient far from zero: it is stuck.");
    claim("on planes the global relaxer does not rest", false, at_rest("plane", {5}),
          "It ends after a few trials with which the energy rose.");
    claim("on the closest feature M = 2 and M = 3 do not rest", false, at_rest("closest", {2, 3}),
          "R lacks the curvature of edges and corners.");
    claim("on the closest feature M = 2 rests with the safeguard", true, at_rest("closest", {4}),
          "The slope is continuous: there is a place to rest at.");
    claim("on the closest feature the global relaxer rests", true, at_rest("closest", {5}),
          "It uses the curvature of edges and corners.");
    claim("on the field M = 2 and M = 3 rest", true, at_rest("field", {2, 3}), "The same meshes.");
    claim("on the field the global relaxer rests", true, at_rest("field", {5}), "The same meshes.");
    for (int t = 0; t < 2; ++t) {
        std::vector<double> turns;
        for (std::size_t w = 0; w < walls.size(); ++w)
            if (walls[w].tube == t && walls[w].planes)
                turns.push_back(endings[w * tried.size() + 2].turns.back());
        list.push_back({fmt::format("Extension: finer facets leave less unrest, {} tube: mean turn with M = "
                                    "2, coarsest over finest [-]",
                                    t == 0 ? "sinuous" : "sharp"),
                        "> 1", turns.front() / turns.back(), turns.front() > turns.back(),
                        "On planes, in the last cycle."});
    }
    for (const std::string line : {"around", "along"}) {
        const double plane = largest_step(edge, line, "plane_N"), field = largest_step(edge, line, "field_N");
        list.push_back({fmt::format("Extension: the push along the way jumps where a joint passes an edge, "
                                    "{}: on planes over that on the field [-]",
                                    line == "around" ? "round the vessel" : "along a bend"),
                        "> 10", plane / field, plane > 10 * field,
                        fmt::format("Largest change within 0.5 µm: {:.3g} N on planes, {:.3g} N on the "
                                    "closest feature, {:.2g} N on the field.",
                                    plane, largest_step(edge, line, "closest_N"), field)});
    }
    return list;
}

}  // namespace

StudyResult run_triangle_walls(const StudyOptions& options) {
    const TriangleWallSizes size = triangle_wall_sizes(options);
    const std::vector<TubeOfTriangles> tube = tubes(size);
    const std::vector<NamedWall> wall = walls(tube, size);
    const std::vector<TriangleMethod> method_list = methods();
    const int count = static_cast<int>(wall.size() * method_list.size());
    std::vector<Chain> reference;
    for (const NamedWall& w : wall)
        if (w.kind == "closed form") reference.push_back(global_rest(*w.wall, tube[w.tube].start).wire);
    std::vector<Ending> ending(count);
    Work work(options, count);
    work.run(count, [&](int k) {
        const NamedWall& w = wall[k / method_list.size()];
        const TriangleMethod& m = method_list[k % method_list.size()];
        ending[k] = relaxed(m.config, w, tube[w.tube].start, reference[w.tube], size.cycles);
        return fmt::format("{}, {} {}, {}", tube[w.tube].name, w.kind, w.fineness, m.name);
    });
    StudyResult result;
    io::Table table{"triangle_walls",
                    {"tube", "wall", "facets", "method", "state", "mean_turn", "gradient", "energy_N_mm",
                     "rise_N_mm", "hops_per_contact", "off_round_mm"}};
    io::Table cycles{"triangle_walls_cycles", {"tube", "wall", "facets", "cycle", "mean_turn"}};
    for (int k = 0; k < count; ++k) {
        const NamedWall& w = wall[k / method_list.size()];
        const TriangleMethod& m = method_list[k % method_list.size()];
        const Ending& e = ending[k];
        const double none = std::nan("");
        const bool in_cycles = !e.turns.empty();
        table.add({tube[w.tube].name, w.kind, w.fineness, m.name, e.state(),
                   in_cycles ? e.turns.back() : none, e.gradient, e.energy, in_cycles ? e.rise : none,
                   in_cycles && w.planes ? e.hops : none, e.moved});
        if (m.name != std::string("M = 2")) continue;
        for (std::size_t c = 0; c < e.turns.size(); ++c)
            cycles.add({tube[w.tube].name, w.kind, w.fineness, c + 1, e.turns[c]});
    }
    const auto sharp = std::ranges::find(wall, 1, &NamedWall::tube);
    std::vector<NamedWall> coarse(sharp, sharp + 3);
    coarse.push_back(wall.back());
    io::Table edge = edge_table(coarse);
    result.claims = claims(wall, method_list, ending, edge);
    result.plots = {edge_plot(size), turns_plot(tube, size), states_plot(tube, method_list, size)};
    result.page = filled_page("triangle-walls",
                              {{"radius", radius},
                               {"name0", tube[0].name},
                               {"what0", tube[0].what},
                               {"name1", tube[1].name},
                               {"what1", tube[1].what},
                               {"segments", size.segments},
                               {"segment_length", segment_length},
                               {"rigidity", rigidity},
                               {"stiffness", wall_stiffness},
                               {"cycles", size.cycles},
                               {"still", still},
                               {"balanced", balanced},
                               {"table", io::to_markdown(table, 3)}},
                              result, options);
    result.tables = {std::move(table), std::move(cycles), std::move(edge)};
    return result;
}

}  // namespace studies
