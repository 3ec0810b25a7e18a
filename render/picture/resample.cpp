#include "render/picture/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace render {
namespace {

/// Fractions of old pixels in new pixel `i` along one side.
struct Span {
    int first = 0;
    std::vector<double> fractions;  // their sum is 1
};
Span span_of(int i, int from, int to) {
    const double start = double(i) * from / to, stop = double(i + 1) * from / to;
    Span span{std::min(static_cast<int>(start), from - 1), {}};
    for (int k = span.first; k < from && k < stop; ++k) {
        span.fractions.push_back((std::min(stop, k + 1.0) - std::max(start, double(k))) / (stop - start));
    }
    return span;
}

/// The mean over the area that each new pixel covers.
GrayImage reduced(const GrayImage& image, int width, int height) {
    std::vector<Span> columns;
    for (int i = 0; i < width; ++i) columns.push_back(span_of(i, image.width, width));
    GrayImage result{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height)};
    for (int j = 0; j < height; ++j) {
        const Span rows = span_of(j, image.height, height);
        for (int i = 0; i < width; ++i) {
            double sum = 0.0;
            for (std::size_t r = 0; r < rows.fractions.size(); ++r) {
                const std::uint8_t* row =
                    &image
                         .pixels[(rows.first + r) * image.width + static_cast<std::size_t>(columns[i].first)];
                for (std::size_t c = 0; c < columns[i].fractions.size(); ++c) {
                    sum += rows.fractions[r] * columns[i].fractions[c] * row[c];
                }
            }
            result.pixels[static_cast<std::size_t>(j) * width + i] =
                static_cast<std::uint8_t>(std::lround(sum));
        }
    }
    return result;
}

/// Position of a new row or column between two old ones: share/256 of the way from `first` to `second`.
struct Between {
    int first = 0;
    int second = 0;
    int fraction = 0;
};
std::vector<Between> between(int from, int to) {
    std::vector<Between> places(static_cast<std::size_t>(to));
    for (int i = 0; i < to; ++i) {
        const double place = std::clamp((i + 0.5) * from / to - 0.5, 0.0, from - 1.0);
        const int first = static_cast<int>(place);
        places[i] = {first, std::min(first + 1, from - 1),
                     static_cast<int>(std::lround((place - first) * 256.0))};
    }
    return places;
}

/// Bilinear, in integers: the same on every machine.
GrayImage enlarged(const GrayImage& image, int width, int height) {
    const auto columns = between(image.width, width), rows = between(image.height, height);
    GrayImage result{width, height, std::vector<std::uint8_t>(std::size_t(width) * height)};
    std::vector<int> mixed(static_cast<std::size_t>(image.width));  // 256 times a row of old columns
    for (int j = 0; j < height; ++j) {
        const std::uint8_t* upper = &image.pixels[std::size_t(rows[j].first) * image.width];
        const std::uint8_t* lower = &image.pixels[std::size_t(rows[j].second) * image.width];
        for (int i = 0; i < image.width; ++i) {
            mixed[i] = 256 * upper[i] + rows[j].fraction * (lower[i] - upper[i]);
        }
        std::uint8_t* to = &result.pixels[std::size_t(j) * width];
        for (int i = 0; i < width; ++i) {
            const auto& [first, second, fraction] = columns[i];
            to[i] = static_cast<std::uint8_t>(
                (256 * mixed[first] + fraction * (mixed[second] - mixed[first]) + 32768) >> 16);
        }
    }
    return result;
}

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

GrayImage resized(const GrayImage& image, int width, int height) {
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height) {
        throw std::invalid_argument("an image without pixels cannot be resampled");
    }
    if (width < 1 || height < 1) throw std::invalid_argument("an image cannot be resampled to nothing");
    if (image.width == width && image.height == height) return image;
    return width < image.width || height < image.height ? reduced(image, width, height)
                                                        : enlarged(image, width, height);
}

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
