#pragma once
/// The materials in the beam, and the beam's spectrum.

#include <array>
#include <string_view>
#include <vector>

namespace render {

enum class Material {
    Air,
    Lung,
    Adipose,
    SoftTissue,
    Blood,
    TrabecularBone,
    CorticalBone,
    Iodine,  // dissolved, per mg/ml: multiply by the concentration
    Nitinol,
    Steel,
    Platinum,
    Aluminium,
    Copper,
    CaesiumIodide,
    TungstenPolymer,  // polyurethane with 40 % tungsten by mass, as the jackets of hydrophilic wires
    BariumPolymer     // polyamide with 30 % barium sulphate by mass, as the walls of catheters
};
inline constexpr int material_count = 16;

std::string_view name_of(Material);

/// Highest concentration of iodine in any injected medium [mg/ml].
inline constexpr double largest_iodine = 400;
/// Highest flow of a power injector [ml/s].
inline constexpr double largest_flow = 40;

/// Linear attenuation μ [1/mm] ([1/mm per mg/ml] for iodine) at a photon energy [keV], 15 to 150.
double attenuation(Material, double energy);

/// Scattering per length, that of soft tissue being 1 [-]: μ at 150 keV, where tissues and bone hardly do
/// anything but scatter.
double scattering(Material);

/// Mass energy-absorption coefficient of dry air [cm²/g] at a photon energy [keV], 15 to 150. It converts
/// energy fluence to air kerma.
double air_energy_absorption(double energy);

/// An X-ray spectrum as the detector counts it: energies [keV] and the fraction of signal from each.
struct Spectrum {
    std::vector<double> energies;
    std::vector<double> weights;  // their sum is 1 with nothing in the beam
};

/// Tungsten target at `kvp` [kV], behind 2.5 mm Al and 0.2 mm Cu, seen by 0.45 mm of CsI that integrates
/// energy. The shape is Kramers' rule, photons ∝ (kvp − E)/E; characteristic lines begin at 69.5 keV and are
/// left out. Throws std::invalid_argument unless 40 ≤ kvp ≤ 125.
Spectrum detected_spectrum(double kvp);

/// Air kerma per detected signal at a photon energy [keV]; only its ratios are meaningful.
double kerma_per_signal(double energy);

constexpr int energy_bins = 4;
using Bins = std::array<double, energy_bins>;

/// A few energies that represent a spectrum in Beer–Lambert sums.
struct EnergyBins {
    Bins energies{};  // [keV]
    Bins weights{};   // signal with nothing in the beam

    Bins attenuation(Material) const;  // [1/mm]
};

/// Gauss quadrature of the spectrum behind 210 mm of soft tissue, where contrast matters: exact there for
/// polynomials up to degree 7 in the energy.
EnergyBins fit_bins(const Spectrum&);

}  // namespace render
