#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/io/cpu_clock.h"
#include "engine/studies/bent_tube.h"
#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/plane_wire.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using physics::EndCells;
using physics::LumenWall;

/// A quantity of the exact wire, and the error of a chain: for a length relative to the wire's length, for
/// all else relative to the exact value.
struct AgainstExact {
    std::string quantity;
    double exact = 0, measured = 0, error = 0;
};

/// A wall, and a wire in it that is not yet at rest.
struct ExactStart {
    std::unique_ptr<const physics::LumenWall> wall;
    physics::Chain start;
};

struct ExactCase {
    std::string id, title, text;
    std::string headline;       // the quantity in the picture
    std::string look;           // gnuplot's style of its lines
    double length = 0;          // [mm]
    std::vector<int> segments;  // the last also serves as the exact curve's guess
    bool has_ends = true;       // otherwise only places far from both ends are compared
    std::function<ExactStart(int segments, physics::EndCells)> set = {};
    std::function<std::vector<AgainstExact>(const physics::Chain&, const physics::LumenWall&)> measure = {};
    double exact_residual = 0, exact_step_error = 0;
};

/// Values common to all cases: EI of a wire alone [N·mm²]; the wall met by a tip alone, flat and of the bent
/// tube [N/mm]; the wall that helix and arc lie on, per mm of wire [N/mm²].
constexpr double exact_rigidity = 50, flat_stiffness = 1e4, bent_stiffness = 42, per_length = 42;

constexpr double bend = 30, bent_radius = 3, flat_wall_height = 6;        // of the tubes [mm]
constexpr double arc_bend_radius = 60, arc_radius = 2, arc_angle = 3.03;  // of the arc's tube [mm], [rad]
constexpr double helix_radius = 2, helix_pitch = 0.5;  // of the helix's tube [mm]; to its axis [rad]

AgainstExact relative(const std::string& quantity, double exact, double measured) {
    return {quantity, exact, measured, std::abs(measured / exact - 1)};
}

Chain wire_of(double length, int segments, EndCells ends, const Vec3& entry, const Vec3& clamped,
              const std::function<Vec3(double)>& tangent) {
    const double lambda = length / segments;
    std::vector<Vec3> tangents;
    for (int i = 0; i < segments; ++i) tangents.push_back(tangent((i + 0.5) * lambda));
    return physics::uniform_wire(exact_rigidity, lambda, entry, clamped, tangents, ends);
}

Vec3 heading(double angle) {
    return {std::cos(angle), std::sin(angle), 0};
}

/// Wall stiffness for a joint of the spec's λ at which the tip gets this stiffness under either rule.
double for_tip(double stiffness, EndCells ends) {
    return ends == EndCells::Half ? 2 * stiffness : stiffness;
}

/// Tip and farthest joint of a wire of this length, whose joint i lies off(i) from the exact wire's [mm], and
/// its energy.
std::vector<AgainstExact> compared(const Chain& wire, const LumenWall& wall, double length,
                                   double exact_energy, const std::function<double(int)>& off) {
    double farthest = 0, tip = 0;
    for (int i = 0; i <= wire.segments(); ++i) farthest = std::max(farthest, tip = off(i));
    const double energy = physics::total_energy(wire, physics::all_contacts(wire, wall)).total();
    return {{"tip", 0, tip, tip / length},
            {"farthest joint", 0, farthest, farthest / length},
            relative("energy", exact_energy, energy)};
}

/// Uses the global relaxer, to a gradient over C of 1e-11.
void bring_to_rest(Chain& wire, const LumenWall& wall) {
    physics::RelaxerConfig config;
    config.tolerance = 1e-11;
    physics::make_relaxer(config, wall)->relax(wire, {1'000'000'000, 0, 0});
}

/// Compares tip, farthest joint, energy and, on a wall, the force of the tip with the exact wire in a plane.
void hold_to_exact(ExactCase& c, const PlaneWire& problem) {
    ExactStart fine = c.set(c.segments.back(), EndCells::Half);
    bring_to_rest(fine.start, *fine.wall);
    const auto contacts = physics::all_contacts(fine.start, *fine.wall);
    Vec3 force = -contacts.back().push() + problem.length * Vec3(problem.load[0], problem.load[1], 0);
    const double turn = std::asin(fine.start.tangents[0].cross(fine.start.tangents[1]).z());
    const PlaneCurve curve = exact_curve(problem, c.segments.back(), fine.start.spring_constant(0) * turn,
                                         Vec2(force[0], force[1]));
    c.exact_residual = curve.residual;
    c.exact_step_error = curve.step_error;
    c.measure = [curve, problem](const Chain& wire, const LumenWall& wall) {
        const int each = static_cast<int>(curve.points.size() - 1) / wire.segments();
        auto list = compared(wire, wall, problem.length, curve.energy, [&](int i) {
            const Vec2& x = curve.points[static_cast<std::size_t>(i) * each].place;
            return (wire.joints[i] - Vec3(x[0], x[1], 0)).norm();
        });
        if (problem.wall)
            list.push_back(relative("force", curve.points.back().force.norm(),
                                    physics::all_contacts(wire, wall).back().force()));
        return list;
    };
}

ExactCase flat_wall() {
    ExactCase c{
        "wall",
        "clamped wire on a wall: force",
        fmt::format("20 mm of wire clamped at 0.6 rad to a flat wall {:g} mm away, on which its tip slides",
                    flat_wall_height),
        "force",
        "lc rgb '#D55E00'",
        20,
        {5, 10, 20, 40, 80}};
    c.set = [](int n, EndCells ends) {
        const auto tangent = [](double s) { return heading(0.6 * (1 - 0.8 * s / 20)); };
        return ExactStart{
            std::make_unique<physics::TubeWall>(geometry::Polyline{{-20, 0, 0}, {60, 0, 0}}, flat_wall_height,
                                                for_tip(flat_stiffness, ends)),
            wire_of(20, n, ends, Vec3::Zero(), heading(0.6), tangent)};
    };
    PlaneWire problem{.rigidity = exact_rigidity, .length = 20, .angle = 0.6};
    problem.wall = [](const Vec2& x) { return PlaneContact{x[1] - flat_wall_height, Vec2(0, 1)}; };
    problem.tip_stiffness = flat_stiffness;
    hold_to_exact(c, problem);
    return c;
}

ExactCase bent_tube() {
    ExactCase c{"bent tube",
                "wire through a bent tube: farthest joint",
                fmt::format("60 mm of wire in a tube of radius {:g} mm bent to {:g} mm, clamped on its axis, "
                            "the tip on its outer wall",
                            bent_radius, bend),
                "farthest joint",
                "lc rgb '#0072B2'",
                60,
                {15, 30, 60, 120, 240}};
    c.set = [](int n, EndCells ends) {
        const auto tangent = [](double s) { return heading(s / bend); };
        return ExactStart{std::make_unique<BentTube>(bend, 2.7, bent_radius, for_tip(bent_stiffness, ends)),
                          wire_of(60, n, ends, Vec3::Zero(), heading(0), tangent)};
    };
    PlaneWire problem{.rigidity = exact_rigidity, .length = 60};
    problem.wall = [](const Vec2& x) {
        const Vec2 out = x - Vec2(0, bend);
        const double beyond = out.norm() - bend;
        return PlaneContact{std::abs(beyond) - bent_radius, std::copysign(1.0, beyond) * out.normalized()};
    };
    problem.tip_stiffness = bent_stiffness;
    hold_to_exact(c, problem);
    return c;
}

ExactCase weight(const char* id, double load, const char* how, const char* look) {
    ExactCase c{id,
                fmt::format("{}: tip", id),
                fmt::format("40 mm of wire clamped level, far from any wall, under {:g} N/mm: {}", load, how),
                "tip",
                look,
                40,
                {25, 50, 100, 200, 400}};
    c.set = [load](int n, EndCells ends) {
        ExactStart s{
            std::make_unique<physics::TubeWall>(geometry::Polyline{{-50, 0, 0}, {90, 0, 0}}, 80.0, 1.0),
            wire_of(40, n, ends, Vec3::Zero(), heading(0), [](double) { return heading(0); })};
        s.start.load = Vec3(0, -load, 0);
        return s;
    };
    hold_to_exact(c, {.rigidity = exact_rigidity, .length = 40, .load = Vec2(0, -load)});
    return c;
}

/// First and last joint of the middle quarter.
std::pair<int, int> middle(const Chain& wire) {
    return {wire.segments() * 3 / 8, wire.segments() * 5 / 8};
}

/// The wall's force on everything distal of a joint.
Vec3 push_from(const std::vector<physics::WallContact>& contacts, int joint) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = contacts.size() - 1; i >= static_cast<std::size_t>(joint); --i)
        sum += contacts[i].push();
    return sum;
}

ExactCase helix() {
    ExactCase c{"helix",
                "helix in a cylinder: axial force",
                fmt::format("200 mm of wire held short in a straight closed tube of radius {:g} mm, where it "
                            "lies as a helix at about {:g} rad to the axis; in the middle quarter F = 2EI "
                            "sin²a cos a/r², w = EI sin⁴a/r³, a and r those of its joints",
                            helix_radius, helix_pitch),
                "axial force",
                "lc rgb '#009E73'",
                200,
                {50, 100, 200, 400, 800},
                false};
    c.set = [](int n, EndCells ends) {
        const double turn = std::sin(helix_pitch) / helix_radius;
        const auto tangent = [=](double s) {
            return Vec3(std::cos(helix_pitch), -std::sin(helix_pitch) * std::sin(turn * s),
                        std::sin(helix_pitch) * std::cos(turn * s));
        };
        const geometry::Polyline axis = {{-20, 0, 0}, {200 * std::cos(helix_pitch) - 0.5, 0, 0}};
        return ExactStart{std::make_unique<physics::TubeWall>(axis, helix_radius, per_length * 200 / n),
                          wire_of(200, n, ends, Vec3(0, helix_radius, 0), tangent(0), tangent)};
    };
    c.measure = [](const Chain& wire, const LumenWall& wall) -> std::vector<AgainstExact> {
        const auto [first, last] = middle(wire);
        const auto contacts = physics::all_contacts(wire, wall);
        double turn = 0, advance = 0, radius = 0, pressing = 0;
        for (int i = first; i < last; ++i) {
            const Vec3 &p = wire.joints[i], &q = wire.joints[i + 1];
            turn += std::atan2(p.y() * q.z() - p.z() * q.y(), p.y() * q.y() + p.z() * q.z());
            advance += q.x() - p.x();
            radius += std::hypot(p.y(), p.z()) / (last - first);
            pressing += contacts[i].force() / wire.lengths[i] / (last - first);
        }
        const double angle = std::atan2(radius * turn, advance), s = std::sin(angle);
        return {relative("axial force", 2 * exact_rigidity * s * s * std::cos(angle) / (radius * radius),
                         push_from(contacts, last).x()),
                relative("wall force", exact_rigidity * std::pow(s, 4) / std::pow(radius, 3), pressing)};
    };
    return c;
}

ExactCase arc() {
    ExactCase c{"arc",
                "arc in a bent tube: bending moment",
                fmt::format("188 mm of wire held short in a closed tube of radius {:g} mm bent to {:g} mm, "
                            "along its outer wall; in the middle M = EI/ρ and w = C/ρ, C the wire's "
                            "compression and ρ the radius of its joints",
                            arc_radius, arc_bend_radius),
                "moment",
                "lc rgb '#CC79A7'",
                188,
                {47, 94, 188, 376, 752},
                false};
    c.set = [](int n, EndCells ends) {
        // From the axis to the outer wall in 20 mm, then along it.
        const auto tangent = [](double s) {
            if (s > 20) return heading(20 / arc_bend_radius + (s - 20) / (arc_bend_radius + arc_radius));
            return heading(s / arc_bend_radius - arc_radius / 20 * (1 - std::cos(2 * M_PI * s / 20)));
        };
        return ExactStart{
            std::make_unique<BentTube>(arc_bend_radius, arc_angle, arc_radius, per_length * 188 / n),
            wire_of(188, n, ends, Vec3::Zero(), heading(0), tangent)};
    };
    c.measure = [](const Chain& wire, const LumenWall& wall) -> std::vector<AgainstExact> {
        const int joint = wire.segments() / 2;
        const auto contacts = physics::all_contacts(wire, wall);
        const double rho = (wire.joints[joint] - Vec3(0, arc_bend_radius, 0)).norm();
        Vec3 moment = Vec3::Zero();
        for (int i = joint + 1; i <= wire.segments(); ++i)
            moment -= (wire.joints[i] - wire.joints[joint]).cross(contacts[i].push());
        const double compression = push_from(contacts, joint + 1).dot(wire.tangents[joint + 1]);
        return {relative("moment", exact_rigidity / rho, moment.z()),
                relative("wall force", compression / rho, contacts[joint].force() / wire.lengths[joint])};
    };
    return c;
}

/// Devices on a chain of so many segments, in a place where nothing touches them.
ExactStart nested_start(const std::vector<physics::Device>& devices, int segments, EndCells ends) {
    const double length = devices[0].inserted;
    return {std::make_unique<physics::TubeWall>(geometry::Polyline{{-500, 0, 0}, {500, 0, 0}}, 400.0, 1.0),
            physics::chain_along(devices, {length / segments, ends}, {{0, 0, 0}, {length, 0, 0}})};
}

physics::Device uniform_device(double rigidity, double inserted) {
    physics::Device device;
    device.spec.sections = {{0, rigidity, rigidity}};
    device.inserted = inserted;
    return device;
}

/// Two curved rods, the outer one's end a third of a cell from a joint however long the cells are. Each bends
/// as the sum of the moments has it: an arc where both are, another one beyond, whose plane starts from the
/// first's parallel-transported directors.
ExactCase nested_rods(const char* id, double apart, const char* look) {
    constexpr double inner_length = 120, outer_length = 80 + 4.0 / 3;
    constexpr double inner_rigidity = 60, outer_rigidity = 150, inner_bend = 1.0 / 50, outer_bend = 1.0 / 67;
    ExactCase c{id,
                fmt::format("{}: farthest joint", id),
                fmt::format("{:g} mm of rod (EI {:g} N·mm², radius at rest {:g} mm) in {:.2f} mm of another "
                            "(EI {:g} N·mm², {:g} mm), free, their planes {:g}° apart",
                            inner_length, inner_rigidity, 1 / inner_bend, outer_length, outer_rigidity,
                            1 / outer_bend, apart),
                "farthest joint",
                look,
                inner_length,
                {30, 60, 120, 240, 480}};
    const double roll = apart * geometry::degree;
    c.set = [roll](int n, EndCells ends) {
        std::vector<physics::Device> devices = {uniform_device(inner_rigidity, inner_length),
                                                uniform_device(outer_rigidity, outer_length)};
        devices[0].spec.shape = {{inner_length, inner_length * inner_bend, 0}};
        devices[1].spec.shape = {{outer_length, outer_length * outer_bend, 0}};
        devices[1].roll = roll;
        return nested_start(devices, n, ends);
    };
    const Vec2 inner(inner_bend, 0),
        outer = outer_bend * Vec2(std::cos(roll), std::sin(roll)),
        both = (inner_rigidity * inner + outer_rigidity * outer) / (inner_rigidity + outer_rigidity);
    const double energy =
        0.5 * outer_length *
        (inner_rigidity * (both - inner).squaredNorm() + outer_rigidity * (both - outer).squaredNorm());
    c.measure = [=](const Chain& wire, const LumenWall& wall) -> std::vector<AgainstExact> {
        geometry::Mat3 start;  // directors and tangent
        start << wire.base_director, wire.tangents[0].cross(wire.base_director), wire.tangents[0];
        const auto along = [](const Vec2& curvature, double s, Vec3& x, geometry::Mat3& frame) {
            const double turn = curvature.norm() * s;
            const Vec3 inward = (frame.leftCols<2>() * curvature).normalized(), u = frame.col(2);
            x += s / turn * (std::sin(turn) * u + (1 - std::cos(turn)) * inward);
            frame = Eigen::AngleAxisd(turn, u.cross(inward)) * frame;
        };
        return compared(wire, wall, inner_length, energy, [&](int i) {
            const double s = i * wire.grid.segment_length;
            Vec3 x = wire.joints[0];
            geometry::Mat3 frame = start;
            if (s > 0) along(both, std::min(s, outer_length), x, frame);
            if (s > outer_length) along(inner, s - outer_length, x, frame);
            return (wire.joints[i] - x).norm();
        });
    };
    return c;
}

ExactCase ahead_of_a_catheter() {
    constexpr double length = 60, covered = 124.0 / 3, load = 1e-3, wire = 6, catheter = 200;
    ExactCase c{"wire ahead",
                "wire ahead of a catheter: tip",
                fmt::format("{:g} mm of wire (EI {:g} N·mm²) in {:.2f} mm of a catheter (EI {:g} N·mm²), "
                            "clamped level, under {:g} N/mm",
                            length, wire, covered, catheter, load),
                "tip",
                "lc rgb '#44AA99'",
                length,
                {15, 30, 60, 120, 240}};
    c.set = [](int n, EndCells ends) {
        ExactStart s =
            nested_start({uniform_device(wire, length), uniform_device(catheter, covered)}, n, ends);
        s.start.load = Vec3(0, -load, 0);
        return s;
    };
    hold_to_exact(c, {.rigidity = wire,
                      .length = length,
                      .stiffer_length = covered,
                      .stiffer_rigidity = wire + catheter,
                      .load = Vec2(0, -load)});
    return c;
}

/// A clamped wire on a wall, one through a bent tube, two under loads; a helix and an arc far from their
/// ends; pairs of nested rods, free in space; a wire ahead of a catheter's end, under a load.
std::vector<ExactCase> exact_cases() {
    return {flat_wall(),
            bent_tube(),
            weight("small load", 1e-5, "the tip sinks 0.06 mm", "lc rgb '#E69F00'"),
            weight("large load", 4e-3, "the tip sinks 21 mm", "lc rgb '#56B4E9'"),
            helix(),
            arc(),
            nested_rods("opposed rods", 180, "lc rgb '#882255'"),
            nested_rods("aligned rods", 0, "lc rgb '#999933'"),
            nested_rods("crossed rods", 90, "lc rgb '#332288'"),
            ahead_of_a_catheter()};
}

constexpr std::array rule_table = {EndCells::Half, EndCells::Paper};

std::string word(EndCells ends) {
    return ends == EndCells::Half ? "half" : "paper";
}

/// Slope of log error over log λ through the finest three, by least squares [-]; none where rounding
/// dominates.
double order_of(const std::vector<double>& lambdas, const std::vector<double>& errors) {
    const std::size_t n = lambdas.size(), from = n - 3;
    if (*std::max_element(errors.begin(), errors.end()) < 1e-6)
        return std::numeric_limits<double>::quiet_NaN();
    double x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t i = from; i < n; ++i) {
        const double a = std::log(lambdas[i]), b = std::log(errors[i]);
        x += a / 3, y += b / 3, xx += a * a / 3, xy += a * b / 3;
    }
    return (xy - x * y) / (xx - x * x);
}

struct Order {
    std::string id, quantity;
    EndCells ends;
    double order = 0;
};

/// A method compared in the bent tube, with the rule for the ends that it uses there.
struct Contender {
    std::string name;
    physics::RelaxerConfig config;
    EndCells ends = EndCells::Paper;
    std::string look;
};

std::vector<Contender> contenders() {
    std::vector<Contender> list = {
        {"global (half cells)", {}, EndCells::Half, "lc rgb '#D55E00' lw 2 pt 7"},
        {"global (clamp of the paper)", {}, EndCells::Paper, "lc rgb '#D55E00' dt 2 pt 6"}};
    physics::RelaxerConfig first;
    first.kind = physics::RelaxerKind::FirstOrder;
    list.push_back({"first order", first, EndCells::Paper, "lc rgb '#999999' pt 4"});
    for (int m = 1; m <= 3; ++m) {
        const NamedMethod method = paper_method(m);
        list.push_back(
            {method.name, method.config, EndCells::Paper, method.look + fmt::format(" pt {}", 4 + 2 * m)});
    }
    return list;
}

struct Cost {
    double cpu = 0, farthest = 0;  // [s], [mm]
};

Cost cost_of(const ExactCase& c, const Contender& contender, int segments, int cycles) {
    const bool global = contender.config.kind == physics::RelaxerKind::Global;
    std::vector<double> times;
    Cost cost;
    for (int k = 0; k < (global ? 9 : 1); ++k) {
        ExactStart s = c.set(segments, contender.ends);
        const auto relaxer = physics::make_relaxer(contender.config, *s.wall);
        const double start = io::thread_cpu_seconds();
        relaxer->relax(s.start, global ? physics::RelaxBudget{1'000'000'000, 0, 0}
                                       : physics::whole_cycles(segments, cycles));
        times.push_back(io::thread_cpu_seconds() - start);
        cost.farthest = c.measure(s.start, *s.wall)[1].measured;
    }
    cost.cpu = quantile(times, 0.5);
    return cost;
}

io::Plot picture(const std::vector<ExactCase>& cases, const std::vector<Contender>& list, int cycles) {
    TemplateRows errors;
    for (const ExactCase& c : cases)
        for (const EndCells ends : rule_table) {
            if (ends == EndCells::Paper && !c.has_ends) continue;
            const bool half = ends == EndCells::Half;
            errors.push_back({{"case", c.id},
                              {"quantity", c.headline},
                              {"clamp", word(ends)},
                              {"look", c.look},
                              {"points", half ? "pt 7 ps 0.8 lw 2" : "pt 6 ps 0.8 dt '- '"},
                              {"title", half ? fmt::format("title '{}'", c.title) : std::string("notitle")}});
        }
    const auto method = [&](std::size_t k) -> TemplateValues {
        return {{"method", list[k].name}, {"look", list[k].look}};
    };
    return filled_plot("accuracy", 1300, 780,
                       {{"cases", errors},
                        {"methods", rows_of(list.size(), method)},
                        {"first", list.front().name},
                        {"cycles", cycles}});
}

}  // namespace

StudyResult run_accuracy(const StudyOptions& options) {
    const int cycles = options.quick ? 20 : 200;
    const std::vector<ExactCase> cases = exact_cases();
    const std::vector<Contender> list = contenders();
    const ExactCase& raced = cases[1];
    const int lengths = options.quick ? 3 : 5;  // of segments, in the comparison
    struct Found {
        std::vector<AgainstExact> measured;
        double gradient = 0;
        int contacts = 0;
    };
    const int sizes = static_cast<int>(cases.front().segments.size()),
              rules = static_cast<int>(rule_table.size());
    const int rests = static_cast<int>(cases.size()) * rules * sizes,
              races = static_cast<int>(list.size()) * lengths;
    Work work(options, rests + races);
    std::vector<Found> results(static_cast<std::size_t>(rests));
    work.run(rests, [&](int k) {
        const ExactCase& c = cases[k / (rules * sizes)];
        const EndCells ends = rule_table[k / sizes % rules];
        const int n = c.segments[k % sizes];
        ExactStart s = c.set(n, ends);
        bring_to_rest(s.start, *s.wall);
        const auto contacts = physics::all_contacts(s.start, *s.wall);
        const auto touching =
            std::count_if(contacts.begin(), contacts.end(), [](const auto& x) { return x.touches(); });
        results[k] = {c.measure(s.start, *s.wall), physics::relative_gradient(s.start, contacts),
                      static_cast<int>(touching)};
        return fmt::format("{}, {}, N = {}", c.id, word(ends), n);
    });
    std::vector<Cost> costs(static_cast<std::size_t>(races));
    work.run(races, [&](int k) {
        const Contender& contender = list[k / lengths];
        const int n = raced.segments[k % lengths];
        costs[k] = cost_of(raced, contender, n, cycles);
        return fmt::format("{}, N = {}", contender.name, n);
    });

    io::Table errors{"accuracy",
                     {"case", "quantity", "clamp", "segments", "segment_length_mm", "exact", "measured",
                      "relative_error", "contacts", "gradient"}};
    io::Table orders{"accuracy_orders",
                     {"case", "quantity", "clamp", "order", "error_at_1_mm", "finest_error"}};
    std::vector<Order> found;
    const double none = std::numeric_limits<double>::quiet_NaN();
    double at_rest = 0, force_half = none, force_paper = none, tip_200 = none;
    for (int c = 0; c < static_cast<int>(cases.size()); ++c)
        for (int r = 0; r < rules; ++r) {
            const ExactCase& now = cases[c];
            const Found* first = &results[(c * rules + r) * sizes];
            for (std::size_t q = 0; q < first->measured.size(); ++q) {
                std::vector<double> lambdas, off;
                double at_one = none;
                for (int k = 0; k < sizes; ++k) {
                    const AgainstExact& m = first[k].measured[q];
                    lambdas.push_back(now.length / now.segments[k]);
                    off.push_back(m.error);
                    at_rest = std::max(at_rest, first[k].gradient);
                    const bool place = m.quantity == "tip" || m.quantity == "farthest joint";
                    errors.add({now.id, m.quantity, word(rule_table[r]), now.segments[k], lambdas.back(),
                                place ? none : m.exact, m.measured, m.error, first[k].contacts,
                                first[k].gradient});
                    if (lambdas.back() == 1) at_one = m.error;
                    if (now.id == "large load" && m.quantity == "tip" && now.segments[k] == 200 && r == 0)
                        tip_200 = m.error;
                }
                const std::string& quantity = first->measured[q].quantity;
                if (now.id == "wall" && quantity == "force") (r == 0 ? force_half : force_paper) = at_one;
                found.push_back({now.id, quantity, rule_table[r], order_of(lambdas, off)});
                orders.add({now.id, quantity, word(rule_table[r]), found.back().order, at_one, off.back()});
            }
        }
    io::Table race{
        "accuracy_cost",
        {"method", "clamp", "segments", "segment_length_mm", "cycles", "cpu_s", "farthest_joint_mm"}};
    for (int k = 0; k < races; ++k) {
        const Contender& contender = list[k / lengths];
        const int n = raced.segments[k % lengths];
        const bool global = contender.config.kind == physics::RelaxerKind::Global;
        race.add({contender.name, word(contender.ends), n, raced.length / n,
                  global ? none : static_cast<double>(cycles), costs[k].cpu, costs[k].farthest});
    }

    StudyResult result;
    const std::string how = "slope of log error over log λ through the three finest λ";
    for (const Order& o : found) {
        const ExactCase& c =
            *std::find_if(cases.begin(), cases.end(), [&](const ExactCase& x) { return x.id == o.id; });
        if (o.quantity != c.headline || (!c.has_ends && o.ends == EndCells::Paper)) continue;
        const bool half = o.ends == EndCells::Half;
        result.claim(fmt::format("order in λ of the {} ({}), {}", c.headline, c.id,
                                 !c.has_ends ? "far from the ends"
                                 : half      ? "half cells"
                                             : "the paper's clamp"),
                     half ? 2.0 : 1.0, o.order, std::abs(o.order - (half ? 2 : 1)) <= 0.1, how);
    }
    result.claim("force of a clamped wire on a wall at λ = 1 mm, half cells, off by [%]", 0.12,
                 100 * force_half, 100 * force_half <= 0.12 * 1.1,
                 "20 mm of wire; it goes as the square of λ over the wire's length");
    result.claim("force of a clamped wire on a wall at λ = 1 mm, the paper's clamp, off by [%]", 6.9,
                 100 * force_paper, std::abs(100 * force_paper - 6.9) < 0.7,
                 "20 mm of wire; it goes as λ over the wire's length");
    result.claim("tip of a wire under a large load at N = 200, half cells, off by [L]", 2e-5, tip_200,
                 tip_200 <= 2e-5 * 1.1, "the tip sinks by half the wire's length");
    result.plots = {picture(cases, list, cycles)};

    double residual = 0, step_error = 0;
    std::string texts;
    for (const ExactCase& c : cases) {
        texts += fmt::format("\n- **{}**: {}.", c.id, c.text);
        residual = std::max(residual, c.exact_residual);
        step_error = std::max(step_error, c.exact_step_error);
    }
    result.page = filled_page("accuracy",
                              {{"cases", texts},
                               {"rigidity", exact_rigidity},
                               {"residual", residual},
                               {"step_error", step_error},
                               {"at_rest", at_rest},
                               {"flat", flat_stiffness},
                               {"bent", bent_stiffness},
                               {"per_length", per_length},
                               {"orders", io::to_markdown(orders, 3)},
                               {"cycles", cycles},
                               {"race", io::to_markdown(race, 3)}},
                              result, options);
    result.tables = {std::move(errors), std::move(orders), std::move(race)};
    return result;
}

}  // namespace studies
