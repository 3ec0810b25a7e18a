#include "engine/blood/distal_arteries.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace blood {
namespace {

constexpr double smallest_radius = 0.15;       // [mm]
constexpr double radii_long = 10;              // a generation
constexpr double cubic_mm = 1000;              // of a ml
constexpr double longest = 6, shortest = 0.2;  // [s]

}  // namespace

double arterial_time(double radius, double flow) {
    if (!(flow > 1e-6)) return 0;
    const double velocity = cubic_mm * flow / (std::numbers::pi * radius * radius);
    const double generations = 3 * std::log2(std::max(2.0, radius / smallest_radius));
    return std::clamp(generations * radii_long * radius / velocity, shortest, longest);
}

DistalArteries::DistalArteries(std::span<const Outlet> outlets) {
    for (const Outlet& outlet : outlets) volume_.push_back(outlet.flow * outlet.arterial / bins);
    reset();
}

void DistalArteries::reset() {
    mass_.assign(volume_.size() * bins, 0.0);
    shown_.assign(mass_.size(), 0.0f);
}

double DistalArteries::pass(int outlet, double entering, double flow, double dt) {
    if (!(volume_[outlet] > 0)) return entering;
    const double passed = std::max(0.0, flow) * dt / volume_[outlet];  // bins passed
    if (passed == 0) {
        mass_[outlet * bins] += entering;
        return 0;
    }
    double* mass = mass_.data() + static_cast<std::ptrdiff_t>(outlet) * bins;
    const int whole = static_cast<int>(std::min(passed, 1.0 * bins));
    const double part = std::min(passed, 1.0 * bins) - whole;
    std::array<double, bins> moved{};
    double left = 0;
    const auto put = [&](int bin, double amount) {
        if (bin < bins)
            moved[bin] += amount;
        else
            left += amount;
    };
    for (int k = 0; k < bins; ++k) {
        put(k + whole, (1 - part) * mass[k]);
        put(k + whole + 1, part * mass[k]);
    }
    for (int k = 0; k < whole; ++k) put(k, entering / passed);
    put(whole, entering * std::max(0.0, 1 - whole / passed));
    std::copy(moved.begin(), moved.end(), mass);
    return left;
}

void DistalArteries::show() {
    for (std::size_t i = 0; i < mass_.size(); ++i) {
        const double volume = volume_[i / bins];
        shown_[i] = volume > 0 ? static_cast<float>(mass_[i] / volume) : 0.0f;
    }
}

double DistalArteries::held(int outlet) const {
    const auto first = mass_.begin() + static_cast<std::ptrdiff_t>(outlet) * bins;
    return std::accumulate(first, first + bins, 0.0);
}

}  // namespace blood
