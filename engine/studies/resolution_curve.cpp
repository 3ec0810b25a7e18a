#include <algorithm>
#include <cmath>
#include <random>

#include "engine/studies/lateral_deviation.h"
#include "engine/studies/quantile.h"
#include "engine/studies/resolution.h"

namespace studies {
namespace {

constexpr double published_accuracy = 3e-5;  // of ΔU/U

Resolved resolved(const Rest& rest, double eta) {
    return {eta, rest.energy - rest.wall, rest.wall, std::nan(""), rest.gradient};
}

double energy_again(const PaperScene& scene, physics::Chain wire) {
    std::mt19937 random(static_cast<unsigned>(wire.segments()));
    for (int i = 1; i <= wire.segments(); ++i) {
        const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
        const double x = unit(), y = unit(), z = unit();
        wire.tangents[i] = (wire.tangents[i] + 0.02 * geometry::Vec3(x, y, z)).normalized();
    }
    physics::rebuild_joints(wire);
    return global_rest(*scene.wall, wire).energy;
}

std::array<double, 3> terms(const Resolved& p, double base) {
    return {1 - 1 / p.eta, 1 - 1 / (p.eta * p.eta), p.energy() / base - 1};
}

double scatter(const Fit& fit, std::span<const Resolved> points, double base) {
    double sum = 0;
    for (const Resolved& point : points) {
        const double off = point.energy() / base - 1 - fit.at(point.eta);
        sum += off * off;
    }
    return std::sqrt(sum / static_cast<double>(points.size()));
}

Fit least_squares(std::span<const Resolved> points) {
    const double base = points.front().energy();
    double aa = 0, ab = 0, bb = 0, ay = 0, by = 0;
    for (const Resolved& point : points) {
        const auto [a, b, y] = terms(point, base);
        aa += a * a, ab += a * b, bb += b * b, ay += a * y, by += b * y;
    }
    const double det = aa * bb - ab * ab;
    Fit fit{(bb * ay - ab * by) / det, (aa * by - ab * ay) / det, 0};
    fit.rms = scatter(fit, points, base);
    return fit;
}

void measure_separation(ResolutionCurve& c) {
    const ReferenceCurve curve(c.fine.joints);
    std::vector<std::pair<double, double>> by_bend;  // turn at the joint, separation
    double sum = 0, squares = 0;
    const auto& joints = c.coarse.joints;
    for (std::size_t i = 1; i < joints.size(); ++i) {
        const double d = std::abs(curve.deviation(joints[i]));
        sum += d;
        squares += d * d;
        if (i + 1 < joints.size())
            by_bend.push_back({(joints[i + 1] - 2 * joints[i] + joints[i - 1]).norm(), d});
    }
    const double count = static_cast<double>(joints.size() - 1);
    c.separation = sum / count;
    c.spread = std::sqrt(std::max(0.0, squares / count - c.separation * c.separation));
    std::sort(by_bend.begin(), by_bend.end());
    const std::size_t half = by_bend.size() / 2;
    double straight = 0, bent = 0;
    for (std::size_t k = 0; k < by_bend.size(); ++k) (k < half ? straight : bent) += by_bend[k].second;
    c.bent_over_straight =
        bent / static_cast<double>(by_bend.size() - half) / (straight / static_cast<double>(half));
}

}  // namespace

PaperScene fig_13_scene(int segments) {
    return paper_scene("coronary", {.segments = segments,
                                    .piece = published_piece,
                                    .first_piece = 0.5 * published_piece,
                                    .stiffness = calibrated_stiffness});
}

SceneChange ResolutionTube::change(const Resolution& resolution, int segments) const {
    SceneChange change;
    change.segments = segments;
    change.segment_length = static_cast<double>(resolution.coarse) / segments;
    change.bends = bends;
    change.stiffness = stiffness;
    change.piece = piece;
    change.first_piece = piece * (offset + 0.5) / offsets;
    return change;
}

ResolutionCurve resolution_curve(const ResolutionTube& tube, const Resolution& resolution, bool disturb) {
    ResolutionCurve c;
    const PaperScene finest = paper_scene(tube.scene.c_str(), tube.change(resolution, resolution.finest));
    c.fine = global_rest(*finest.wall, finest.start).wire;
    for (int segments = resolution.coarse; segments <= resolution.finest; segments += resolution.step) {
        PaperScene scene = paper_scene(tube.scene.c_str(), tube.change(resolution, segments));
        const Rest rest = rest_again(scene, c.fine);
        c.points.push_back(resolved(rest, static_cast<double>(segments) / resolution.coarse));
        if (disturb) c.points.back().again = energy_again(scene, rest.wire);
        if (segments == resolution.coarse) c.coarse = rest.wire;
    }
    const double base = c.points.front().energy();
    c.fit = least_squares(c.points);
    c.at_three = c.points.back().energy() / base - 1;
    c.wall_fraction = c.points.front().wall / base;
    double found = 0;
    for (std::size_t k = 0; k < c.points.size(); ++k) {
        const Resolved& p = c.points[k];
        c.largest = std::max(c.largest, std::abs(p.energy() / base - 1));
        found += std::abs(p.again - p.energy()) / base <= published_accuracy;
        if (k == 0) continue;
        const double change = std::abs(p.energy() - c.points[k - 1].energy()) / base;
        c.mean_change += change / static_cast<double>(c.points.size() - 1);
        c.largest_change = std::max(c.largest_change, change);
    }
    c.found_again = disturb ? found / static_cast<double>(c.points.size()) : std::nan("");
    const std::span all(c.points);
    c.lower_scatter = scatter(c.fit, all.first(all.size() / 2), base);
    c.upper_scatter = scatter(c.fit, all.last(all.size() / 2), base);
    measure_separation(c);
    return c;
}

Quantiles quantiles(const std::vector<double>& values) {
    return {quantile(values, 0.1), quantile(values, 0.5), quantile(values, 0.9)};
}

Quantiles quantiles(std::span<const ResolutionCurve> curves, double ResolutionCurve::*what) {
    std::vector<double> values;
    for (const ResolutionCurve& curve : curves) values.push_back(curve.*what);
    return quantiles(values);
}

Quantiles quantiles(std::span<const ResolutionCurve> curves, double Fit::*what) {
    std::vector<double> values;
    for (const ResolutionCurve& curve : curves) values.push_back(curve.fit.*what);
    return quantiles(values);
}

}  // namespace studies
