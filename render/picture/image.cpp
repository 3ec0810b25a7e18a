#include "render/picture/image.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace render {

namespace {

std::string size_text(const GrayImage& image) {
    return std::to_string(image.width) + "x" + std::to_string(image.height);
}

void require_equal_sizes(const GrayImage& a, const GrayImage& b) {
    if (a.width != b.width || a.height != b.height || a.pixels.size() != b.pixels.size()) {
        throw std::invalid_argument("images of " + size_text(a) + " and " + size_text(b) +
                                    " cannot be compared");
    }
}

}  // namespace

ImageDifference difference(const GrayImage& a, const GrayImage& b) {
    require_equal_sizes(a, b);
    ImageDifference result;
    long long sum = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const int apart = std::abs(int(a.pixels[i]) - int(b.pixels[i]));
        sum += apart;
        result.largest = std::max(result.largest, double(apart));
        result.pixels_differing += apart > 0;
    }
    if (!a.pixels.empty()) result.mean = double(sum) / double(a.pixels.size());
    return result;
}

}  // namespace render
