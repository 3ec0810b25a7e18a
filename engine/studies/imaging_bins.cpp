#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "render/xray/materials.h"

namespace studies {
namespace {

using render::EnergyBins;
using render::Material;
using render::Spectrum;

/// A few energies that represent a spectrum.
struct Stand {
    std::vector<double> energies, weights;
};

double through(const std::vector<double>& energies, const std::vector<double>& weights,
               const std::function<double(double)>& depth) {
    double sum = 0;
    for (std::size_t i = 0; i < energies.size(); ++i) sum += weights[i] * std::exp(-depth(energies[i]));
    return sum;
}

/// `count` energies, each the mean of an equal fraction of the signal that 210 mm of soft tissue leave.
Stand equal_signal(const Spectrum& spectrum, int count) {
    const auto tissue = [](double energy) {
        return std::exp(-210 * render::attenuation(Material::SoftTissue, energy));
    };
    double total = 0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i)
        total += spectrum.weights[i] * tissue(spectrum.energies[i]);
    std::vector<double> signal(count, 0.0), energy(count, 0.0);
    int bin = 0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i) {
        double left = spectrum.weights[i] * tissue(spectrum.energies[i]);
        while (left > 0) {
            const double room = bin + 1 < count ? total / count - signal[bin] : left;
            const double taken = std::min(left, room);
            signal[bin] += taken;
            energy[bin] += taken * spectrum.energies[i];
            left -= taken;
            if (taken == room && bin + 1 < count) ++bin;
        }
    }
    Stand stand{std::vector<double>(count), std::vector<double>(count)};
    for (int k = 0; k < count; ++k) {
        stand.energies[k] = energy[k] / signal[k];
        stand.weights[k] = signal[k] / tissue(stand.energies[k]);
    }
    return stand;
}

struct Object {
    std::string_view name;
    Material material;
    double length;         // [mm]
    double concentration;  // of iodine [mg/ml], else 1
};

constexpr std::array<Object, 12> objects = {{{"10 mm bone", Material::CorticalBone, 10, 1},
                                             {"30 mm bone", Material::CorticalBone, 30, 1},
                                             {"60 mm spongiosa", Material::TrabecularBone, 60, 1},
                                             {"3 mm · 300 mg/ml", Material::Iodine, 3, 300},
                                             {"10 mm · 150 mg/ml", Material::Iodine, 10, 150},
                                             {"20 mm · 300 mg/ml", Material::Iodine, 20, 300},
                                             {"0.36 mm steel", Material::Steel, 0.36, 1},
                                             {"0.9 mm steel", Material::Steel, 0.9, 1},
                                             {"0.36 mm nitinol", Material::Nitinol, 0.36, 1},
                                             {"0.9 mm nitinol", Material::Nitinol, 0.9, 1},
                                             {"0.3 mm platinum", Material::Platinum, 0.3, 1},
                                             {"0.9 mm platinum", Material::Platinum, 0.9, 1}}};

io::Table bin_table() {
    io::Table table{
        "imaging_bins",
        {"object", "kvp", "tissue_mm", "transmission", "one_energy", "four_equal_signal", "gauss"}};
    for (const double kvp : {60.0, imaging_kvp, 90.0, 110.0}) {
        const Spectrum spectrum = render::detected_spectrum(kvp);
        const EnergyBins own = render::fit_bins(spectrum);
        const std::array<Stand, 3> stands = {
            {equal_signal(spectrum, 1),
             equal_signal(spectrum, 4),
             {{own.energies.begin(), own.energies.end()}, {own.weights.begin(), own.weights.end()}}}};
        for (const Object& object : objects) {
            for (const double tissue : {120.0, 165.0, 210.0, 255.0, 300.0}) {
                const auto before = [&](double energy) {
                    return tissue * render::attenuation(Material::SoftTissue, energy);
                };
                const auto both = [&](double energy) {
                    return before(energy) + object.concentration * object.length *
                                                render::attenuation(object.material, energy);
                };
                const double exact = through(spectrum.energies, spectrum.weights, both) /
                                     through(spectrum.energies, spectrum.weights, before);
                std::vector<io::TableCell> row = {object.name, kvp, tissue, exact};
                for (const Stand& stand : stands)
                    row.emplace_back(through(stand.energies, stand.weights, both) /
                                         through(stand.energies, stand.weights, before) -
                                     exact);
                table.add(std::move(row));
            }
        }
    }
    return table;
}

/// For each object the largest error over the thicknesses at the usual voltage; the last row covers all
/// objects.
io::Table largest_bin_errors(const io::Table& errors) {
    io::Table table{"imaging_bins_largest", {"object", "one_energy", "four_equal_signal", "gauss"}};
    std::array<double, 3> all{};
    for (const Object& object : objects) {
        std::array<double, 3> largest{};
        for (const auto& row : errors.rows) {
            if (std::get<std::string>(row[0]) != object.name || std::get<double>(row[1]) != imaging_kvp)
                continue;
            for (int k = 0; k < 3; ++k)
                largest[k] = std::max(largest[k], std::abs(std::get<double>(row[4 + k])));
        }
        for (int k = 0; k < 3; ++k) all[k] = std::max(all[k], largest[k]);
        table.add({object.name, largest[0], largest[1], largest[2]});
    }
    table.add({"all", all[0], all[1], all[2]});
    return table;
}

}  // namespace

StudyResult imaging_bins(const StudyOptions&) {
    io::Table bins = bin_table(), largest = largest_bin_errors(bins);
    StudyResult result;
    result.page = filled_text("imaging_bins", {{"largest", io::to_markdown(largest)}});
    result.tables = {std::move(bins), std::move(largest)};
    result.plots = {filled_plot("imaging_bins", 980, 480, {})};
    return result;
}

}  // namespace studies
