#include "engine/studies/picture_measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "engine/studies/quantile.h"
#include "render/picture/filter.h"

namespace studies {
namespace {

using render::Field;

float at(const Field& f, int x, int y) {
    return f.values[static_cast<std::size_t>(std::clamp(y, 0, f.height - 1)) * f.width +
                    std::clamp(x, 0, f.width - 1)];
}

double between(const Field& f, double x, double y) {
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const double u = x - i, v = y - j;
    return (1 - v) * ((1 - u) * at(f, i, j) + u * at(f, i + 1, j)) +
           v * ((1 - u) * at(f, i, j + 1) + u * at(f, i + 1, j + 1));
}

/// The largest of 2 reach + 1 pixels along rows, then along columns.
Field largest_around(const Field& f, int reach) {
    Field rows(f.width, f.height), both(f.width, f.height);
    const auto pass = [reach](const Field& from, Field& to, int dx, int dy) {
        for (int y = 0; y < from.height; ++y)
            for (int x = 0; x < from.width; ++x) {
                float most = at(from, x, y);
                for (int k = -reach; k <= reach; ++k) most = std::max(most, at(from, x + k * dx, y + k * dy));
                to.values[static_cast<std::size_t>(y) * from.width + x] = most;
            }
    };
    pass(f, rows, 1, 0);
    pass(rows, both, 0, 1);
    return both;
}

Field negative(Field f) {
    for (float& value : f.values) value = -value;
    return f;
}

/// 10 to 90 % of the rise of `picture` through a place along a direction, in pixels; not a number where it
/// does not end within reach.
double edge_width(const Field& picture, double x, double y, double dx, double dy) {
    constexpr double step = 0.25, reach = 30, flat = 0.1;  // [pixels], [pixels], of the steepest slope
    const auto value = [&](double s) { return between(picture, x + s * dx, y + s * dy); };
    const auto slope = [&](double s) { return value(s + 0.5) - value(s - 0.5); };
    const double least = flat * slope(0);
    std::array<double, 2> end{};
    for (int side = 0; side < 2; ++side) {
        double s = 0;
        while (std::abs(s) < reach && slope(s) > least) s += side == 0 ? -step : step;
        if (std::abs(s) >= reach) return std::nan("");
        end[side] = s;
    }
    const double low = value(end[0]), rise = value(end[1]) - low;
    double from = end[0], to = end[1];
    while (from < end[1] && value(from) < low + 0.1 * rise) from += step;
    while (to > end[0] && value(to) > low + 0.9 * rise) to -= step;
    return std::max(to - from, step);
}

std::vector<double> edge_widths(const Field& picture) {
    constexpr double smoothing = 0.7, steepest = 0.95;
    const Field smooth = render::gaussian_blur(picture, smoothing);
    Field slope(picture.width, picture.height);
    const auto gradient = [&](int x, int y) {
        return std::pair{0.5 * (at(smooth, x + 1, y) - at(smooth, x - 1, y)),
                         0.5 * (at(smooth, x, y + 1) - at(smooth, x, y - 1))};
    };
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const auto [gx, gy] = gradient(x, y);
            slope.values[static_cast<std::size_t>(y) * picture.width + x] =
                static_cast<float>(std::hypot(gx, gy));
        }
    const double least = percentile(slope, steepest);
    std::vector<double> widths;
    for (int y = 2; y + 2 < picture.height; ++y)
        for (int x = 2; x + 2 < picture.width; ++x) {
            const double here = at(slope, x, y);
            if (!(here > least)) continue;
            const auto [gx, gy] = gradient(x, y);
            const double dx = gx / here, dy = gy / here;
            if (between(slope, x + dx, y + dy) > here || between(slope, x - dx, y - dy) > here) continue;
            if (const double width = edge_width(smooth, x, y, dx, dy); std::isfinite(width))
                widths.push_back(width);
        }
    return widths;
}

/// Root mean squares in whole windows.
std::vector<double> in_windows(const Field& f, int side) {
    std::vector<double> all;
    for (int y = 0; y + side <= f.height; y += side)
        for (int x = 0; x + side <= f.width; x += side) {
            double sum = 0;
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i) sum += std::pow(at(f, x + i, y + j), 2);
            all.push_back(std::sqrt(sum / (side * side)));
        }
    return all;
}

/// The difference of Gaussians of σ and 2σ passes most at the frequency √(ln 4 / 6) / (π σ).
Field octave_of(const Field& picture, double from, double pixel) {
    const double middle = from * std::numbers::sqrt2;  // wavelength [mm]
    const double sigma = middle * std::sqrt(std::log(4.0) / 6) / std::numbers::pi / pixel;
    Field fine = render::gaussian_blur(picture, sigma);
    const Field coarse = render::gaussian_blur(picture, 2 * sigma);
    for (std::size_t k = 0; k < fine.values.size(); ++k) fine.values[k] -= coarse.values[k];
    return fine;
}

}  // namespace

double noise_of(const Field& f) {
    double sum = 0, count = 0;
    for (int y = 1; y + 1 < f.height; ++y)
        for (int x = 1; x + 1 < f.width; ++x, ++count)
            sum += std::abs(at(f, x - 1, y - 1) - 2 * at(f, x, y - 1) + at(f, x + 1, y - 1) -
                            2 * at(f, x - 1, y) + 4 * at(f, x, y) - 2 * at(f, x + 1, y) +
                            at(f, x - 1, y + 1) - 2 * at(f, x, y + 1) + at(f, x + 1, y + 1));
    return std::sqrt(std::numbers::pi / 2) * sum / count / 6;
}

double percentile(const Field& f, double fraction) {
    return quantile({f.values.begin(), f.values.end()}, fraction);
}

Field depth_of_dark(const Field& f, int reach) {
    Field depth = negative(largest_around(negative(largest_around(f, reach)), reach));
    for (std::size_t k = 0; k < depth.values.size(); ++k) depth.values[k] -= f.values[k];
    return depth;
}

Field inner_part(const Field& f, double margin) {
    const int off = static_cast<int>(margin * f.width);
    Field inner(f.width - 2 * off, f.height - 2 * off);
    for (int y = 0; y < inner.height; ++y)
        for (int x = 0; x < inner.width; ++x)
            inner.values[static_cast<std::size_t>(y) * inner.width + x] = at(f, x + off, y + off);
    return inner;
}

Structure structure_of(const Field& picture, double pixel) {
    constexpr double window = 16, strong = 0.02;  // [mm], of all pixels
    const int side = static_cast<int>(std::lround(window / pixel));
    if (!(pixel > 0) || side < 2 || picture.width < 2 * side || picture.height < 2 * side)
        throw std::invalid_argument("a picture of two windows of 16 mm or more is needed");
    Structure found;
    const std::vector<double> widths = edge_widths(picture);
    for (std::size_t k = 0; k < 3; ++k)
        found.edges[k] = pixel * quantile(widths, std::array{0.1, 0.5, 0.9}[k]);
    for (std::size_t k = 0; k < octaves.size(); ++k) {
        const Field octave = octave_of(picture, octaves[k], pixel);
        const std::vector<double> local = in_windows(octave, side);
        found.power[k] = quantile(local, 0.5);
        if (k > 0) continue;
        found.evenness = found.power[0] / quantile(local, 0.9);
        std::vector<double> squares;
        double all = 0, largest = 0;
        for (const float value : octave.values)
            squares.push_back(double(value) * value), all += squares.back();
        const double least = quantile(squares, 1 - strong);
        for (const double square : squares) largest += square >= least ? square : 0;
        found.strongest = all > 0 ? largest / all : 0;
    }
    return found;
}

}  // namespace studies
