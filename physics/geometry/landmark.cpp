#include "physics/geometry/landmark.h"

#include <algorithm>
#include <array>

namespace geometry {
namespace {

constexpr std::array<std::string_view, 3> names = {"aortic bifurcation", "aortic valve", "sella"};

}  // namespace

std::string_view name_of(Landmark landmark) {
    return names[static_cast<std::size_t>(landmark)];
}

std::optional<Landmark> landmark_named(std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return std::nullopt;
    return static_cast<Landmark>(found - names.begin());
}

std::span<const std::string_view> landmark_names() {
    return names;
}

}  // namespace geometry
