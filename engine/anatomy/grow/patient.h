#pragma once
/// The patient whose vessels are grown: sex, age and size of the body, which lengths, diameters and angles
/// follow, and the random numbers that make patients differ.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace anatomy {

enum class Sex { Female, Male };

/// What the user says of the patient; the rest is drawn from the seed, or is the mean with seed 0.
struct PatientWish {
    std::optional<Sex> sex;
    std::optional<double> age;     // [years]
    std::optional<double> height;  // [mm]
    std::optional<double> weight;  // [kg]
};

/// The ranges that are accepted.
constexpr double youngest = 20, oldest = 95;       // [years]
constexpr double shortest = 1350, tallest = 2150;  // [mm]
constexpr double lightest = 35, heaviest = 200;    // [kg]

struct Patient {
    std::optional<Sex> sex;  // none: halfway between a woman and a man, with seed 0
    double age = 65;         // [years]
    double height = 1695;    // [mm]
    double weight = 74.7;    // [kg]

    double surface() const;    // of the body, by Mosteller's formula (N Engl J Med 1987;317:1098) [m²]
    std::string text() const;  // "woman of 71 years, 163 cm, 68 kg"
};

/// Numbers from a seed, the same on every machine. Each is found by the name of the quantity alone, so that a
/// vessel more or less changes no other vessel, and neighbouring seeds have nothing in common. With seed 0
/// every number is 0: the mean.
class Draws {
public:
    explicit Draws(std::uint64_t seed) : seed_(seed) {}
    bool varied() const { return seed_ != 0; }
    /// Of mean 0 and standard deviation 1, never beyond ±2.6; another `attempt` gives another number.
    double normal(std::string_view quantity, std::uint64_t attempt = 0) const;
    bool coin(std::string_view quantity) const;

private:
    std::uint64_t seed_;
};

/// Patients of a catheter laboratory: 65 ± 11 years, women and men equally often (estimates; their body mass
/// index of 26 ± 4 kg/m² too), 163 ± 6.5 and 176 ± 7 cm tall (means of ICRP publication 89, 2002; spreads
/// estimated).
Patient drawn_patient(const Draws&, const PatientWish& = {});

/// How a diameter depends on the patient.
struct Trend {
    double women = 1;         // their mean over that of men of their own size of body
    bool of_men = false;      // the published mean and spread are those of men, else of both sexes
    double yearly = 0;        // relative growth with age [1/year]
    double by_surface = 0.3;  // power of the body's surface over the mean of the patient's sex (estimate,
                              // but for the aorta; the sexes' own difference is in `women`)
};

/// A diameter of the patient over the published mean.
double diameter_factor(const Trend&, const Patient&);
/// The part of a diameter's relative spread among drawn patients that sex, age and size make.
double explained_deviation(const Trend&);

/// A length of the patient over the published mean, which goes with a power of height.
double length_factor(double by_height, const Patient&);

}  // namespace anatomy
