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

/// The greater curvature of the picture, smoothed, in its unit by standard deviation squared.
Field curvature(const Field& picture, double sigma) {
    const Field smooth = render::gaussian_blur(picture, sigma);
    Field ridge(picture.width, picture.height);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const double here = at(smooth, x, y), xx = at(smooth, x + 1, y) + at(smooth, x - 1, y) - 2 * here,
                         yy = at(smooth, x, y + 1) + at(smooth, x, y - 1) - 2 * here,
                         xy = 0.25 * (at(smooth, x + 1, y + 1) + at(smooth, x - 1, y - 1) -
                                      at(smooth, x + 1, y - 1) - at(smooth, x - 1, y + 1));
            const double least = (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy);
            ridge.values[static_cast<std::size_t>(y) * picture.width + x] =
                static_cast<float>(std::max(0.0, -least * sigma * sigma));
        }
    return ridge;
}

/// A picture of yes and no.
struct Mask {
    int width, height;
    std::vector<std::uint8_t> set;
    int operator()(int x, int y) const {
        return x >= 0 && y >= 0 && x < width && y < height &&
               set[static_cast<std::size_t>(y) * width + x] != 0;
    }
    /// From above, clockwise.
    std::array<int, 8> around(int x, int y) const {
        return {(*this)(x, y - 1), (*this)(x + 1, y - 1), (*this)(x + 1, y), (*this)(x + 1, y + 1),
                (*this)(x, y + 1), (*this)(x - 1, y + 1), (*this)(x - 1, y), (*this)(x - 1, y - 1)};
    }
};

/// Lines of one pixel (Zhang and Suen, Communications of the ACM 27, 1984, 236).
void make_thin(Mask& mask) {
    std::vector<std::size_t> gone;
    bool changed = true;
    while (changed) {
        changed = false;
        for (const int pass : {0, 1}) {
            gone.clear();
            for (int y = 0; y < mask.height; ++y)
                for (int x = 0; x < mask.width; ++x) {
                    if (!mask(x, y)) continue;
                    const std::array<int, 8> p = mask.around(x, y);
                    int all = 0, rises = 0;
                    for (std::size_t k = 0; k < 8; ++k) all += p[k], rises += !p[k] && p[(k + 1) % 8];
                    const bool free = pass == 0 ? p[0] * p[2] * p[4] == 0 && p[2] * p[4] * p[6] == 0
                                                : p[0] * p[2] * p[6] == 0 && p[0] * p[4] * p[6] == 0;
                    if (all >= 2 && all <= 6 && rises == 1 && free)
                        gone.push_back(static_cast<std::size_t>(y) * mask.width + x);
                }
            for (const std::size_t k : gone) mask.set[k] = 0;
            changed = changed || !gone.empty();
        }
    }
}

/// Calls use(pixels) for each set of pixels that touch.
template <class Use>
void for_each_piece(const Mask& mask, const Use& use) {
    Mask left = mask;
    std::vector<std::size_t> piece;
    for (std::size_t start = 0; start < left.set.size(); ++start) {
        if (!left.set[start]) continue;
        piece.assign(1, start);
        left.set[start] = 0;
        for (std::size_t next = 0; next < piece.size(); ++next) {
            const int x = static_cast<int>(piece[next]) % mask.width,
                      y = static_cast<int>(piece[next]) / mask.width;
            for (int j = y - 1; j <= y + 1; ++j)
                for (int i = x - 1; i <= x + 1; ++i)
                    if (left(i, j)) {
                        piece.push_back(static_cast<std::size_t>(j) * mask.width + i);
                        left.set[piece.back()] = 0;
                    }
        }
        use(piece);
    }
}

}  // namespace

Ridges ridges_of(const Field& dark, double pixel, const std::vector<std::uint8_t>& area) {
    constexpr std::array<double, 2> widths = {0.3, 0.5};       // [mm]
    constexpr double strong = 0.95, weak = 0.5, shortest = 2;  // the last [mm]
    Field ridge(dark.width, dark.height);
    for (const double width : widths) {
        const Field one = curvature(dark, width / pixel);
        for (std::size_t k = 0; k < ridge.values.size(); ++k)
            ridge.values[k] = std::max(ridge.values[k], one.values[k]);
    }
    std::vector<double> inside;
    for (std::size_t k = 0; k < ridge.values.size(); ++k)
        if (area[k]) inside.push_back(ridge.values[k]);
    if (inside.empty()) return {};
    const double cm2 = static_cast<double>(inside.size()) * pixel * pixel / 100;
    const double least = weak * quantile(inside, strong);
    Mask lines{dark.width, dark.height, std::vector<std::uint8_t>(area.size(), 0)};
    for (std::size_t k = 0; k < area.size(); ++k) lines.set[k] = area[k] && ridge.values[k] > least;
    make_thin(lines);
    for_each_piece(Mask(lines), [&](const std::vector<std::size_t>& piece) {
        if (static_cast<double>(piece.size()) * pixel >= shortest) return;
        for (const std::size_t k : piece) lines.set[k] = 0;
    });
    Ridges found;
    Mask forks{dark.width, dark.height, std::vector<std::uint8_t>(area.size(), 0)};
    for (int y = 0; y < lines.height; ++y)
        for (int x = 0; x < lines.width; ++x) {
            if (!lines(x, y)) continue;
            const std::array<int, 8> p = lines.around(x, y);
            found.length += p[2] + p[4];
            // Diagonals, where no other way leads there.
            found.length += std::numbers::sqrt2 * ((p[3] && !p[2] && !p[4]) + (p[5] && !p[4] && !p[6]));
            int all = 0, rises = 0;
            for (std::size_t k = 0; k < 8; ++k) all += p[k], rises += !p[k] && p[(k + 1) % 8];
            forks.set[static_cast<std::size_t>(y) * lines.width + x] = rises >= 3 || all >= 4;
        }
    found.length *= pixel / cm2;
    for_each_piece(forks, [&](const std::vector<std::size_t>&) { found.branches += 1 / cm2; });
    return found;
}

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
