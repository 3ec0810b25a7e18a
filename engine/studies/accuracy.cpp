#include "engine/studies/accuracy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <numeric>

#include "engine/cpu_clock.h"
#include "engine/studies/bent_tube.h"
#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/plane_wire.h"
#include "engine/studies/work.h"
#include "physics/energy.h"
#include "physics/relaxer.h"
#include "physics/tube_wall.h"

namespace engine {
namespace {

using physics::EndCells;
using physics::Guidewire;
using physics::LumenWall;
using physics::Vec2;
using physics::Vec3;

constexpr double kRigidity = 50;        // EI of every wire [N·mm²]
constexpr double kFlatStiffness = 1e4;  // of the flat wall, for the tip that alone meets it [N/mm]
constexpr double kBentStiffness = 42;   // of the bent tube's, as in the paper's scenes [N/mm]
constexpr double kPerLength = 42;       // of a wall that a wire lies on, for each mm of wire [N/mm²]
constexpr double kBend = 30, kBentRadius = 3, kFlatWall = 6;   // of the tubes [mm]
constexpr double kArc = 60, kArcRadius = 2, kArcAngle = 3.03;  // of the arc's tube [mm], [rad]
constexpr double kHelixRadius = 2, kHelixPitch = 0.5;          // of the helix's tube [mm]; to its axis [rad]
constexpr std::array kRules = {EndCells::Half, EndCells::Paper};

std::string word(EndCells ends) {
    return ends == EndCells::Half ? "half" : "paper";
}

/// A number of the exact wire, and how far a chain is off: a length over that of the wire, all else over the
/// exact number.
struct Measured {
    std::string quantity;
    double exact = 0, measured = 0, error = 0;
};
Measured relative(const std::string& quantity, double exact, double measured) {
    return {quantity, exact, measured, std::abs(measured / exact - 1)};
}

struct Setting {
    std::unique_ptr<const LumenWall> wall;
    Guidewire start;
};

struct Case {
    std::string id, title, text;
    std::string headline;       // the quantity in the picture
    std::string look;           // gnuplot's, of its lines
    double length = 0;          // [mm]
    std::vector<int> segments;  // the last for the exact curve's guess too
    bool has_ends = true;       // else only what is far from both ends is compared
    std::function<Setting(int segments, EndCells)> set;
    std::function<std::vector<Measured>(const Guidewire&, const LumenWall&)> measure;
    double exact_residual = 0, exact_step_error = 0;
};

Guidewire wire_of(double length, int segments, EndCells ends, const Vec3& entry, const Vec3& clamped,
                  const std::function<Vec3(double)>& tangent) {
    const double lambda = length / segments;
    std::vector<Vec3> tangents;
    for (int i = 0; i < segments; ++i) tangents.push_back(tangent((i + 0.5) * lambda));
    return physics::uniform_wire(kRigidity, lambda, entry, clamped, tangents, ends);
}

Vec3 heading(double angle) {
    return {std::cos(angle), std::sin(angle), 0};
}

void rest(Guidewire& wire, const LumenWall& wall) {
    physics::RelaxerConfig config;
    config.tolerance = 1e-11;
    physics::make_relaxer(config)->relax(wire, wall, {1'000'000'000, 0, 0});
}

/// A wall's stiffness for a joint of the spec's λ that gives the tip this one by either rule.
double for_tip(double stiffness, EndCells ends) {
    return ends == EndCells::Half ? 2 * stiffness : stiffness;
}

/// What a wire in a plane is held to: tip, farthest joint, energy and, on a wall, the force of the tip.
void hold_to_exact(Case& c, const PlaneWire& problem) {
    Setting fine = c.set(c.segments.back(), EndCells::Half);
    rest(fine.start, *fine.wall);
    const auto contacts = physics::all_contacts(fine.start, *fine.wall);
    Vec3 force = -contacts.back().push() + problem.length * Vec3(problem.load[0], problem.load[1], 0);
    const double turn = std::asin(fine.start.tangents[0].cross(fine.start.tangents[1]).z());
    const PlaneCurve curve = exact_curve(problem, c.segments.back(), fine.start.spring_constant(0) * turn,
                                         Vec2(force[0], force[1]));
    c.exact_residual = curve.residual;
    c.exact_step_error = curve.step_error;
    c.measure = [curve, problem](const Guidewire& wire, const LumenWall& wall) {
        const int n = wire.segments(), each = static_cast<int>(curve.points.size() - 1) / n;
        double farthest = 0;
        const auto off = [&](int i) {
            const Vec2& x = curve.points[static_cast<std::size_t>(i * each)].place;
            return (wire.joints[i] - Vec3(x[0], x[1], 0)).norm();
        };
        for (int i = 0; i <= n; ++i) farthest = std::max(farthest, off(i));
        const auto at = physics::all_contacts(wire, wall);
        std::vector<Measured> list = {
            {"tip", 0, off(n), off(n) / problem.length},
            {"farthest joint", 0, farthest, farthest / problem.length},
            relative("energy", curve.energy, physics::total_energy(wire, at).total())};
        if (problem.wall)
            list.push_back(relative("force", curve.points.back().force.norm(), at.back().force()));
        return list;
    };
}

Case flat_wall() {
    Case c;
    c.id = "wall";
    c.title = "clamped wire on a wall: force";
    c.text = fmt::format(
        "20 mm of wire clamped at 0.6 rad to a flat wall {:g} mm away, on which its tip slides", kFlatWall);
    c.headline = "force";
    c.look = "lc rgb '#D55E00'";
    c.length = 20;
    c.segments = {5, 10, 20, 40, 80};
    c.set = [](int n, EndCells ends) {
        const auto tangent = [](double s) { return heading(0.6 * (1 - 0.8 * s / 20)); };
        return Setting{std::make_unique<physics::TubeWall>(physics::Polyline{{-20, 0, 0}, {60, 0, 0}},
                                                           kFlatWall, for_tip(kFlatStiffness, ends)),
                       wire_of(20, n, ends, Vec3::Zero(), heading(0.6), tangent)};
    };
    PlaneWire problem{.rigidity = kRigidity, .length = 20, .angle = 0.6};
    problem.wall = [](const Vec2& x) { return PlaneContact{x[1] - kFlatWall, Vec2(0, 1)}; };
    problem.tip_stiffness = kFlatStiffness;
    hold_to_exact(c, problem);
    return c;
}

Case bent_tube() {
    Case c;
    c.id = "bent tube";
    c.title = "wire through a bent tube: farthest joint";
    c.text = fmt::format(
        "60 mm of wire in a tube of radius {:g} mm bent to {:g} mm, clamped on its axis, the tip on its "
        "outer "
        "wall",
        kBentRadius, kBend);
    c.headline = "farthest joint";
    c.look = "lc rgb '#0072B2'";
    c.length = 60;
    c.segments = {15, 30, 60, 120, 240};
    c.set = [](int n, EndCells ends) {
        const auto tangent = [](double s) { return heading(s / kBend); };
        return Setting{std::make_unique<BentTube>(kBend, 2.7, kBentRadius, for_tip(kBentStiffness, ends)),
                       wire_of(60, n, ends, Vec3::Zero(), heading(0), tangent)};
    };
    PlaneWire problem{.rigidity = kRigidity, .length = 60};
    problem.wall = [](const Vec2& x) {
        const Vec2 out = x - Vec2(0, kBend);
        const double beyond = out.norm() - kBend;
        return PlaneContact{std::abs(beyond) - kBentRadius, std::copysign(1.0, beyond) * out.normalized()};
    };
    problem.tip_stiffness = kBentStiffness;
    hold_to_exact(c, problem);
    return c;
}

Case weight(const char* id, double load, const char* how, const char* look) {
    Case c;
    c.id = id;
    c.text = fmt::format("40 mm of wire clamped level, far from any wall, under {:g} N/mm: {}", load, how);
    c.title = fmt::format("{}: tip", id);
    c.headline = "tip";
    c.look = look;
    c.length = 40;
    c.segments = {25, 50, 100, 200, 400};
    c.set = [load](int n, EndCells ends) {
        Setting s{std::make_unique<physics::TubeWall>(physics::Polyline{{-50, 0, 0}, {90, 0, 0}}, 80.0, 1.0),
                  wire_of(40, n, ends, Vec3::Zero(), heading(0), [](double) { return heading(0); })};
        s.start.load = Vec3(0, -load, 0);
        return s;
    };
    hold_to_exact(c, {.rigidity = kRigidity, .length = 40, .load = Vec2(0, -load)});
    return c;
}

/// First and last joint of the middle quarter.
std::pair<int, int> middle(const Guidewire& wire) {
    return {wire.segments() * 3 / 8, wire.segments() * 5 / 8};
}

/// Of the wall on all that is distal of a joint.
Vec3 push_from(const std::vector<physics::WallContact>& contacts, int joint) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = contacts.size() - 1; i >= static_cast<std::size_t>(joint); --i)
        sum += contacts[i].push();
    return sum;
}

Case helix() {
    Case c;
    c.id = "helix";
    c.title = "helix in a cylinder: axial force";
    c.text = fmt::format(
        "200 mm of wire held short in a straight closed tube of radius {:g} mm, where it lies as a helix at "
        "about "
        "{:g} rad to the axis; in the middle quarter F = 2EI sin²a cos a/r², w = EI sin⁴a/r³, a and r those "
        "of "
        "its joints",
        kHelixRadius, kHelixPitch);
    c.headline = "axial force";
    c.look = "lc rgb '#009E73'";
    c.length = 200;
    c.segments = {50, 100, 200, 400, 800};
    c.has_ends = false;
    c.set = [](int n, EndCells ends) {
        const double turn = std::sin(kHelixPitch) / kHelixRadius;
        const auto tangent = [=](double s) {
            return Vec3(std::cos(kHelixPitch), -std::sin(kHelixPitch) * std::sin(turn * s),
                        std::sin(kHelixPitch) * std::cos(turn * s));
        };
        const physics::Polyline axis = {{-20, 0, 0}, {200 * std::cos(kHelixPitch) - 0.5, 0, 0}};
        return Setting{std::make_unique<physics::TubeWall>(axis, kHelixRadius, kPerLength * 200 / n),
                       wire_of(200, n, ends, Vec3(0, kHelixRadius, 0), tangent(0), tangent)};
    };
    c.measure = [](const Guidewire& wire, const LumenWall& wall) -> std::vector<Measured> {
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
        return {relative("axial force", 2 * kRigidity * s * s * std::cos(angle) / (radius * radius),
                         push_from(contacts, last).x()),
                relative("wall force", kRigidity * std::pow(s, 4) / std::pow(radius, 3), pressing)};
    };
    return c;
}

Case arc() {
    Case c;
    c.id = "arc";
    c.title = "arc in a bent tube: bending moment";
    c.text = fmt::format(
        "188 mm of wire held short in a closed tube of radius {:g} mm bent to {:g} mm, along its outer wall; "
        "in the "
        "middle M = EI/ρ and w = C/ρ, C the wire's compression and ρ the radius of its joints",
        kArcRadius, kArc);
    c.headline = "moment";
    c.look = "lc rgb '#CC79A7'";
    c.length = 188;
    c.segments = {47, 94, 188, 376, 752};
    c.has_ends = false;
    c.set = [](int n, EndCells ends) {
        // From the axis to the outer wall in 20 mm, then along it.
        const auto tangent = [](double s) {
            if (s > 20) return heading(20 / kArc + (s - 20) / (kArc + kArcRadius));
            return heading(s / kArc - kArcRadius / 20 * (1 - std::cos(2 * M_PI * s / 20)));
        };
        return Setting{std::make_unique<BentTube>(kArc, kArcAngle, kArcRadius, kPerLength * 188 / n),
                       wire_of(188, n, ends, Vec3::Zero(), heading(0), tangent)};
    };
    c.measure = [](const Guidewire& wire, const LumenWall& wall) -> std::vector<Measured> {
        const int joint = wire.segments() / 2;
        const auto contacts = physics::all_contacts(wire, wall);
        const double rho = (wire.joints[joint] - Vec3(0, kArc, 0)).norm();
        Vec3 moment = Vec3::Zero();
        for (int i = joint + 1; i <= wire.segments(); ++i)
            moment -= (wire.joints[i] - wire.joints[joint]).cross(contacts[i].push());
        const double compression = push_from(contacts, joint + 1).dot(wire.tangents[joint + 1]);
        return {relative("moment", kRigidity / rho, moment.z()),
                relative("wall force", compression / rho, contacts[joint].force() / wire.lengths[joint])};
    };
    return c;
}

/// Slope of log error over log λ through the finest three, by least squares [-]; none where rounding is all.
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

/// A method in the race through the bent tube, with the rule for the ends that it has there.
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

Cost cost_of(const Case& c, const Contender& contender, int segments, int cycles) {
    const bool global = contender.config.kind == physics::RelaxerKind::Global;
    std::vector<double> times;
    Cost cost;
    for (int k = 0; k < (global ? 9 : 1); ++k) {
        Setting s = c.set(segments, contender.ends);
        const auto relaxer = physics::make_relaxer(contender.config);
        const double start = thread_cpu_seconds();
        relaxer->relax(
            s.start, *s.wall,
            global ? physics::RelaxBudget{1'000'000'000, 0, 0} : physics::whole_cycles(segments, cycles));
        times.push_back(thread_cpu_seconds() - start);
        cost.farthest = c.measure(s.start, *s.wall)[1].measured;
    }
    std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
    cost.cpu = times[times.size() / 2];
    return cost;
}

Plot picture(const std::vector<Case>& cases, const std::vector<Contender>& list, int cycles) {
    Plot plot{"accuracy", "", 1300, 700};
    std::string& text = plot.commands;
    text =
        "set multiplot layout 1,2\nset logscale xy\nset format y '10^{%L}'\nset grid lc rgb '#cccccc'\n"
        "set bmargin 12\nset key below left Left reverse maxrows 8 samplen 3 width -2\n"
        "set title 'Error against the length of the segments'\nset xlabel 'λ [mm]'\n"
        "set ylabel 'error over what is exact, of places over the length of the wire'\n"
        "set xrange [0.08:5]\nset yrange [3e-9:1]\nset xtics (0.1, 0.2, 0.5, 1, 2, 4)\nplot ";
    for (const Case& c : cases)
        for (const EndCells ends : kRules) {
            if (ends == EndCells::Paper && !c.has_ends) continue;
            const bool half = ends == EndCells::Half;
            text += fmt::format(
                "'accuracy.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' && strcol(3) eq '{}' ? "
                "$5 : "
                "1/0):8 with linespoints {} {} {}, \\\n     ",
                c.id, c.headline, word(ends), c.look, half ? "pt 7 ps 0.8 lw 2" : "pt 6 ps 0.8 dt '- '",
                half ? fmt::format("title '{}'", c.title) : std::string("notitle"));
        }
    text +=
        "(x > 0.3 && x < 3 ? 4e-8*x**2 : 1/0) with lines lc rgb 'black' title 'full lines: half cells; black "
        "∝ "
        "λ²', \\\n     (x > 0.3 && x < 3 ? 0.2*x : 1/0) with lines lc rgb 'black' dt '- ' title 'broken: "
        "clamp of "
        "the paper; black ∝ λ'\n"
        "set title 'Wire through a bent tube: error against processor time'\n"
        "set xlabel 'processor time from the axis of the tube to where the method stops [s]'\n"
        "set ylabel 'farthest joint from the exact curve [mm]'\nset format x '10^{%L}'\nset xtics auto\n"
        "set autoscale x\nset yrange [2e-5:10]\nplot ";
    for (const Contender& c : list)
        text += fmt::format(
            "'accuracy_cost.csv' skip 1 using (strcol(1) eq '{0}' ? $6 : 1/0):7 with linespoints {1} ps 0.9 "
            "title "
            "'{0}', \\\n     ",
            c.name, c.look);
    text += fmt::format(
        "'accuracy_cost.csv' skip 1 using (strcol(1) eq '{0}' ? $6 : 1/0):7:(sprintf('%g mm', $4)) with "
        "labels left "
        "offset 0.8,0.4 font ',9' notitle\nunset multiplot\n",
        list.front().name);
    plot.caption = fmt::format(
        "Left: error of the chain of segments against the exact wire (helix and arc are looked at far from "
        "the ends, "
        "where both rules are the same). Right: the wire through the bent tube, a point for each λ, from 4 "
        "mm at the "
        "left of a line halved from point to point; the global method to rest, the paper's methods with the "
        "paper's "
        "clamp for {} cycles. Down and to the left is better.",
        cycles);
    return plot;
}

}  // namespace

StudyResult run_accuracy(const StudyOptions& options) {
    const int cycles = options.quick ? 20 : 200;
    std::vector<Case> cases = {flat_wall(),
                               bent_tube(),
                               weight("small load", 1e-5, "the tip sinks 0.06 mm", "lc rgb '#E69F00'"),
                               weight("large load", 4e-3, "the tip sinks 21 mm", "lc rgb '#56B4E9'"),
                               helix(),
                               arc()};
    const std::vector<Contender> list = contenders();
    const Case& raced = cases[1];
    const int lengths = options.quick ? 3 : 5;  // of segments, in the race
    struct Found {
        std::vector<Measured> measured;
        double gradient = 0;
        int contacts = 0;
    };
    const int sizes = static_cast<int>(cases.front().segments.size()),
              rules = static_cast<int>(kRules.size());
    const int rests = static_cast<int>(cases.size()) * rules * sizes,
              races = static_cast<int>(list.size()) * lengths;
    Work work(options, rests + races);
    std::vector<Found> results(static_cast<std::size_t>(rests));
    work.run(rests, [&](int k) {
        const Case& c = cases[k / (rules * sizes)];
        const EndCells ends = kRules[k / sizes % rules];
        const int n = c.segments[k % sizes];
        Setting s = c.set(n, ends);
        rest(s.start, *s.wall);
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

    Table errors{"accuracy",
                 {"case", "quantity", "clamp", "segments", "segment_length_mm", "exact", "measured",
                  "relative_error", "contacts", "gradient"},
                 {}};
    Table orders{
        "accuracy_orders", {"case", "quantity", "clamp", "order", "error_at_1_mm", "finest_error"}, {}};
    std::vector<Order> found;
    const double none = std::numeric_limits<double>::quiet_NaN();
    double at_rest = 0, force_half = none, force_paper = none, tip_200 = none;
    for (int c = 0; c < static_cast<int>(cases.size()); ++c)
        for (int r = 0; r < rules; ++r) {
            const Case& now = cases[c];
            const Found* first = &results[(c * rules + r) * sizes];
            for (std::size_t q = 0; q < first->measured.size(); ++q) {
                std::vector<double> lambdas, off;
                double at_one = none;
                for (int k = 0; k < sizes; ++k) {
                    const Measured& m = first[k].measured[q];
                    lambdas.push_back(now.length / now.segments[k]);
                    off.push_back(m.error);
                    at_rest = std::max(at_rest, first[k].gradient);
                    const bool place = m.quantity == "tip" || m.quantity == "farthest joint";
                    errors.add({now.id, m.quantity, word(kRules[r]), static_cast<double>(now.segments[k]),
                                lambdas.back(), place ? none : m.exact, m.measured, m.error,
                                static_cast<double>(first[k].contacts), first[k].gradient});
                    if (lambdas.back() == 1) at_one = m.error;
                    if (now.id == "large load" && m.quantity == "tip" && now.segments[k] == 200 && r == 0)
                        tip_200 = m.error;
                }
                const std::string& quantity = first->measured[q].quantity;
                if (now.id == "wall" && quantity == "force") (r == 0 ? force_half : force_paper) = at_one;
                found.push_back({now.id, quantity, kRules[r], order_of(lambdas, off)});
                orders.add({now.id, quantity, word(kRules[r]), found.back().order, at_one, off.back()});
            }
        }
    Table race{"accuracy_cost",
               {"method", "clamp", "segments", "segment_length_mm", "cycles", "cpu_s", "farthest_joint_mm"},
               {}};
    for (int k = 0; k < races; ++k) {
        const Contender& contender = list[k / lengths];
        const int n = raced.segments[k % lengths];
        const bool global = contender.config.kind == physics::RelaxerKind::Global;
        race.add({contender.name, word(contender.ends), static_cast<double>(n), raced.length / n,
                  global ? none : static_cast<double>(cycles), costs[k].cpu, costs[k].farthest});
    }

    StudyResult result;
    const std::string how = "slope of log error over log λ through the three finest λ";
    for (const Order& o : found) {
        const Case& c =
            *std::find_if(cases.begin(), cases.end(), [&](const Case& x) { return x.id == o.id; });
        if (o.quantity != c.headline || (!c.has_ends && o.ends == EndCells::Paper)) continue;
        const bool half = o.ends == EndCells::Half;
        result.claims.push_back({fmt::format("order in λ of the {} ({}), {}", c.headline, c.id,
                                             !c.has_ends ? "far from the ends"
                                             : half      ? "half cells"
                                                         : "the paper's clamp"),
                                 half ? 2.0 : 1.0, o.order,
                                 half ? o.order >= 1.9 : std::abs(o.order - 1) < 0.1, how});
    }
    const auto add = [&](const std::string& text, double expected, double measured, bool holds,
                         const std::string& note) {
        result.claims.push_back({text, expected, measured, holds, note});
    };
    add("force of a clamped wire on a wall at λ = 1 mm, half cells, off by [%]", 0.12, 100 * force_half,
        100 * force_half <= 0.12 * 1.1, "20 mm of wire; it goes as the square of λ over the wire's length");
    add("force of a clamped wire on a wall at λ = 1 mm, the paper's clamp, off by [%]", 6.9,
        100 * force_paper, std::abs(100 * force_paper - 6.9) < 0.7,
        "20 mm of wire; it goes as λ over the wire's length");
    add("tip of a wire under a large load at N = 200, half cells, off by [L]", 2e-5, tip_200,
        tip_200 <= 2e-5 * 1.1, "the tip sinks by half the wire's length");
    result.plots = {picture(cases, list, cycles)};

    std::string introduction =
        "A wire is a chain of straight segments with a spring at each joint. Here it is held to the exact "
        "wire, the "
        "elastica, in cases where that is known: from closed forms, or by integrating its differential "
        "equations "
        "(shooting, Runge and Kutta's fourth order in 4000 and 8000 steps), which know nothing of the chain. "
        "With "
        "**half cells** the first and the last joint stand for half of their one segment, as all others "
        "stand for half "
        "of each of their two: EI/(λ/2) at the clamp, half a segment's load and wall at the tip. By the "
        "**paper's "
        "clamp** they stand for a whole one.\n";
    for (const Case& c : cases) introduction += fmt::format("\n- **{}**: {}.", c.id, c.text);
    double residual = 0, step_error = 0;
    for (const Case& c : cases)
        residual = std::max(residual, c.exact_residual),
        step_error = std::max(step_error, c.exact_step_error);
    introduction += fmt::format(
        "\n\nEI = {:g} N·mm² everywhere. The exact curves miss what the tip asks for by {:.0e} N·mm and N at "
        "most and "
        "move by {:.0e} mm when their steps are halved; the chains are at rest to a gradient over C of "
        "{:.0e}. A tip "
        "that alone meets a wall has the same stiffness by either rule and in the exact wire, {:g} N/mm on "
        "the flat "
        "wall and {:g} in the bent tube; helix and arc lie on {:g} N/mm for each mm of wire.\n\n{}",
        kRigidity, residual, step_error, at_rest, kFlatStiffness, kBentStiffness, kPerLength,
        to_markdown(orders, 3));
    introduction += fmt::format(
        "\nErrors of places are over the length of the wire, all others over the exact number. Where no "
        "order is "
        "given the error is rounding: the wall of an arc balances its compression in a polygon too.\n\n### "
        "Processor "
        "time\n\nThe wire through the bent tube, from the tube's axis: the global method until it is at rest "
        "(the "
        "median of nine starts), the paper's methods for {} cycles; the paper takes a wire for at rest after "
        "200, "
        "though fewer may do. A segment's length sets how near a method can come; the clamp, how fast it "
        "comes "
        "nearer as segments shrink.\n\n{}",
        cycles, to_markdown(race, 3));
    result.tables = {std::move(errors), std::move(orders), std::move(race)};
    result.page = claims_page("accuracy", "How exact is a wire of segments?", introduction, result, options);
    return result;
}

}  // namespace engine
