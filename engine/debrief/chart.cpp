#include "engine/debrief/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace debrief {
namespace {

constexpr double width = 1000, left = 74, right = 12;  // of the time line [px]
constexpr std::size_t most_points = 1500;              // of a drawn line

/// 1, 2 or 5 times a power of ten, so that about `parts` of them fit.
double nice_step(double span, int parts) {
    if (!(span > 0)) return 1;
    const double rough = span / parts, power = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double nice : {1.0, 2.0, 5.0})
        if (nice * power >= rough) return nice * power;
    return 10 * power;
}

struct Scale {
    double from = 0, to = 1, begin = 0, end = 1;  // values, pixels
    double operator()(double value) const {
        return begin + (value - from) / (to > from ? to - from : 1) * (end - begin);
    }
};

/// Every k-th index, with the last.
std::vector<std::size_t> sampled(std::size_t size) {
    std::vector<std::size_t> indices;
    const std::size_t stride = std::max<std::size_t>(1, size / most_points);
    for (std::size_t i = 0; i < size; i += stride) indices.push_back(i);
    if (size > 0 && indices.back() != size - 1) indices.push_back(size - 1);
    return indices;
}

template <class Value>
std::string line(const Story& story, const Scale& x, const Scale& y, const char* colour, const Value& value) {
    std::string points;
    for (const std::size_t i : sampled(story.moments.size())) {
        const Moment& m = story.moments[i];
        points += fmt::format("{:.1f},{:.1f} ", x(m.seconds), y(value(m)));
    }
    return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>", points,
                       colour);
}

/// Bars wherever `on` holds.
template <class On>
std::string bars(const Story& story, const Scale& x, double top, double height, const char* colour,
                 const On& on) {
    std::string text;
    const double rate = story.scenario.frame_rate;
    for (std::size_t i = 0; i < story.moments.size();) {
        if (!on(story.moments[i])) {
            ++i;
            continue;
        }
        std::size_t end = i;
        while (end + 1 < story.moments.size() && on(story.moments[end + 1])) ++end;
        const double from = x(story.moments[i].seconds - 1 / rate), to = x(story.moments[end].seconds);
        text += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\"/>", from,
                            top, std::max(0.8, to - from), height, colour);
        i = end + 1;
    }
    return text;
}

std::string mark_circle(double x, double y, std::size_t number_of) {
    return fmt::format(
        "<a href=\"#e{0}\" class=\"mark\" aria-label=\"error {0}\"><circle cx=\"{1:.1f}\" cy=\"{2:.1f}\" "
        "r=\"9\" fill=\"{3}\"/><text x=\"{1:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\" fill=\"#fff\" "
        "font-size=\"11\">{0}</text></a>",
        number_of, x, y, ink::error, y + 4);
}

}  // namespace

std::string time_line(const Story& story) {
    double last = 0, in_least = 0, in_most = 1, turn_least = 0, turn_most = 1, force = 1, distance = 1;
    in_least = std::numeric_limits<double>::infinity();
    for (const Moment& m : story.moments) {
        last = std::max(last, m.seconds);
        for (const double inserted : m.inserted) {
            in_least = std::min(in_least, inserted);
            in_most = std::max(in_most, inserted);
        }
        turn_least = std::min(turn_least, m.turned / geometry::degree);
        turn_most = std::max(turn_most, m.turned / geometry::degree);
        force = std::max(force, m.force);
        distance = std::max(distance, m.to_target);
    }
    if (!(in_least < in_most)) in_least = in_most - 1;
    const Scale x{0, std::max(last, 0.1), left, width - right};
    const exercise::HandlingErrorLimits limits;
    struct Lane {
        const char* name;
        double least, most, height;
    };
    const std::array<Lane, 4> lanes = {{{"inserted, mm", in_least, in_most, 84},
                                        {"turned, deg", turn_least, turn_most, 60},
                                        {"wall force, N", 0, force, 60},
                                        {"to target, mm", 0, distance, 60}}};
    std::string text;
    double top = 44;
    std::array<Scale, 4> scales;
    for (std::size_t k = 0; k < lanes.size(); ++k) {
        const Lane& lane = lanes[k];
        scales[k] = {lane.least, lane.most, top + lane.height, top};
        const double step = nice_step(lane.most - lane.least, 3);
        for (double v = std::ceil(lane.least / step) * step; v <= lane.most + 1e-9; v += step)
            text += fmt::format(
                "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/><text x=\"{}\" "
                "y=\"{:.1f}\" text-anchor=\"end\" class=\"tick\">{:g}</text>",
                left, width - right, scales[k](v), scales[k](v), ink::grid, left - 5, scales[k](v) + 4,
                std::abs(v) < 1e-9 ? 0.0 : v);
        text +=
            fmt::format("<text x=\"{}\" y=\"{:.1f}\" class=\"lane\">{}</text>", left + 4, top - 5, lane.name);
        top += lane.height + 26;
    }
    for (std::size_t k = 0; k < story.scenario.devices.size(); ++k)
        text += line(story, x, scales[0], ink::devices[k], [k](const Moment& m) { return m.inserted[k]; });
    text += line(story, x, scales[1], ink::wire, [](const Moment& m) { return m.turned / geometry::degree; });
    text += fmt::format(
        "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-dasharray=\"5 4\"/>",
        left, width - right, scales[2](limits.force), scales[2](limits.force), ink::error);
    text += line(story, x, scales[2], ink::wire, [](const Moment& m) { return m.force; });
    const double radius = story.scenario.target.radius;
    text += fmt::format(
        "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-dasharray=\"5 4\"/>",
        left, width - right, scales[3](radius), scales[3](radius), ink::good);
    text += line(story, x, scales[3], ink::wire, [](const Moment& m) { return m.to_target; });
    const auto strip = [&](const char* name, const char* colour, const auto& on) {
        text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\" class=\"tick\">{}</text>",
                            left - 5, top + 10, name);
        text += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"13\" fill=\"#f5f5f5\"/>", left,
                            top, width - left - right);
        text += bars(story, x, top, 13, colour, on);
    };
    strip("beam", "#e69f00", [](const Moment& m) { return m.beam; });
    text += bars(story, x, top, 13, "#8a5a00", [](const Moment& m) { return m.beam && m.dsa; });
    top += 18;
    strip("contrast", "#cc79a7", [](const Moment& m) { return m.injection > 0; });
    top += 24;
    const double step = nice_step(last, 10);
    for (double t = 0; t <= last + 1e-9; t += step)
        text += fmt::format(
            "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"24\" y2=\"{1:.1f}\" stroke=\"{2}\" "
            "stroke-dasharray=\"1 4\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\" "
            "class=\"tick\">{4:g} s</text>",
            x(t), top - 8, "#bbb", top + 6, t);
    if (story.score.completion_time && !story.moments.empty())
        for (const Moment& m : story.moments)
            if (m.to_target <= radius) {
                text += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>", x(m.seconds),
                                    scales[3](m.to_target), ink::good);
                break;
            }
    text += fmt::format(
        "<g id=\"cursor\"><line x1=\"0\" x2=\"0\" y1=\"20\" y2=\"{:.1f}\" stroke=\"#111\" "
        "stroke-width=\"1.2\"/></g>",
        top - 8);
    for (const script::Comment& comment : story.comments)
        for (const Moment& m : story.moments)
            if (m.frame == comment.frame)
                text += fmt::format("<path d=\"M{0:.1f} 38l-5-9h10z\" fill=\"{1}\"><title>{2}</title></path>",
                                    x(m.seconds), ink::comment, io::html_escaped(comment.text));
    // Marks that would cover one another stand a little apart.
    double beyond = -1e9;
    for (std::size_t k = 0; k < story.score.handling_errors.size(); ++k) {
        const double at = std::max(x(story.score.handling_errors[k].start), beyond + 19);
        text += mark_circle(std::min(at, width - right), 12, k + 1);
        beyond = at;
    }
    return fmt::format(
        "<svg id=\"time\" viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"time line\" "
        "data-left=\"{}\" data-right=\"{}\" data-last=\"{}\">{}</svg>",
        width, top + 12, left, width - right, last, text);
}

std::string treatment_chart(const Story& story) {
    struct Lane {
        const char* name;
        std::optional<double> Moment::*value;
        const char* colour;
        double height;
    };
    constexpr std::array<Lane, 2> lanes = {{{"balloon, atm", &Moment::balloon, ink::devices[1], 90},
                                            {"narrowest lumen, mm", &Moment::lumen, ink::wire, 90}}};
    if (story.moments.empty()) return "";
    const Scale x{0, std::max(story.moments.back().seconds, 0.1), left, width - right};
    std::string text;
    double top = 24;
    for (const Lane& lane : lanes) {
        double most = 0;
        bool any = false;
        for (const Moment& m : story.moments)
            if (m.*lane.value) any = true, most = std::max(most, *(m.*lane.value));
        if (!any) continue;
        const double step = nice_step(most > 0 ? most : 1, 3);
        most = std::max(most, step);
        const Scale y{0, most, top + lane.height, top};
        for (double v = 0; v <= most + 1e-9; v += step)
            text += fmt::format(
                "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/><text x=\"{}\" "
                "y=\"{:.1f}\" text-anchor=\"end\" class=\"tick\">{:g}</text>",
                left, width - right, y(v), y(v), ink::grid, left - 5, y(v) + 4, v);
        text +=
            fmt::format("<text x=\"{}\" y=\"{:.1f}\" class=\"lane\">{}</text>", left + 4, top - 5, lane.name);
        text += line(story, x, y, lane.colour, [&](const Moment& m) { return (m.*lane.value).value_or(0); });
        top += lane.height + 26;
    }
    if (text.empty()) return "";
    const double step = nice_step(story.moments.back().seconds, 10);
    for (double t = 0; t <= story.moments.back().seconds + 1e-9; t += step)
        text +=
            fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"tick\">{:g} s</text>",
                        x(t), top - 6, t);
    return fmt::format(
        "<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"balloon and lumen over time\">{}</svg>",
        width, top, text);
}

std::string ways_over_vessels(const VesselPicture& picture,
                              const std::function<std::string(const Side&)>& more) {
    std::array<Side, 2> sides = {
        {{"from the front", geometry::Vec3::UnitX()}, {"from the left", geometry::Vec3::UnitY()}}};
    // What the tips have seen, with some of the vessels around.
    constexpr double around = 25, height = 460;  // [mm], [px]
    double low = picture.target.z(), high = low;
    for (const auto& [way, colour] : picture.ways)
        for (const geometry::Vec3& tip : way) {
            low = std::min(low, tip.z());
            high = std::max(high, tip.z());
        }
    low -= around;
    high += around;
    std::string text;
    double offset = 0;
    for (Side& side : sides) {
        double from = side.right.dot(picture.target), to = from;
        for (const auto& [way, colour] : picture.ways)
            for (const geometry::Vec3& tip : way) {
                from = std::min(from, side.right.dot(tip));
                to = std::max(to, side.right.dot(tip));
            }
        side.middle = 0.5 * (from + to);
        side.half = std::max(0.5 * (to - from) + around, 0.25 * (high - low));
        side.high = high;
        side.per_mm = height / (high - low);
        const double pixels = side.pixels();
        std::string inside;
        for (const char* colour : {ink::edge, ink::vessel}) {
            const double rim = colour == ink::edge ? 1.5 : 0;
            for (const geometry::CentrelineBranch& branch : picture.branches) {
                std::size_t before = 0;
                double gone = 0;
                for (std::size_t i = 1; i < branch.points.size(); ++i) {
                    gone += (branch.points[i] - branch.points[i - 1]).norm();
                    if (gone < 0.7 * branch.radii[i] && i + 1 < branch.points.size()) continue;
                    const auto [x1, y1] = side.at(branch.points[before]);
                    const auto [x2, y2] = side.at(branch.points[i]);
                    const double thick = side.per_mm * (branch.radii[before] + branch.radii[i]) + 2 * rim;
                    const bool seen = std::max(x1, x2) > -thick && std::min(x1, x2) < pixels + thick &&
                                      std::max(y1, y2) > -thick && std::min(y1, y2) < height + thick;
                    if (seen)
                        inside += fmt::format(
                            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" "
                            "stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-linecap=\"round\"/>",
                            x1, y1, x2, y2, colour, thick);
                    before = i;
                    gone = 0;
                }
            }
        }
        for (const auto& [way, colour] : picture.ways) {
            std::string points;
            for (const std::size_t i : sampled(way.size())) {
                const auto [x, y] = side.at(way[i]);
                points += fmt::format("{:.1f},{:.1f} ", x, y);
            }
            inside += fmt::format(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" "
                "stroke-linejoin=\"round\"/>",
                points, colour);
        }
        const auto [tx, ty] = side.at(picture.target);
        inside += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"{}\" "
            "stroke-width=\"2.5\"/>",
            tx, ty, std::max(4.0, side.per_mm * picture.target_radius), ink::good);
        if (more) inside += more(side);
        // The rod is 20 mm long.
        inside += fmt::format(
            "<line x1=\"10\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{1:.1f}\" stroke=\"#444\" "
            "stroke-width=\"2\"/><text x=\"10\" y=\"{2:.1f}\" class=\"tick\" "
            "style=\"text-anchor:start\">20 mm</text>",
            10 + 20 * side.per_mm, height - 8, height - 13);
        text += fmt::format(
            "<svg x=\"{0:.1f}\" y=\"0\" width=\"{1:.1f}\" height=\"{2}\" viewBox=\"0 0 {1:.1f} {2}\">"
            "<rect width=\"{1:.1f}\" height=\"{2}\" fill=\"#fafafa\"/>{3}"
            "<text x=\"10\" y=\"18\" class=\"lane\">{4}</text></svg>",
            offset, pixels, height, inside, side.name);
        offset += pixels + 14;
    }
    return fmt::format(
        "<svg id=\"way\" viewBox=\"0 0 {:.0f} {}\" style=\"max-width:{:.0f}px\" role=\"img\" "
        "aria-label=\"way of the tip over the vessels\">{}</svg>",
        offset - 14, height, offset - 14, text);
}

std::string tip_over_vessels(const Story& story) {
    geometry::Polyline way;
    for (const Moment& m : story.moments) way.push_back(m.tip);
    const VesselPicture picture{
        story.branches, story.target, story.scenario.target.radius, {{std::move(way), ink::wire}}};
    return ways_over_vessels(picture, [&story](const Side& side) {
        std::string text;
        // Marks at one place stand beside each other.
        std::vector<std::pair<double, double>> taken;
        for (std::size_t k = 0; k < story.score.handling_errors.size(); ++k) {
            auto [x, y] = side.at(story.score.handling_errors[k].place);
            const auto covered = [&taken, &x = x, &y = y] {
                return std::ranges::any_of(taken, [&](const auto& other) {
                    return std::hypot(other.first - x, other.second - y) < 17;
                });
            };
            while (covered() && x < side.pixels() + 200) x += 6;
            taken.emplace_back(x, y);
            text += mark_circle(x, y, k + 1);
        }
        return text + fmt::format(
                          "<circle class=\"here\" data-axis=\"{}\" data-k=\"{:.6f}\" data-x0=\"{:.4f}\" "
                          "data-top=\"{:.4f}\" r=\"5\" fill=\"#111\" stroke=\"#fff\" stroke-width=\"1.5\"/>",
                          side.right.x() != 0 ? "x" : "y", side.per_mm, side.middle - side.half, side.high);
    });
}

std::string line_chart(const std::string& across, const std::string& up, const std::vector<Line>& lines) {
    constexpr double height = 230, top = 30, bottom = 40;
    double from = 0, to = 1e-9, most = 1e-9;
    for (const Line& one : lines)
        for (const auto& [a, b] : one.points) {
            from = std::min(from, a);
            to = std::max(to, a);
            most = std::max(most, b);
        }
    const double step = nice_step(most, 4), step_across = nice_step(to - from, 10);
    most = std::ceil(most / step - 1e-9) * step;
    const Scale x{from, to, left, width - right}, y{0, most, height - bottom, top};
    std::string text =
        fmt::format("<text x=\"{}\" y=\"16\" class=\"lane\">{}</text>", left + 4, io::html_escaped(up));
    for (double v = 0; v <= most + 1e-9; v += step)
        text += fmt::format(
            "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/><text x=\"{}\" "
            "y=\"{:.1f}\" text-anchor=\"end\" class=\"tick\">{:g}</text>",
            left, width - right, y(v), y(v), ink::grid, left - 5, y(v) + 4, v);
    for (double v = std::ceil(from / step_across) * step_across; v <= to + 1e-9; v += step_across)
        text +=
            fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"tick\">{:g}</text>",
                        x(v), height - bottom + 16, std::abs(v) < 1e-9 ? 0.0 : v);
    text += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\" class=\"tick\">{}</text>", width - right,
                        height - 6, io::html_escaped(across));
    double legend = left + 4;
    for (const Line& one : lines) {
        std::string points;
        for (const std::size_t i : sampled(one.points.size()))
            points += fmt::format("{:.1f},{:.1f} ", x(one.points[i].first), y(one.points[i].second));
        text += fmt::format(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>"
            "<line x1=\"{:.0f}\" x2=\"{:.0f}\" y1=\"{}\" y2=\"{}\" stroke=\"{}\" stroke-width=\"4\"/>"
            "<text x=\"{:.0f}\" y=\"{}\" class=\"tick\">{}</text>",
            points, one.colour, legend, legend + 14, height - 10, height - 10, one.colour, legend + 19,
            height - 6, io::html_escaped(one.name));
        legend += 32 + 6.4 * static_cast<double>(one.name.size());
    }
    return fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">{}</svg>", width, height,
                       io::html_escaped(up), text);
}

std::string learning_curve(const Curve& curve) {
    constexpr double w = 310, h = 170, l = 44, r = 10, t = 26, b = 24;
    double most = curve.skilled.value_or(0);
    for (const double v : curve.values)
        if (std::isfinite(v)) most = std::max(most, v);
    const double step = nice_step(most > 0 ? most : 1, 4);
    most = std::ceil((most > 0 ? most : 1) / step - 1e-9) * step;
    const Scale x{1, std::max<double>(2, static_cast<double>(curve.values.size())), l + 10, w - r - 8},
        y{0, most, h - b, t};
    std::string text;
    for (double v = 0; v <= most + 1e-9; v += step)
        text += fmt::format(
            "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"{3}\"/>"
            "<text x=\"{4}\" y=\"{5:.1f}\" text-anchor=\"end\" class=\"tick\">{6:g}</text>",
            l, w - r, y(v), ink::grid, l - 5, y(v) + 4, v);
    if (curve.skilled)
        text += fmt::format(
            "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"{3}\" "
            "stroke-dasharray=\"5 4\" stroke-width=\"1.5\"/><text x=\"{1}\" y=\"{4:.1f}\" "
            "text-anchor=\"end\" class=\"tick\">skilled</text>",
            l, w - r, y(*curve.skilled), ink::good, y(*curve.skilled) - 4);
    std::string path, dots;
    bool drawing = false;
    for (std::size_t k = 0; k < curve.values.size(); ++k) {
        const double v = curve.values[k], at = x(static_cast<double>(k + 1));
        if (curve.values.size() <= 12 || k % (curve.values.size() / 8) == 0)
            text += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" class=\"tick\">{}</text>",
                                at, h - 8, k + 1);
        if (!std::isfinite(v)) {
            drawing = false;
            dots += fmt::format(
                "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" fill=\"{}\" "
                "font-size=\"13\">&#215;</text>",
                at, h - b - 3, ink::error);
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f} ", drawing ? "L" : "M", at, y(v));
        drawing = true;
        dots +=
            fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>", at, y(v), ink::wire);
    }
    return fmt::format(
        "<svg class=\"curve\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">"
        "<text x=\"4\" y=\"14\" class=\"lane\">{}</text>{}<path d=\"{}\" fill=\"none\" "
        "stroke=\"{}\" stroke-width=\"1.8\"/>{}</svg>",
        w, h, curve.name, curve.name + (curve.unit.empty() ? "" : ", " + curve.unit), text, path, ink::wire,
        dots);
}

}  // namespace debrief
