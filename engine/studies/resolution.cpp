#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <random>
#include <span>

#include "engine/anatomy/scenes.h"
#include "engine/studies/claims.h"
#include "engine/studies/paper.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/work.h"
#include "physics/geometry/polyline.h"

namespace studies {
namespace {

/// How the stiffness of a joint depends on λ.
struct Rule {
    const char* name;
    const char* what;
    const char* colour;
    bool per_length;
};
constexpr std::array<Rule, 2> rule_table = {
    {{"per length", "wall as stiff per length of wire, k ∝ λ", "#0072B2", true},
     {"per joint", "the same k at every joint", "#D55E00", false}}};

struct Resolved {
    double eta = 1, energy = 0, wall = 0;  // [N·mm]
    double again = 0;                      // energy after a disturbance [N·mm]
    double gradient = 0;                   // |g|/C
    geometry::Polyline joints;
};

/// A wire as long as `coarse` segments of the scene's λ, divided into `segments`.
Resolved resolve(const Rule& rule, int coarse, int segments) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const double lambda = scene.segment_length * coarse / segments;
    PaperScene fine = paper_scene("sinuous", {segments, lambda, 0});
    if (!rule.per_length)
        fine.wall =
            std::make_shared<physics::TubeWall>(fine.wall->centreline(), scene.radius, scene.wall_stiffness);
    const Rest rest = global_rest(*fine.wall, fine.start);
    physics::Guidewire moved = rest.wire;
    std::mt19937 random(static_cast<unsigned>(segments));
    for (int i = 1; i <= segments; ++i) {
        const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
        const double x = unit(), y = unit(), z = unit();
        moved.tangents[i] = (moved.tangents[i] + 0.02 * geometry::Vec3(x, y, z)).normalized();
    }
    physics::rebuild_joints(moved);
    return {static_cast<double>(segments) / coarse, rest.energy,   rest.wall,
            global_rest(*fine.wall, moved).energy,  rest.gradient, rest.wire.joints};
}

/// Least squares of Eq. 40, ΔU/U = c₁(1 − 1/η) + c₂(1 − 1/η²).
struct Fit {
    double c1 = 0, c2 = 0, rms = 0;
};

std::array<double, 3> terms(const Resolved& p, double base) {
    return {1 - 1 / p.eta, 1 - 1 / (p.eta * p.eta), p.energy / base - 1};
}

/// Rms of ΔU/U about the fit.
double scatter(const Fit& fit, std::span<const Resolved> points, double base) {
    double sum = 0;
    for (const Resolved& point : points) {
        const auto [a, b, y] = terms(point, base);
        sum += (y - fit.c1 * a - fit.c2 * b) * (y - fit.c1 * a - fit.c2 * b);
    }
    return std::sqrt(sum / static_cast<double>(points.size()));
}

Fit fit(const std::vector<Resolved>& points) {
    const double base = points.front().energy;
    double aa = 0, ab = 0, bb = 0, ay = 0, by = 0;
    for (const Resolved& point : points) {
        const auto [a, b, y] = terms(point, base);
        aa += a * a, ab += a * b, bb += b * b, ay += a * y, by += b * y;
    }
    const double det = aa * bb - ab * ab;
    Fit result{(bb * ay - ab * by) / det, (aa * by - ab * ay) / det, 0};
    result.rms = scatter(result, points, base);
    return result;
}

/// Figures of one rule.
struct Measured {
    Fit fit;
    double largest = 0;                           // |ΔU/U| over all
    double mean_change = 0, largest_change = 0;   // of ΔU/U from one N' to the next
    double lower_scatter = 0, upper_scatter = 0;  // rms about the fit in the halves of N'
    double wall_part = 0;                         // share of the energy at η = 1
    double accuracy = 0;                          // largest |ΔU|/U of rest found again after a disturbance
    double gradient = 0;
    double separation = 0, spread = 0;  // mean and standard deviation, coarsest from finest wire [mm]
    int farthest = 0;                   // joint of the coarsest wire
    double largest_separation = 0;      // there [mm]
    double bent = 0, straight = 0;      // mean separation in the more and in the less curved half [mm]
};

void measure_separation(const geometry::Polyline& coarse, const geometry::Polyline& fine, Measured& m) {
    const auto distance = [&](const geometry::Vec3& x) {
        double least = 1e300;
        for (std::size_t k = 0; k + 1 < fine.size(); ++k) {
            const geometry::Vec3 &a = fine[k], &b = fine[k + 1];
            least = std::min(least, (a + geometry::closest_share(a, b, x) * (b - a) - x).norm());
        }
        return least;
    };
    std::vector<std::pair<double, double>> by_bend;  // turn at the joint, separation
    double sum = 0, squares = 0;
    for (std::size_t i = 1; i < coarse.size(); ++i) {
        const double d = distance(coarse[i]);
        sum += d;
        squares += d * d;
        if (d > m.largest_separation) m.largest_separation = d, m.farthest = static_cast<int>(i);
        if (i + 1 == coarse.size()) continue;
        by_bend.push_back({(coarse[i + 1] - 2 * coarse[i] + coarse[i - 1]).norm(), d});
    }
    const double count = static_cast<double>(coarse.size() - 1);
    m.separation = sum / count;
    m.spread = std::sqrt(std::max(0.0, squares / count - m.separation * m.separation));
    std::sort(by_bend.begin(), by_bend.end());
    const std::size_t half = by_bend.size() / 2;
    for (std::size_t k = 0; k < half; ++k) m.straight += by_bend[k].second / static_cast<double>(half);
    for (std::size_t k = half; k < by_bend.size(); ++k)
        m.bent += by_bend[k].second / static_cast<double>(by_bend.size() - half);
}

Measured measure(const std::vector<Resolved>& points) {
    Measured m;
    m.fit = fit(points);
    const double base = points.front().energy;
    const std::size_t changes = points.size() - 1;
    m.wall_part = points.front().wall / base;
    for (std::size_t k = 0; k < points.size(); ++k) {
        m.largest = std::max(m.largest, std::abs(points[k].energy / base - 1));
        m.accuracy = std::max(m.accuracy, std::abs(points[k].again - points[k].energy) / base);
        m.gradient = std::max(m.gradient, points[k].gradient);
        if (k == 0) continue;
        const double change = std::abs(points[k].energy - points[k - 1].energy) / base;
        m.mean_change += change / static_cast<double>(changes);
        m.largest_change = std::max(m.largest_change, change);
    }
    const std::span all(points);
    m.lower_scatter = scatter(m.fit, all.first(points.size() / 2), base);
    m.upper_scatter = scatter(m.fit, all.last(points.size() / 2), base);
    measure_separation(points.front().joints, points.back().joints, m);
    return m;
}

void claim(const Rule& rule, const Measured& m, std::vector<Claim>& claims) {
    const auto add = [&](const std::string& text, io::TableCell published, io::TableCell measured, bool holds,
                         const std::string& note) {
        claims.push_back({fmt::format("{} (k {})", text, rule.name), std::move(published),
                          std::move(measured), holds, note});
    };
    const auto near = [](double a, double b) { return std::abs(a / b - 1) < 0.1; };
    const std::string stiffer = fmt::format(
        "{} Only {:.2g} % of the energy at η = 1 is the wall's here; tube and k are not published.",
        rule.per_length ? "The wall keeps its stiffness, so that its energy hardly depends on λ."
                        : "Three times the joints make a wall three times as stiff.",
        100 * m.wall_part);
    add("Fig. 13: largest |ΔU/U| up to η = 3", std::string("< 0.025"), m.largest, m.largest < 0.025, stiffer);
    add("Eq. 40: c1, of the wall", 0.0263, m.fit.c1, near(m.fit.c1, 0.0263), stiffer);
    add("Eq. 40: c2, of bending", 0.00554, m.fit.c2, near(m.fit.c2, 0.00554), stiffer);
    add("Section 3.4: the constant that ΔU/U approaches, c1 + c2", 0.0263 + 0.00554, m.fit.c1 + m.fit.c2,
        near(m.fit.c1 + m.fit.c2, 0.0263 + 0.00554), stiffer);
    add("Eq. 40: the wall's constant is the larger: c1/c2", 0.0263 / 0.00554, m.fit.c1 / m.fit.c2,
        std::abs(m.fit.c1) > std::abs(m.fit.c2), stiffer);
    add("Section 3.4: accuracy of ΔU/U, of equilibrium found again after a disturbance", 3e-5, m.accuracy,
        m.accuracy <= 3e-5, "As accurate or better holds.");
    const std::string smooth =
        "Less than published: the wall here is a smooth tube, so that joints enter and leave it without "
        "jumps.";
    add("Section 3.4: mean change of ΔU/U between consecutive N'", 92e-5, m.mean_change,
        near(m.mean_change, 92e-5), smooth);
    add("Section 3.4: largest change of ΔU/U between consecutive N'", 387e-5, m.largest_change,
        near(m.largest_change, 387e-5), smooth);
    add("Section 3.4: the data are less disperse as η increases: rms about the fit in the upper half of N' "
        "over that in the lower",
        std::string("< 1"), m.upper_scatter / m.lower_scatter, m.upper_scatter < m.lower_scatter,
        "Holds or not by what the fit leaves, which is a few millionths here.");
    const std::string entry = fmt::format(
        "It is largest at joint {}, {:.3f} mm: the spring at the introducer stands for a whole λ of wire, "
        "half "
        "of which is not there, so that a coarse wire bends more easily where it enters.",
        m.farthest, m.largest_separation);
    add("Section 3.4: mean separation of the wires at η = 1 and 3 [mm]", 0.027, m.separation,
        near(m.separation, 0.027), "Holds within a tenth; less is better. " + entry);
    add("Section 3.4: its standard deviation [mm]", 0.041, m.spread, near(m.spread, 0.041),
        "Holds within a tenth; less is better. " + entry);
    add("Section 3.4: the standard deviation is larger than the mean: ratio", 0.041 / 0.027,
        m.spread / m.separation, m.spread > m.separation, entry);
    add("Section 3.4: the separation is larger where the wire is bent: more bent half over the other",
        std::string("> 1"), m.bent / m.straight, m.bent > m.straight, entry);
}

io::Plot picture(const std::array<Measured, 2>& measured, int coarse) {
    io::Plot plot{"resolution", "", 1000, 520};
    plot.commands =
        "set grid lc rgb '#dddddd'\nset key outside right top\nset xlabel 'resolution η = N''/N'\n"
        "set ylabel 'ΔU/U [%]'\n";
    std::string list;
    for (std::size_t k = 0; k < rule_table.size(); ++k) {
        const Fit& f = measured[k].fit;
        list += fmt::format(
            "{}{}, \\\n     100*({}*(1-1/x) + {}*(1-1/x**2)) with lines lc rgb 'black' dt {} title 'Eq. 40: "
            "c_1 "
            "= {:.3g}, c_2 = {:.3g}'",
            k > 0 ? ", \\\n     " : "plot ",
            series("resolution", rule_table[k].name, 3, 6,
                   fmt::format("with points pt 7 ps 0.5 lc rgb '{}' title 'k {}'", rule_table[k].colour,
                               rule_table[k].name)),
            f.c1, f.c2, k + 1, f.c1, f.c2);
    }
    plot.commands += list + "\n";
    plot.caption = fmt::format(
        "Energy at rest against the number of segments (the paper's Fig. 13b): scene sinuous, lumen radius 1 "
        "mm, a wire of "
        "{0} mm in N' = {0} to {1} segments, λ = {0} mm/N', EI = 50 N·mm²; k = 42 N/mm a joint at λ = 1 mm, "
        "and either as "
        "stiff per length of wire or the same k at every joint.",
        coarse, 3 * coarse);
    return plot;
}

io::Plot wire_plot(int coarse) {
    io::Plot plot{"resolution_wire", "", 1000, 480};
    plot.commands =
        "set size ratio -1\nset xlabel 'x [mm]'\nset ylabel 'y [mm]'\nset key outside right top\nplot " +
        series("resolution_wire", fmt::format("N = {}", coarse), 2, 3,
               fmt::format("with lines lw 3 lc rgb '#56B4E9' title 'N = {}'", coarse)) +
        ", \\\n     " +
        series("resolution_wire", fmt::format("N = {}", 3 * coarse), 2, 3,
               fmt::format("with lines lc rgb 'black' title 'N = {}'", 3 * coarse)) +
        "\n";
    plot.caption = fmt::format(
        "The wire at rest in {} and in {} segments (the paper's Fig. 13a): scene sinuous, lumen radius 1 mm, "
        "EI = 50 N·mm², k "
        "= 42 N/mm a joint at λ = 1 mm, the wall as stiff per length of wire.",
        coarse, 3 * coarse);
    return plot;
}

}  // namespace

StudyResult run_resolution(const StudyOptions& options) {
    const int coarse = options.quick ? 60 : 175, step = options.quick ? 12 : 1, count = 2 * coarse / step + 1;
    std::array<std::vector<Resolved>, 2> points;
    for (auto& list : points) list.resize(static_cast<std::size_t>(count));
    Work work(options, 2 * count);
    work.run(2 * count, [&](int k) {
        const int segments = coarse + step * (k / 2);
        points[k % 2][k / 2] = resolve(rule_table[k % 2], coarse, segments);
        return fmt::format("N = {}", segments);
    });
    const std::array<Measured, 2> measured = {measure(points[0]), measure(points[1])};

    StudyResult result;
    io::Table table{
        "resolution",
        {"rule", "segments", "eta", "energy_N_mm", "energy_again_N_mm", "relative_energy_percent"},
        {}};
    io::Table fits{
        "resolution_fit",
        {"rule", "c1", "c2", "rms", "mean_separation_mm", "separation_deviation_mm", "largest_gradient"},
        {}};
    for (std::size_t k = 0; k < rule_table.size(); ++k) {
        const Measured& m = measured[k];
        for (int i = 0; i < count; ++i) {
            const Resolved& p = points[k][i];
            table.add({std::string(rule_table[k].name), static_cast<double>(coarse + step * i), p.eta,
                       p.energy, p.again, 100 * (p.energy / points[k].front().energy - 1)});
        }
        fits.add({std::string(rule_table[k].name), m.fit.c1, m.fit.c2, m.fit.rms, m.separation, m.spread,
                  m.gradient});
        claim(rule_table[k], m, result.claims);
    }
    io::Table wires{"resolution_wire", {"wire", "x_mm", "y_mm", "z_mm"}, {}};
    for (const auto* joints : {&points[0].front().joints, &points[0].back().joints})
        for (const auto& x : *joints)
            wires.add({fmt::format("N = {}", joints->size() - 1), x.x(), x.y(), x.z()});
    result.plots = {wire_plot(coarse), picture(measured, coarse)};
    result.page = claims_page(
        "resolution", "How the energy depends on the number of segments",
        fmt::format(
            "Each wire starts on the centreline and comes to rest by the global relaxer; its rest is found "
            "again "
            "after every tangent was turned by up to 0.02. Two rules for the stiffness of a joint: *{}*: {}; "
            "*{}*: {}.\n\n{}",
            rule_table[0].name, rule_table[0].what, rule_table[1].name, rule_table[1].what,
            io::to_markdown(fits)),
        result, options);
    result.tables = {std::move(table), std::move(fits), std::move(wires)};
    return result;
}

}  // namespace studies
