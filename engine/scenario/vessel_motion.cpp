#include "engine/scenario/vessel_motion.h"

#include <cmath>
#include <numbers>

namespace scenario {
namespace {

constexpr double seconds_per_minute = 60.0;

double phase(double time, double rate) {
    const double cycles = time * rate / seconds_per_minute;
    return cycles - std::floor(cycles);
}

}  // namespace

double contraction(double time, double rate) {
    constexpr double systole = 1.0 / 3;
    const double p = phase(time, rate);
    const double part = p < systole ? p / systole : 1 + (p - systole) / (1 - systole);
    return 0.5 * (1 - std::cos(std::numbers::pi * part));
}

double peristalsis(double time) {
    constexpr double period = 60.0;  // [s]
    return 0.5 * (1 - std::cos(2 * std::numbers::pi * time / period));
}

double inspiration(double time, double rate) {
    const double s = std::sin(std::numbers::pi * phase(time, rate));
    return s * s * s * s;
}

geometry::Vec3 VesselMotion::at(double time, double breathing_time) const {
    return contraction(time, heart_rate) * heart_reach +
           inspiration(breathing_time, breathing_rate) * breathing_reach;
}

}  // namespace scenario
