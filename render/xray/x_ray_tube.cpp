#include "render/xray/x_ray_tube.h"

#include <algorithm>
#include <cmath>

#include "render/xray/materials.h"

namespace render {
namespace {

constexpr double least_kvp = 60.0, most_kvp = 120.0;          // [kV]
constexpr double least_current = 20.0;                        // at the least voltage [mA]
constexpr double current_per_kvp = 2.0;                       // [mA/kV]
constexpr double shortest_width = 1.0, usual_width = 6.0;     // [ms]
constexpr double fluoro_width = 12.0, longest_width = 100.0;  // [ms]
constexpr double most_power = 60.0;                           // of the generator [kW]

double current_at(double kvp) {
    return least_current + current_per_kvp * (std::clamp(kvp, least_kvp, most_kvp) - least_kvp);
}

/// Air kerma of Kramers' spectrum behind aluminium and copper [mm], in arbitrary units.
double kerma(double kvp, double aluminium, double copper) {
    double sum = 0.0;
    for (double energy = 15.25; energy < kvp; energy += 0.5) {
        sum += (kvp - energy) * air_energy_absorption(energy) *
               std::exp(-attenuation(Material::Aluminium, energy) * aluminium -
                        attenuation(Material::Copper, energy) * copper);
    }
    return sum;
}

}  // namespace

double kerma_per_charge(double kvp) {
    static const double level = 0.080 / kerma(80.0, 2.5, 0.0);  // [mGy/mAs]
    return level * kerma(kvp, 2.5, 0.2);
}

Technique exposure_at(double kvp, double charge) {
    const double wanted = 1000.0 * charge;  // [mA·ms]
    Technique technique;
    technique.kvp = kvp;
    technique.current = current_at(kvp);
    technique.pulse_width = std::clamp(wanted / technique.current, shortest_width, fluoro_width);
    const double most_current = 1000.0 * most_power / kvp;
    technique.current = std::min(wanted / technique.pulse_width, most_current);
    technique.pulse_width = std::clamp(wanted / technique.current, shortest_width, longest_width);
    technique.delivered = std::min(1.0, technique.current * technique.pulse_width / wanted);
    return technique;
}

Technique automatic_exposure(const std::function<double(double)>& charge) {
    // The lowest whole voltage at which a pulse of the usual width is enough.
    double low = least_kvp - 1.0, high = most_kvp;
    while (high - low > 1.0) {
        const double middle = std::floor(0.5 * (low + high));
        (1000.0 * charge(middle) <= usual_width * current_at(middle) ? high : low) = middle;
    }
    return exposure_at(high, charge(high));
}

}  // namespace render
