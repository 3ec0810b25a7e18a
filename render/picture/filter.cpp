#include "render/picture/filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace render {

namespace {

/// Half of a symmetric kernel: the middle weight first.
std::vector<float> half_kernel(double sigma) {
    const int reach = blur_reach(sigma);
    const auto below = [sigma](double x) { return 0.5 * std::erf(x / (sigma * std::numbers::sqrt2)); };
    std::vector<double> weights;
    for (int k = 0; k <= reach; ++k) weights.push_back(below(k + 0.5) - below(k - 0.5));
    double sum = weights[0];
    for (int k = 1; k <= reach; ++k) sum += 2.0 * weights[k];
    std::vector<float> result;
    for (double weight : weights) result.push_back(static_cast<float>(weight / sum));
    return result;
}

}  // namespace

int blur_reach(double sigma) {
    return sigma > 0.0 ? static_cast<int>(std::ceil(3.0 * sigma + 0.5)) : 0;
}

void blur(Field& field, double sigma) {
    if (sigma > 0.0) blur(field, sigma, {}, {});
}

void blur(Field& field, double sigma, const ForRow& before, const ForRow& after) {
    if (field.values.empty()) return;
    const std::vector<float> kernel = sigma > 0.0 ? half_kernel(sigma) : std::vector<float>{1.0f};
    const int reach = static_cast<int>(kernel.size()) - 1;
    const int width = field.width, height = field.height;
    const auto row = [&field, width](int j) { return &field.values[static_cast<std::size_t>(j) * width]; };
    // Tap by tap over a whole line, so that the compiler can vectorise.
    std::vector<float> line(static_cast<std::size_t>(width + 2 * reach));
    const auto blur_along = [&](float* to) {
        std::fill_n(line.begin(), reach, to[0]);
        std::copy_n(to, width, line.begin() + reach);
        std::fill_n(line.begin() + reach + width, reach, to[width - 1]);
        const float* middle = line.data() + reach;
        for (int i = 0; i < width; ++i) to[i] = kernel[0] * middle[i];
        for (int k = 1; k <= reach; ++k) {
            for (int i = 0; i < width; ++i) to[i] += kernel[k] * (middle[i - k] + middle[i + k]);
        }
    };
    // Down the columns in place: overwritten rows that are still needed are kept in a ring.
    std::vector<std::vector<float>> ring(static_cast<std::size_t>(reach) + 1, std::vector<float>(width));
    std::vector<float> top;
    const auto blur_down = [&](int j) {
        float* to = row(j);
        std::vector<float>& own = ring[j % (reach + 1)];
        std::copy_n(to, width, own.begin());
        for (int i = 0; i < width; ++i) to[i] = kernel[0] * own[i];
        for (int k = 1; k <= reach; ++k) {
            const float* above = j - k < 0 ? top.data() : ring[(j - k) % (reach + 1)].data();
            const float* below = j + k < height ? row(j + k) : nullptr;
            // Below the last row the last row is repeated; it may be this one, which has been overwritten.
            if (below == nullptr) below = j == height - 1 ? own.data() : row(height - 1);
            for (int i = 0; i < width; ++i) to[i] += kernel[k] * (above[i] + below[i]);
        }
    };
    // A row is finished as soon as all rows that reach it are there, while all are still in the cache.
    for (int j = 0; j < height + reach; ++j) {
        if (j < height) {
            if (before) before(j, {row(j), static_cast<std::size_t>(width)});
            if (reach > 0) blur_along(row(j));
            if (j == 0) top.assign(row(0), row(0) + width);
        }
        if (j < reach) continue;
        if (reach > 0) blur_down(j - reach);
        if (after) after(j - reach, {row(j - reach), static_cast<std::size_t>(width)});
    }
}

Field gaussian_blur(Field field, double sigma) {
    blur(field, sigma);
    return field;
}

Field shrink(const Field& field, int factor) {
    const int width = (field.width + factor - 1) / factor, height = (field.height + factor - 1) / factor;
    Field result(width, height);
    for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
            const int right = std::min((i + 1) * factor, field.width);
            const int bottom = std::min((j + 1) * factor, field.height);
            double sum = 0.0;
            for (int y = j * factor; y < bottom; ++y) {
                for (int x = i * factor; x < right; ++x)
                    sum += field.values[static_cast<std::size_t>(y) * field.width + x];
            }
            const int count = (right - i * factor) * (bottom - j * factor);
            result.values[static_cast<std::size_t>(j) * width + i] = static_cast<float>(sum / count);
        }
    }
    return result;
}

namespace {

/// Bilinear values at column_at(i), row_at(j), positions of the field's pixel centres counted from 0.
template <class At>
Field interpolated(const Field& field, int width, int height, const At& column_at, const At& row_at) {
    Field result(width, height);
    const auto place = [](double at, int size) {
        const double x = std::clamp(at, 0.0, size - 1.0);
        const int low = std::min(static_cast<int>(x), std::max(size - 2, 0));
        return std::pair<int, float>(low, static_cast<float>(x - low));
    };
    std::vector<std::pair<int, float>> columns;
    for (int i = 0; i < width; ++i) columns.push_back(place(column_at(i), field.width));
    const int beside = field.width > 1 ? 1 : 0;
    for (int j = 0; j < height; ++j) {
        const auto [row, down] = place(row_at(j), field.height);
        const float* above = &field.values[static_cast<std::size_t>(row) * field.width];
        const float* below =
            &field.values[static_cast<std::size_t>(std::min(row + 1, field.height - 1)) * field.width];
        float* to = &result.values[static_cast<std::size_t>(j) * width];
        for (int i = 0; i < width; ++i) {
            const auto [column, right] = columns[i];
            const int next = column + beside;
            const float top = above[column] + right * (above[next] - above[column]);
            const float bottom = below[column] + right * (below[next] - below[column]);
            to[i] = top + down * (bottom - top);
        }
    }
    return result;
}

}  // namespace

Field enlarge(const Field& field, int factor, int width, int height) {
    const auto at = [factor](int i) { return (i + 0.5) / factor - 0.5; };
    return interpolated(field, width, height, at, at);
}

Field stretched(const Field& field, double step, int size) {
    const auto at = [step, size, &field](int i) {
        return (i + 0.5 - 0.5 * size) * step + 0.5 * field.width - 0.5;
    };
    return interpolated(field, size, size, at, at);
}

}  // namespace render
