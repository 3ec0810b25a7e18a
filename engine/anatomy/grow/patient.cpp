#include "engine/anatomy/grow/patient.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "physics/geometry/maths.h"
#include "physics/geometry/random.h"

namespace anatomy {
namespace {

constexpr double mean_age = 65, age_deviation = 11;                 // [years]
constexpr double women_height = 1630, women_height_deviation = 65;  // [mm]
constexpr double men_height = 1760, men_height_deviation = 70;      // [mm]
constexpr double both_height = (women_height + men_height) / 2;     // [mm]
constexpr double mean_mass_index = 26, mass_index_deviation = 4;    // [kg/m²]

/// Where a quantity's own stream of numbers begins.
geometry::Random stream_of(std::uint64_t seed, std::string_view quantity, std::uint64_t attempt) {
    using geometry::golden_step, geometry::mixed;
    return geometry::Random(
        mixed(mixed(mixed(seed + golden_step) + geometry::fnv1a(quantity)) + attempt * golden_step));
}

double mean_height(const std::optional<Sex>& sex) {
    return !sex ? both_height : *sex == Sex::Female ? women_height : men_height;
}
double weight_for(double mass_index, double height) {
    return mass_index * height * height * 1e-6;
}

}  // namespace

double Patient::surface() const {
    return std::sqrt(height / 10 * weight / 3600);
}

std::string Patient::text() const {
    return fmt::format("{} of {:.0f} years, {:.0f} cm, {:.0f} kg",
                       !sex                  ? "mean adult"
                       : *sex == Sex::Female ? "woman"
                                             : "man",
                       age, height / 10, weight);
}

/// The sum of twelve uniform numbers, drawn again beyond ±2.5, is nearly normal. Its standard deviation is
/// then 0.961: dividing by that restores the published spread.
double Draws::normal(std::string_view quantity, std::uint64_t attempt) const {
    if (!varied()) return 0;
    constexpr double beyond = 2.5, deviation = 0.961;
    geometry::Random uniform = stream_of(seed_, quantity, attempt);
    for (;;) {
        double sum = -6;
        for (int k = 0; k < 12; ++k) sum += uniform();
        if (std::abs(sum) <= beyond) return sum / deviation;
    }
}

bool Draws::coin(std::string_view quantity) const {
    geometry::Random uniform = stream_of(seed_, quantity, 0);
    return varied() && uniform() < 0.5;
}

Patient drawn_patient(const Draws& draws, const PatientWish& wish) {
    Patient patient;
    if (draws.varied()) patient.sex = draws.coin("sex") ? Sex::Female : Sex::Male;
    if (wish.sex) patient.sex = wish.sex;
    patient.age =
        wish.age.value_or(std::clamp(mean_age + age_deviation * draws.normal("age"), youngest, oldest));
    const double deviation = patient.sex == Sex::Female ? women_height_deviation : men_height_deviation;
    patient.height = wish.height.value_or(mean_height(patient.sex) + deviation * draws.normal("height"));
    const double mass_index = mean_mass_index + mass_index_deviation * draws.normal("mass index");
    patient.weight = wish.weight.value_or(weight_for(mass_index, patient.height));
    return patient;
}

double diameter_factor(const Trend& trend, const Patient& patient) {
    double of_sex = 1;
    if (patient.sex && trend.of_men) of_sex = *patient.sex == Sex::Female ? trend.women : 1;
    if (patient.sex && !trend.of_men)
        of_sex = (*patient.sex == Sex::Female ? trend.women : 1) * 2 / (1 + trend.women);
    Patient mean;
    mean.height = mean_height(patient.sex);
    mean.weight = weight_for(mean_mass_index, mean.height);
    const double size = geometry::pow(patient.surface() / mean.surface(), trend.by_surface);
    return of_sex * size * std::max(0.5, 1 + trend.yearly * (patient.age - mean_age));
}

double explained_deviation(const Trend& trend) {
    // The surface goes with height^1.5 and the square root of the body mass index.
    const double surface = geometry::hypot(1.5 * men_height_deviation / men_height,
                                           0.5 * mass_index_deviation / mean_mass_index);
    const double sexes = trend.of_men ? 0 : (1 - trend.women) / (1 + trend.women);
    return geometry::hypot(geometry::hypot(sexes, trend.yearly * age_deviation), trend.by_surface * surface);
}

double length_factor(double by_height, const Patient& patient) {
    return geometry::pow(patient.height / both_height, by_height);
}

}  // namespace anatomy
