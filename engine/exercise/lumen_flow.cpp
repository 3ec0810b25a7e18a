#include "engine/exercise/lumen_flow.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace exercise {
namespace {

constexpr double rated_pressure = 8.27e6;  // [Pa]
constexpr double viscosity = 6e-3;         // of contrast of 300 mg/ml at 37 °C [Pa·s]
constexpr double density = 1330;           // [kg/m³]

/// A stretch of lumen: pressure lost at a flow [m³/s] is the larger of both laws'.
struct Stretch {
    double laminar = 0;    // [Pa·s/m³]
    double turbulent = 0;  // [Pa/(m³/s)^1.75]
};

/// Between radii r < R [m]; r = 0 is an open lumen.
Stretch stretch(double length, double outer, double inner) {
    if (length <= 0) return {};
    double conductance = std::pow(outer, 4);
    if (inner > 0) {
        const double square = outer * outer - inner * inner;
        conductance -= std::pow(inner, 4) + square * square / std::log(outer / inner);
    }
    const double area = std::numbers::pi * (outer * outer - inner * inner), hydraulic = 2 * (outer - inner);
    return {8 * viscosity * length / (std::numbers::pi * conductance),
            0.158 * length * std::pow(density, 0.75) * std::pow(viscosity, 0.25) /
                (std::pow(hydraulic, 1.25) * std::pow(area, 1.75))};
}

}  // namespace

double largest_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside) {
    constexpr double m = 1e-3;  // [m/mm]
    const double bore = 0.5 * m * catheter.inner_diameter, wire = 0.5 * m * wire_diameter;
    const double filled = std::clamp(wire_inside, 0.0, catheter.length);
    if (bore <= 0 || (filled > 0 && wire >= bore)) return 0;
    const Stretch parts[] = {stretch(m * filled, bore, wire),
                             stretch(m * (catheter.length - filled), bore, 0)};
    double low = 0, high = 1e-3;  // [m³/s]
    for (int k = 0; k < 60; ++k) {
        const double flow = 0.5 * (low + high);
        double lost = 0;
        for (const Stretch& part : parts)
            lost += std::max(part.laminar * flow, part.turbulent * std::pow(flow, 1.75));
        (lost < rated_pressure ? low : high) = flow;
    }
    return low * 1e6;
}

}  // namespace exercise
