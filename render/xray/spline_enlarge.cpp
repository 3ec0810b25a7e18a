#include "render/xray/spline_enlarge.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace render {
namespace {

/// Coefficients of the cubic B-spline through values that are `stride` apart, mirrored at both ends. M.
/// Unser, IEEE Signal Processing Magazine 16(6):22–38 (1999), box 2: a recursion forth and back with the pole
/// √3 − 2.
void to_coefficients(float* values, int count, int stride) {
    if (count < 2) return;
    const auto at = [=](int i) -> float& { return values[static_cast<std::ptrdiff_t>(i) * stride]; };
    const float pole = std::sqrt(3.0f) - 2.0f;
    constexpr int horizon = 12;  // pole^12 < 2e-7
    float sum = at(0), power = pole;
    for (int i = 1; i < std::min(horizon, count); ++i, power *= pole) sum += power * at(i);
    at(0) = sum;
    for (int i = 1; i < count; ++i) at(i) += pole * at(i - 1);
    at(count - 1) = pole / (pole * pole - 1.0f) * (at(count - 1) + pole * at(count - 2));
    for (int i = count - 2; i >= 0; --i) at(i) = pole * (at(i + 1) - at(i));
    for (int i = 0; i < count; ++i) at(i) *= 6.0f;
}

/// The four coefficients that a place takes, and their weights.
struct SplinePlace {
    std::array<int, 4> nodes;
    std::array<float, 4> weights;
};

SplinePlace spline_place(double x, int count) {
    const int low = static_cast<int>(std::floor(x));
    const auto t = static_cast<float>(x - low), s = 1.0f - t;
    SplinePlace place{{},
                      {s * s * s / 6.0f, 2.0f / 3.0f - t * t * (2.0f - t) / 2.0f,
                       2.0f / 3.0f - s * s * (2.0f - s) / 2.0f, t * t * t / 6.0f}};
    for (int k = 0; k < 4; ++k) {
        int node = std::abs(low - 1 + k);
        if (node >= count) node = 2 * (count - 1) - node;
        place.nodes[k] = std::clamp(node, 0, count - 1);
    }
    return place;
}

}  // namespace

Field spline_enlarged(Field field, int margin, int pixels) {
    assert(field.width == field.height && field.width > 2 * margin);
    const int count = field.width, inner = count - 2 * margin;
    for (int j = 0; j < count; ++j)
        to_coefficients(&field.values[static_cast<std::size_t>(j) * count], count, 1);
    for (int i = 0; i < count; ++i) to_coefficients(&field.values[static_cast<std::size_t>(i)], count, count);

    std::vector<SplinePlace> places;
    for (int i = 0; i < pixels; ++i)
        places.push_back(spline_place((i + 0.5) * inner / pixels - 0.5 + margin, count));
    Field enlarged(pixels, pixels);
    std::vector<float> row(static_cast<std::size_t>(count));
    for (int j = 0; j < pixels; ++j) {
        const SplinePlace& down = places[static_cast<std::size_t>(j)];
        std::array<const float*, 4> from;
        for (int k = 0; k < 4; ++k) from[k] = &field.values[static_cast<std::size_t>(down.nodes[k]) * count];
        for (int i = 0; i < count; ++i)
            row[static_cast<std::size_t>(i)] = down.weights[0] * from[0][i] + down.weights[1] * from[1][i] +
                                               down.weights[2] * from[2][i] + down.weights[3] * from[3][i];
        float* to = &enlarged.values[static_cast<std::size_t>(j) * pixels];
        for (int i = 0; i < pixels; ++i) {
            const SplinePlace& across = places[static_cast<std::size_t>(i)];
            to[i] = across.weights[0] * row[across.nodes[0]] + across.weights[1] * row[across.nodes[1]] +
                    across.weights[2] * row[across.nodes[2]] + across.weights[3] * row[across.nodes[3]];
        }
    }
    return enlarged;
}

}  // namespace render
