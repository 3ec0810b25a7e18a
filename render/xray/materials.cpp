#include "render/xray/materials.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>

namespace render {
namespace {

/// One row of a table: photon energy [keV] and mass attenuation μ/ρ [cm²/g]. An absorption edge has two rows.
struct TableRow {
    double energy;
    double mass_attenuation;
};

// All tables: J. H. Hubbell and S. M. Seltzer, Tables of X-Ray Mass Attenuation Coefficients, NIST Standard
// Reference Database 126 (2004), table 3 (elements) and table 4 (compounds; tissues after ICRU-44), rows from
// 15 to 150 keV. They were read from the copy of those tables in the data folder of the open-source package
// roentgen (ehsteve/roentgen, roentgen/data), not from NIST's own pages. The row of CsI between its two edges
// is left out: in that copy it rises without an edge. The source of each density is given next to it below.

constexpr TableRow air[] = {{15, 1.614},  {20, 0.7779}, {30, 0.3538},  {40, 0.2485}, {50, 0.2080},
                            {60, 0.1875}, {80, 0.1662}, {100, 0.1541}, {150, 0.1356}};
constexpr TableRow lung[] = {{15, 1.721},  {20, 0.8316}, {30, 0.3815},  {40, 0.2699}, {50, 0.2270},
                             {60, 0.2053}, {80, 0.1826}, {100, 0.1695}, {150, 0.1493}};
constexpr TableRow adipose[] = {{15, 1.083},  {20, 0.5677}, {30, 0.3063},  {40, 0.2396}, {50, 0.2123},
                                {60, 0.1974}, {80, 0.1800}, {100, 0.1688}, {150, 0.1500}};
constexpr TableRow soft_tissue[] = {{15, 1.699},  {20, 0.8230}, {30, 0.3790},  {40, 0.2688}, {50, 0.2264},
                                    {60, 0.2048}, {80, 0.1823}, {100, 0.1693}, {150, 0.1492}};
constexpr TableRow blood[] = {{15, 1.744},  {20, 0.8428}, {30, 0.3852},  {40, 0.2715}, {50, 0.2278},
                              {60, 0.2057}, {80, 0.1827}, {100, 0.1695}, {150, 0.1492}};
constexpr TableRow cortical_bone[] = {{15, 9.032},  {20, 4.001},  {30, 1.331},   {40, 0.6655}, {50, 0.4242},
                                      {60, 0.3148}, {80, 0.2229}, {100, 0.1855}, {150, 0.1480}};
constexpr TableRow iodine[] = {{15, 55.12},    {20, 25.43},  {30, 8.561},  {33.17, 6.553},
                               {33.17, 35.82}, {40, 22.10},  {50, 12.32},  {60, 7.579},
                               {80, 3.510},    {100, 1.942}, {150, 0.6978}};
constexpr TableRow caesium_iodide[] = {
    {15, 58.15}, {20, 26.86}, {30, 9.045}, {33.17, 6.923}, {33.17, 21.22}, {35.98, 17.19}, {35.98, 30.27},
    {40, 22.97}, {50, 12.87}, {60, 7.921}, {80, 3.677},    {100, 2.035},   {150, 0.7290}};
constexpr TableRow aluminium[] = {{15, 7.955},  {20, 3.441},  {30, 1.128},   {40, 0.5685}, {50, 0.3681},
                                  {60, 0.2778}, {80, 0.2018}, {100, 0.1704}, {150, 0.1378}};
constexpr TableRow titanium[] = {{15, 35.87},  {20, 15.85},  {30, 4.972},   {40, 2.214},  {50, 1.213},
                                 {60, 0.7661}, {80, 0.4052}, {100, 0.2721}, {150, 0.1649}};
constexpr TableRow chromium[] = {{15, 45.71},  {20, 20.38},  {30, 6.434},   {40, 2.856},  {50, 1.550},
                                 {60, 0.9639}, {80, 0.4905}, {100, 0.3166}, {150, 0.1788}};
constexpr TableRow iron[] = {{15, 57.08}, {20, 25.68},  {30, 8.176},   {40, 3.629},  {50, 1.958},
                             {60, 1.205}, {80, 0.5952}, {100, 0.3717}, {150, 0.1964}};
constexpr TableRow nickel[] = {{15, 70.81}, {20, 32.20},  {30, 10.34},   {40, 4.600},  {50, 2.474},
                               {60, 1.512}, {80, 0.7306}, {100, 0.4440}, {150, 0.2208}};
constexpr TableRow copper[] = {{15, 74.05}, {20, 33.79},  {30, 10.92},   {40, 4.862},  {50, 2.613},
                               {60, 1.593}, {80, 0.7630}, {100, 0.4584}, {150, 0.2217}};
constexpr TableRow barium[] = {{15, 63.47},    {20, 29.38},  {30, 9.904},  {37.44, 5.498},
                               {37.44, 29.19}, {40, 24.57},  {50, 13.79},  {60, 8.511},
                               {80, 3.963},    {100, 2.196}, {150, 0.7828}};
constexpr TableRow tungsten[] = {{15, 138.9}, {20, 65.73},  {30, 22.73},    {40, 10.67},
                                 {50, 5.949}, {60, 3.713},  {69.53, 2.552}, {69.53, 11.23},
                                 {80, 7.810}, {100, 4.438}, {150, 1.581}};
constexpr TableRow nylon[] = {{15, 0.9545}, {20, 0.5132}, {30, 0.2890},  {40, 0.2312}, {50, 0.2071},
                              {60, 0.1936}, {80, 0.1774}, {100, 0.1666}, {150, 0.1482}};
constexpr TableRow platinum[] = {{15, 157.8}, {20, 75.74},  {30, 26.41},    {40, 12.45},
                                 {50, 6.954}, {60, 4.339},  {78.39, 2.203}, {78.39, 9.301},
                                 {80, 8.731}, {100, 4.993}, {150, 1.795}};

// μen/ρ of dry air, same database, table 4.
constexpr TableRow air_absorption[] = {{15, 1.334},   {20, 0.5389},   {30, 0.1537},
                                       {40, 0.06833}, {50, 0.04098},  {60, 0.03041},
                                       {80, 0.02407}, {100, 0.02325}, {150, 0.02496}};

constexpr double scintillator = 0.45;  // caesium iodide [mm]

/// Straight lines between rows in log–log, as the tables are meant to be interpolated.
double mass_attenuation(std::span<const TableRow> table, double energy) {
    const auto above = std::upper_bound(table.begin(), table.end(), energy,
                                        [](double e, const TableRow& row) { return e < row.energy; });
    if (above == table.begin()) return table.front().mass_attenuation;
    if (above == table.end()) return table.back().mass_attenuation;
    const TableRow& low = *std::prev(above);
    const double t = std::log(energy / low.energy) / std::log(above->energy / low.energy);
    return low.mass_attenuation * std::pow(above->mass_attenuation / low.mass_attenuation, t);
}

}  // namespace

std::string_view name_of(Material material) {
    constexpr std::string_view names[] = {
        "air",           "lung",           "adipose",          "soft tissue",   "blood",    "trabecular bone",
        "cortical bone", "iodine",         "nitinol",          "steel",         "platinum", "aluminium",
        "copper",        "caesium iodide", "tungsten polymer", "barium polymer"};
    static_assert(std::size(names) == material_count);
    return names[static_cast<int>(material)];
}

double attenuation(Material material, double energy) {
    assert(energy > 0.0);
    // Density [g/cm³] times μ/ρ [cm²/g] is [1/cm]; a tenth of it [1/mm].
    const auto linear = [energy](std::span<const TableRow> table, double density) {
        return 0.1 * density * mass_attenuation(table, energy);
    };
    switch (material) {
        case Material::Air:
            return linear(air, 0.001205);  // NIST table 2
        case Material::Lung:
            return linear(lung, 0.26);  // ICRU-46, inflated
        case Material::Adipose:
            return linear(adipose, 0.95);  // NIST table 2, as the next three
        case Material::SoftTissue:
            return linear(soft_tissue, 1.06);
        case Material::Blood:
            return linear(blood, 1.06);
        case Material::CorticalBone:
            return linear(cortical_bone, 1.92);
        case Material::TrabecularBone:
            // A fifth of cortical bone by volume, the rest marrow taken as soft tissue (1.23 g/cm³; ICRU-46
            // gives 1.18 for spongiosa).
            return 0.2 * linear(cortical_bone, 1.92) + 0.8 * linear(soft_tissue, 1.06);
        case Material::Iodine:
            return linear(iodine, 0.001);  // 1 mg/ml
        case Material::Nitinol:
            // 55.8 % Ni, 44.2 % Ti by mass, 6.45 g/cm³ (ASTM F2063).
            return 0.558 * linear(nickel, 6.45) + 0.442 * linear(titanium, 6.45);
        case Material::Steel:
            // AISI 304: 19 % Cr, 9 % Ni, the rest taken as Fe, 7.93 g/cm³ (ASTM A240).
            return 0.72 * linear(iron, 7.93) + 0.19 * linear(chromium, 7.93) + 0.09 * linear(nickel, 7.93);
        case Material::Platinum:
            return linear(platinum, 21.45);  // NIST table 1, as the next two
        case Material::Aluminium:
            return linear(aluminium, 2.699);
        case Material::Copper:
            return linear(copper, 8.96);
        case Material::CaesiumIodide:
            return linear(caesium_iodide, 4.51);
        case Material::TungstenPolymer:
            // Estimate: jackets are said to be filled with tungsten, not how much. 1/(0.6/1.1 + 0.4/19.3).
            return 0.6 * linear(nylon, 1.766) + 0.4 * linear(tungsten, 1.766);
        case Material::BariumPolymer:
            // 20 to 40 % are usual. Barium is 58.8 % of its sulphate; sulphur and oxygen are taken as nylon.
            // 1/(0.7/1.1 + 0.3/4.5).
            return 0.824 * linear(nylon, 1.423) + 0.176 * linear(barium, 1.423);
    }
    assert(false);
    return 0.0;
}

double scattering(Material material) {
    constexpr double energy = 150.0;
    return attenuation(material, energy) / attenuation(Material::SoftTissue, energy);
}

double air_energy_absorption(double energy) {
    return mass_attenuation(air_absorption, energy);
}

/// Fraction of the arriving energy that the scintillator absorbs [-].
static double absorbed_fraction(double energy) {
    return 1.0 - std::exp(-attenuation(Material::CaesiumIodide, energy) * scintillator);
}

double kerma_per_signal(double energy) {
    return air_energy_absorption(energy) / absorbed_fraction(energy);
}

Spectrum detected_spectrum(double kvp) {
    if (!(kvp >= 40.0 && kvp <= 125.0)) {
        throw std::invalid_argument("a tube voltage of " + std::to_string(kvp) + " kV is outside 40 to 125");
    }
    constexpr double aluminium_mm = 2.5, copper_mm = 0.2;
    Spectrum spectrum;
    double sum = 0.0;
    for (double energy = 20.25; energy < kvp; energy += 0.5) {
        const double photons = (kvp - energy) / energy *
                               std::exp(-attenuation(Material::Aluminium, energy) * aluminium_mm -
                                        attenuation(Material::Copper, energy) * copper_mm);
        spectrum.energies.push_back(energy);
        spectrum.weights.push_back(photons * energy * absorbed_fraction(energy));
        sum += spectrum.weights.back();
    }
    for (double& weight : spectrum.weights) weight /= sum;
    return spectrum;
}

Bins EnergyBins::attenuation(Material material) const {
    Bins result;
    for (int k = 0; k < energy_bins; ++k) result[k] = render::attenuation(material, energies[k]);
    return result;
}

EnergyBins fit_bins(const Spectrum& spectrum) {
    constexpr double reference_tissue = 210.0;  // [mm]
    const Eigen::Map<const Eigen::ArrayXd> energies(spectrum.energies.data(), std::ssize(spectrum.energies));
    const Eigen::Map<const Eigen::ArrayXd> open(spectrum.weights.data(), std::ssize(spectrum.weights));
    const auto tissue = [](double energy) {
        return std::exp(-attenuation(Material::SoftTissue, energy) * reference_tissue);
    };
    Eigen::ArrayXd weights = open * energies.unaryExpr(tissue);
    const double mass = weights.sum();
    weights /= mass;

    // Stieltjes: recurrence p_{k+1} = (E − α_k) p_k − β_k p_{k−1} of the polynomials orthogonal under the
    // weights; then Golub and Welsch (1969): nodes are the eigenvalues of the tridiagonal matrix, weights the
    // squared first components of its eigenvectors.
    Eigen::Matrix<double, energy_bins, 1> diagonal;
    Eigen::Matrix<double, energy_bins - 1, 1> beside;
    Eigen::ArrayXd before = Eigen::ArrayXd::Zero(energies.size()), p = Eigen::ArrayXd::Ones(energies.size());
    double norm_before = 1.0, norm = 1.0, beta = 0.0;
    for (int k = 0; k < energy_bins; ++k) {
        diagonal[k] = (weights * p * p * energies).sum() / norm;
        if (k + 1 == energy_bins) break;
        const Eigen::ArrayXd next = (energies - diagonal[k]) * p - beta * before;
        before = p;
        p = next;
        norm_before = norm;
        norm = (weights * p * p).sum();
        beta = norm / norm_before;
        beside[k] = std::sqrt(beta);
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, energy_bins, energy_bins>> solver;
    solver.computeFromTridiagonal(diagonal, beside);
    EnergyBins bins;
    for (int k = 0; k < energy_bins; ++k) {
        const double first = solver.eigenvectors()(0, k);
        bins.energies[k] = solver.eigenvalues()[k];
        bins.weights[k] = mass * first * first / tissue(bins.energies[k]);
    }
    return bins;
}

}  // namespace render
