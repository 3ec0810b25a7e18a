#include "render/picture/shift.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace render {
namespace {

/// The four neighbours that a pixel is made of, the first one relative to the pixel, and their weights.
struct CubicTaps {
    int first;
    std::array<float, 4> weights;
};

CubicTaps cubic_taps(double shift, int size) {
    const double from = -std::clamp(shift, -static_cast<double>(size), static_cast<double>(size));
    const double below = std::floor(from), t = from - below;
    const double t2 = t * t, t3 = t2 * t;
    return {static_cast<int>(below) - 1,
            {static_cast<float>(-0.5 * t + t2 - 0.5 * t3), static_cast<float>(1.0 - 2.5 * t2 + 1.5 * t3),
             static_cast<float>(0.5 * t + 2.0 * t2 - 1.5 * t3), static_cast<float>(0.5 * (t3 - t2))}};
}

}  // namespace

Field shifted(const Field& field, double x, double y) {
    if ((x == 0.0 && y == 0.0) || field.values.empty()) return field;
    const int width = field.width, height = field.height;
    const CubicTaps across = cubic_taps(x, width), down = cubic_taps(y, height);
    Field aside(width, height), moved(width, height);
    // Of a row with its edges repeated as far as the taps reach, every pixel is found without a test.
    std::vector<float> row(static_cast<std::size_t>(width) + 3);
    for (int j = 0; j < height; ++j) {
        const float* const from = field.values.data() + static_cast<std::size_t>(j) * width;
        for (int i = 0; i < width + 3; ++i) row[i] = from[std::clamp(i + across.first, 0, width - 1)];
        float* const to = aside.values.data() + static_cast<std::size_t>(j) * width;
        const auto& w = across.weights;
        for (int i = 0; i < width; ++i)
            to[i] = (w[0] * row[i] + w[1] * row[i + 1]) + (w[2] * row[i + 2] + w[3] * row[i + 3]);
    }
    for (int j = 0; j < height; ++j) {
        std::array<const float*, 4> rows;
        for (int k = 0; k < 4; ++k)
            rows[k] = aside.values.data() +
                      static_cast<std::size_t>(std::clamp(j + down.first + k, 0, height - 1)) * width;
        float* const to = moved.values.data() + static_cast<std::size_t>(j) * width;
        const auto& w = down.weights;
        for (int i = 0; i < width; ++i)
            to[i] = (w[0] * rows[0][i] + w[1] * rows[1][i]) + (w[2] * rows[2][i] + w[3] * rows[3][i]);
    }
    return moved;
}

}  // namespace render
