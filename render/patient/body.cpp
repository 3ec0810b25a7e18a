#include "render/patient/body.h"

#include <algorithm>
#include <array>

namespace render {

using geometry::Landmark;
using geometry::Vec3;

namespace {

constexpr std::array<Vertebra, 23> column = {{
    {"L5", -38, 1, 24.4, 17.5, 14.8},  {"L4", 0, 0, 23.7, 17.0, 14.4},    {"L3", 38, -1, 23.0, 16.5, 14.0},
    {"L2", 76, 0, 22.3, 16.0, 13.6},   {"L1", 114, 4, 21.6, 15.5, 13.2},  {"T12", 150, 9, 20.5, 15.2, 13.0},
    {"T11", 184, 14, 19.3, 15, 12.6},  {"T10", 216, 19, 18, 14.8, 12.2},  {"T9", 246, 23, 17, 14.6, 11.8},
    {"T8", 274, 26, 16.2, 14.4, 11.4}, {"T7", 301, 28, 15.4, 14.2, 11},   {"T6", 327, 29, 14.8, 13.8, 10.7},
    {"T5", 352, 29, 14.4, 13.2, 10.4}, {"T4", 376, 28, 14.2, 12.5, 10.1}, {"T3", 399, 26, 14.3, 11.6, 9.8},
    {"T2", 421, 23, 14.8, 10.8, 9.5},  {"T1", 442, 19, 15.4, 10, 9.2},    {"C7", 462, 14, 14.5, 8.5, 7.5},
    {"C6", 481, 9, 13.5, 8.2, 7.2},    {"C5", 500, 6, 12.8, 8, 7},        {"C4", 519, 4, 12.3, 7.8, 7},
    {"C3", 538, 4, 11.8, 7.8, 7.2},    {"C2", 560, 6, 11, 7.8, 9.5},
}};

/// The interval of the column that holds a height, extended at both ends.
std::size_t interval(double z) {
    const auto above = std::upper_bound(column.begin(), column.end(), z,
                                        [](double height, const Vertebra& v) { return height < v.z; });
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above - column.begin(), 1, column.size() - 1));
}

}  // namespace

Vec3 place_in_body(Landmark landmark) {
    switch (landmark) {
        case Landmark::AorticBifurcation:
            return {0, -14, 0};
        case Landmark::AorticValve:
            return {-17, -56, 300};
        case Landmark::Sella:
            return {0, -14, 630};
    }
    return Vec3::Zero();
}

std::span<const Vertebra> vertebrae() {
    return column;
}

double spine_front(double z) {
    const std::size_t i = interval(z);
    const Vertebra &below = column[i - 1], &above = column[i];
    const double t = std::clamp((z - below.z) / (above.z - below.z), 0.0, 1.0);
    return below.front + t * (above.front - below.front);
}

double spine_slope(double z) {
    constexpr double reach = 30.0;
    return (spine_front(z + reach) - spine_front(z - reach)) / (2.0 * reach);
}

}  // namespace render
