#include "render/xray/registration.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/picture/filter.h"
#include "render/picture/resample.h"

namespace render {
namespace {

constexpr int coarsest = 96;  // pixels along a side, or fewer
/// Structures between these widths count: finer ones are noise, wider ones contrast in small vessels,
/// scatter.
constexpr double fine_blur = 1.0, coarse_blur = 5.0;  // [pixels]
constexpr double outlier = 2.0 * 1.4826;              // residual of half weight, in median residuals [-]
/// Pixels whose signs agree, minus the others, for a shift to be believed: noise that was searched for its
/// best place reaches 0.1.
constexpr double least_agreement = 0.15;  // fraction of all [-]

Field structure_of(const Field& field) {
    const Field wide = gaussian_blur(field, coarse_blur);
    Field structure = gaussian_blur(field, fine_blur);
    for (std::size_t i = 0; i < structure.values.size(); ++i) structure.values[i] -= wide.values[i];
    return structure;
}

/// One size of both, and the pixels to compare.
struct Level {
    Field mask, image;
    std::vector<std::uint32_t> pixels;

    Level(const Field& log_mask, const Field& log_signal, const Field& where)
        : mask(structure_of(log_mask)), image(structure_of(log_signal)) {
        // Central differences need a neighbour on each side.
        for (int j = 1; j + 1 < where.height; ++j)
            for (int i = 1; i + 1 < where.width; ++i) {
                const auto pixel = static_cast<std::uint32_t>(j * where.width + i);
                if (where.values[pixel] > 0.5f) pixels.push_back(pixel);
            }
    }
};

/// Squared scale of the residuals: half of a residual as large counts. `residuals` are reordered.
double squared_scale(std::vector<float>& residuals) {
    for (float& r : residuals) r = std::abs(r);
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    const double scale = outlier * std::max(static_cast<double>(*middle), 1e-6);
    return scale * scale;
}

/// Residuals with the mask as it is.
std::vector<float> residuals_of(const Level& level, const Field& mask) {
    std::vector<float> residuals;
    residuals.reserve(level.pixels.size());
    for (const std::uint32_t pixel : level.pixels)
        residuals.push_back(level.image.values[pixel] - mask.values[pixel]);
    return residuals;
}

/// Mean of Geman and McClure's r²/(r² + c²), which no outlier raises beyond its fraction.
double robust_cost(const Level& level, const Field& mask, double squared) {
    double sum = 0.0;
    for (const std::uint32_t pixel : level.pixels) {
        const double r = level.image.values[pixel] - mask.values[pixel];
        sum += r * r / (r * r + squared);
    }
    return sum / static_cast<double>(level.pixels.size());
}

/// The whole number of pixels at which the level costs least.
Registration searched(const Level& level, int reach) {
    std::vector<float> residuals = residuals_of(level, level.mask);
    const double squared = squared_scale(residuals);
    Registration best;
    double least = robust_cost(level, level.mask, squared);
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            const double cost = robust_cost(level, shifted(level.mask, x, y), squared);
            if (cost >= least) continue;
            least = cost;
            best = {static_cast<double>(x), static_cast<double>(y), false};
        }
    }
    return best;
}

/// From a shift that is right within a pixel or two.
Registration refined(const Level& level, Registration at) {
    constexpr int most_steps = 12;
    constexpr double longest = 1.0, enough = 0.003;  // of a step [pixels]
    const int width = level.mask.width;
    for (int step = 0; step < most_steps; ++step) {
        const Field mask = shifted(level.mask, at.x, at.y);
        std::vector<float> residuals = residuals_of(level, mask);
        const double squared = squared_scale(residuals);
        double xx = 0, xy = 0, yy = 0, xr = 0, yr = 0, agree = 0;
        for (const std::uint32_t pixel : level.pixels) {
            const float* const m = mask.values.data() + pixel;
            const double image = level.image.values[pixel], r = image - *m;
            const double root = squared / (r * r + squared), weight = root * root;
            const double gx = 0.5 * (m[1] - m[-1]), gy = 0.5 * (m[width] - m[-width]);
            xx += weight * gx * gx;
            xy += weight * gx * gy;
            yy += weight * gy * gy;
            xr += weight * gx * r;
            yr += weight * gy * r;
            agree += (*m > 0.0f) == (image > 0.0) ? 1.0 : -1.0;
        }
        at.found = agree > least_agreement * static_cast<double>(level.pixels.size());
        const double determinant = xx * yy - xy * xy;
        if (!(determinant > 1e-9 * (xx + yy) * (xx + yy))) return {at.x, at.y, false};
        // The residual r changes by the mask's gradient times the step.
        double dx = -(yy * xr - xy * yr) / determinant, dy = -(xx * yr - xy * xr) / determinant;
        const double length = std::hypot(dx, dy);
        if (length > longest) dx *= longest / length, dy *= longest / length;
        at.x += dx;
        at.y += dy;
        if (length < enough) break;
    }
    return at;
}

}  // namespace

Registration registration(const Field& log_mask, const Field& log_signal, const Field& where, double reach) {
    assert(log_mask.values.size() == log_signal.values.size() &&
           log_mask.values.size() == where.values.size());
    int factor = 1;
    while (log_mask.width / factor > coarsest) factor *= 2;
    Registration found;
    for (bool first = true; factor >= 1; factor /= 2, first = false) {
        const Level level =
            factor == 1 ? Level(log_mask, log_signal, where)
                        : Level(shrink(log_mask, factor), shrink(log_signal, factor), shrink(where, factor));
        if (level.pixels.empty()) return {};
        if (first)
            found = searched(level, static_cast<int>(std::ceil(reach / factor)));
        else
            found = {2.0 * found.x, 2.0 * found.y, false};
        found = refined(level, found);
        if (factor > 1) continue;
        // What costs more than no shift at all, or lies out of reach, is not an answer.
        std::vector<float> residuals = residuals_of(level, level.mask);
        const double squared = squared_scale(residuals);
        const bool better = robust_cost(level, shifted(level.mask, found.x, found.y), squared) <=
                            robust_cost(level, level.mask, squared);
        if (!found.found) return {};
        if (!better || std::abs(found.x) > reach || std::abs(found.y) > reach) return {0.0, 0.0, true};
    }
    return found;
}

}  // namespace render
