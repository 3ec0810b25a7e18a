#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <functional>
#include <numbers>

#include "engine/studies/imaging.h"
#include "render/detector.h"
#include "render/materials.h"
#include "render/wire_image.h"

namespace engine {
namespace {

using physics::Polyline;
using physics::Vec3;
using render::Bins;
using render::CArm;
using render::EnergyBins;
using render::Field;
using render::Material;
using render::Spectrum;

constexpr double pi = std::numbers::pi;
constexpr double usual_kvp = 74;

// ---- the wire ----

/// A curve in all three directions with bends down to a radius of some 10 mm [mm].
Vec3 curve(double s) {
    return {12 * std::sin(s / 13), 14 * std::cos(s / 17) + 3 * std::sin(s / 12), s - 30};
}

/// `count` points of the curve, `step` of arc apart [mm].
Polyline points_along(int count, double step) {
    constexpr double fine = 1e-3;
    Polyline points{curve(0)};
    Vec3 last = points.front();
    double since = 0;
    for (int k = 1; std::ssize(points) < count; ++k) {
        const Vec3 next = curve(k * fine);
        since += (next - last).norm();
        last = next;
        if (since < step) continue;
        since -= step;
        points.push_back(next);
    }
    return points;
}

/// The wire's shadow by brute force: short cylinders, each cut where its neighbours begin.
class SweptCylinder {
public:
    SweptCylinder(Polyline points, double radius) : points_(std::move(points)), radius_(radius) {
        for (std::size_t i = 0; i < points_.size(); ++i)
            tangents_.push_back(
                (points_[std::min(i + 1, points_.size() - 1)] - points_[i > 0 ? i - 1 : 0]).normalized());
    }

    double chord(const Vec3& origin, const Vec3& ray) const {
        double inside = 0;
        for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
            const Vec3 from = points_[i] - origin, to = points_[i + 1] - origin;
            const double length = (to - from).norm();
            if (from.cross(ray).squaredNorm() > std::pow(2 * radius_ + length, 2)) continue;
            const Vec3 axis = (to - from) / length;
            const double along = ray.dot(axis), offset = from.dot(axis), a = 1 - along * along;
            const double b = from.dot(ray) - offset * along;
            const double c = from.squaredNorm() - offset * offset - radius_ * radius_;
            if (b * b <= a * c) continue;
            double enter = (b - std::sqrt(b * b - a * c)) / a, leave = (b + std::sqrt(b * b - a * c)) / a;
            keep(ray.dot(tangents_[i]), from.dot(tangents_[i]), enter, leave);
            keep(-ray.dot(tangents_[i + 1]), -to.dot(tangents_[i + 1]), enter, leave);
            inside += std::max(0.0, leave - enter);
        }
        return inside;
    }

    const Polyline& points() const { return points_; }

private:
    /// What of the way has t·rate ≥ level.
    static void keep(double rate, double level, double& enter, double& leave) {
        if (rate > 0) enter = std::max(enter, level / rate);
        if (rate < 0) leave = std::min(leave, level / rate);
    }

    Polyline points_, tangents_;
    double radius_;
};

/// Chords at 8 × 8 places of each pixel near the wire.
struct Supersampled {
    static constexpr int places = 8;
    std::vector<std::uint32_t> pixels;
    std::vector<std::array<float, places * places>> chords;
};

Supersampled supersample(const CArm& arm, const SweptCylinder& wire) {
    Supersampled result;
    std::vector<bool> near(static_cast<std::size_t>(arm.pixels) * arm.pixels);
    for (const Vec3& point : wire.points()) {
        const render::Pixel at = render::project(arm, point);
        for (int y = static_cast<int>(at.y) - 4; y <= static_cast<int>(at.y) + 4; ++y)
            for (int x = static_cast<int>(at.x) - 4; x <= static_cast<int>(at.x) + 4; ++x)
                if (x >= 0 && y >= 0 && x < arm.pixels && y < arm.pixels)
                    near[static_cast<std::size_t>(y) * arm.pixels + x] = true;
    }
    constexpr int n = Supersampled::places;
    const Vec3 origin = render::source(arm);
    for (std::uint32_t pixel = 0; pixel < near.size(); ++pixel) {
        if (!near[pixel]) continue;
        const int x = static_cast<int>(pixel) % arm.pixels, y = static_cast<int>(pixel) / arm.pixels;
        result.pixels.push_back(pixel);
        auto& chords = result.chords.emplace_back();
        for (int k = 0; k < n * n; ++k) {
            const Vec3 ray = render::ray_direction(arm, x + (k % n + 0.5) / n, y + (k / n + 0.5) / n);
            chords[k] = static_cast<float>(wire.chord(origin, ray));
        }
    }
    return result;
}

/// Weights of the bins in the signal that 210 mm of soft tissue leave, of sum 1.
Bins behind_tissue(const EnergyBins& bins) {
    Bins weights = bins.weights;
    const Bins tissue = bins.attenuation(Material::soft_tissue);
    double sum = 0;
    for (int k = 0; k < render::energy_bins; ++k) sum += weights[k] *= std::exp(-210 * tissue[k]);
    for (double& weight : weights) weight /= sum;
    return weights;
}

struct WireError {
    double square = 0, largest = 0, own = 0, mass = 0;
    int pixels = 0;

    void add(double got, double exact) {
        own += 1 - got;
        mass += 1 - exact;
        if (1 - std::min(got, exact) < 1e-9) return;  // beside the wire
        square += (got - exact) * (got - exact);
        largest = std::max(largest, std::abs(got - exact));
        ++pixels;
    }
    double rms() const { return std::sqrt(square / pixels); }
};

Table wire_table(bool quick) {
    Table table{"imaging_wire",
                {"wire", "pixel_mm", "quanta", "mu_per_mm", "pixels", "rms", "largest", "mass_error_percent"},
                {}};
    const int length = quick ? 40 : 120;  // [mm]
    const Polyline joints = points_along(length + 1, 1.0);
    render::WireLook look;
    look.marker_length = 0;
    const SweptCylinder truth(points_along(10 * length + 1, 0.1), 0.5 * look.diameter);
    const EnergyBins bins = render::fit_bins(render::detected_spectrum(usual_kvp));
    const Bins weights = behind_tissue(bins);
    for (const int pixels : {256, 512}) {
        CArm arm;
        arm.pixels = pixels;
        arm.detector_width = 150;
        arm.lao = 0.4;
        const Supersampled exact = supersample(arm, truth);
        for (const Material material : {Material::steel, Material::nitinol, Material::platinum}) {
            look.body = material;
            const Bins mu = bins.attenuation(material);
            render::WireImage image;
            std::vector<std::array<float, render::energy_bins>> shown(
                static_cast<std::size_t>(pixels) * pixels, {1, 1, 1, 1});
            for (const render::WirePixel& pixel : image.cast(arm, joints, look, {mu, mu}))
                shown[pixel.index] = pixel.transmission;
            std::array<WireError, render::energy_bins> each;
            WireError signal;
            for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
                double got = 0, transmitted = 0;
                for (int k = 0; k < render::energy_bins; ++k) {
                    double transmission = 0;
                    for (const float chord : exact.chords[i])
                        transmission +=
                            std::exp(-mu[k] * chord) / static_cast<double>(exact.chords[i].size());
                    each[k].add(shown[exact.pixels[i]][k], transmission);
                    got += weights[k] * shown[exact.pixels[i]][k];
                    transmitted += weights[k] * transmission;
                }
                signal.add(got, transmitted);
            }
            const auto add = [&](const std::string& quanta, double attenuation, const WireError& error) {
                table.add({std::string(render::name_of(material)), render::pixel_width(arm), quanta,
                           attenuation, static_cast<double>(error.pixels), error.rms(), error.largest,
                           100 * (error.own / error.mass - 1)});
            };
            add("behind 210 mm", std::nan(""), signal);
            for (int k = 0; k < render::energy_bins; ++k)
                add(fmt::format("{:.0f} keV", bins.energies[k]), mu[k], each[k]);
        }
    }
    return table;
}

// ---- energy bins ----

/// A few energies that stand for a spectrum.
struct Stand {
    std::vector<double> energies, weights;
};

double through(const std::vector<double>& energies, const std::vector<double>& weights,
               const std::function<double(double)>& depth) {
    double sum = 0;
    for (std::size_t i = 0; i < energies.size(); ++i) sum += weights[i] * std::exp(-depth(energies[i]));
    return sum;
}

/// `count` energies, each the mean of an equal share of the signal that 210 mm of soft tissue leave.
Stand equal_signal(const Spectrum& spectrum, int count) {
    const auto tissue = [](double energy) {
        return std::exp(-210 * render::attenuation(Material::soft_tissue, energy));
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

constexpr std::array<Object, 12> objects = {{{"10 mm bone", Material::cortical_bone, 10, 1},
                                             {"30 mm bone", Material::cortical_bone, 30, 1},
                                             {"60 mm spongiosa", Material::trabecular_bone, 60, 1},
                                             {"3 mm · 300 mg/ml", Material::iodine, 3, 300},
                                             {"10 mm · 150 mg/ml", Material::iodine, 10, 150},
                                             {"20 mm · 300 mg/ml", Material::iodine, 20, 300},
                                             {"0.36 mm steel", Material::steel, 0.36, 1},
                                             {"0.9 mm steel", Material::steel, 0.9, 1},
                                             {"0.36 mm nitinol", Material::nitinol, 0.36, 1},
                                             {"0.9 mm nitinol", Material::nitinol, 0.9, 1},
                                             {"0.3 mm platinum", Material::platinum, 0.3, 1},
                                             {"0.9 mm platinum", Material::platinum, 0.9, 1}}};

Table bin_table() {
    Table table{"imaging_bins",
                {"object", "kvp", "tissue_mm", "transmission", "one_energy", "four_equal_signal", "gauss"},
                {}};
    for (const double kvp : {60.0, usual_kvp, 90.0, 110.0}) {
        const Spectrum spectrum = render::detected_spectrum(kvp);
        const EnergyBins own = render::fit_bins(spectrum);
        const std::array<Stand, 3> stands = {
            {equal_signal(spectrum, 1),
             equal_signal(spectrum, 4),
             {{own.energies.begin(), own.energies.end()}, {own.weights.begin(), own.weights.end()}}}};
        for (const Object& object : objects) {
            for (const double tissue : {120.0, 165.0, 210.0, 255.0, 300.0}) {
                const auto before = [&](double energy) {
                    return tissue * render::attenuation(Material::soft_tissue, energy);
                };
                const auto both = [&](double energy) {
                    return before(energy) + object.concentration * object.length *
                                                render::attenuation(object.material, energy);
                };
                const double exact = through(spectrum.energies, spectrum.weights, both) /
                                     through(spectrum.energies, spectrum.weights, before);
                std::vector<TableCell> row = {std::string(object.name), kvp, tissue, exact};
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

/// Per object the largest error over the thicknesses at the usual voltage; the last row is of all.
Table largest_bin_errors(const Table& errors) {
    Table table{"imaging_bins_largest", {"object", "one_energy", "four_equal_signal", "gauss"}, {}};
    std::array<double, 3> all{};
    for (const Object& object : objects) {
        std::array<double, 3> largest{};
        for (const auto& row : errors.rows) {
            if (std::get<std::string>(row[0]) != object.name || std::get<double>(row[1]) != usual_kvp)
                continue;
            for (int k = 0; k < 3; ++k)
                largest[k] = std::max(largest[k], std::abs(std::get<double>(row[4 + k])));
        }
        for (int k = 0; k < 3; ++k) all[k] = std::max(all[k], largest[k]);
        table.add({std::string(object.name), largest[0], largest[1], largest[2]});
    }
    table.add({std::string("all"), all[0], all[1], all[2]});
    return table;
}

// ---- noise ----

Table variance_table(bool quick) {
    Table table{"imaging_noise", {"mean_quanta", "variance_over_mean", "mean_error_percent", "pixels"}, {}};
    const int side = 640, frames = quick ? 1 : 8;
    for (const double mean : {1.0, 2.0, 5.0, 9.0, 16.0, 24.5, 25.5, 54.0, 220.0, 900.0, 5000.0}) {
        double sum = 0, square = 0;
        for (int frame = 0; frame < frames; ++frame) {
            const Field counted = render::read_out(Field(side, side, static_cast<float>(mean)), 0.29,
                                                   {0.0, 0.0}, 11, static_cast<std::uint64_t>(frame));
            for (const float value : counted.values) {
                sum += value - mean;
                square += (value - mean) * (value - mean);
            }
        }
        const double count = static_cast<double>(side) * side * frames, offset = sum / count;
        table.add({mean, (square / count - offset * offset) / mean, 100 * offset / mean, count});
    }
    return table;
}

constexpr int spectrum_length = 128;  // of the pieces of a row that are transformed

/// Mean periodogram along the rows, over that of white noise of `variance`, at k / spectrum_length of the
/// sampling frequency. Von Hann's window keeps the strong low frequencies out of the weak high ones.
std::vector<double> row_spectrum(const std::function<Field(int frame)>& frame_of, int frames, double mean,
                                 double variance) {
    constexpr int n = spectrum_length;
    std::array<std::complex<double>, n> turn;
    std::array<double, n> window;
    double weight = 0;
    for (int i = 0; i < n; ++i) {
        turn[i] = std::polar(1.0, -2 * pi * i / n);
        window[i] = 0.5 - 0.5 * std::cos(2 * pi * (i + 0.5) / n);
        weight += window[i] * window[i];
    }
    std::vector<double> power(n / 2 + 1, 0.0);
    double pieces = 0;
    for (int frame = 0; frame < frames; ++frame) {
        const Field field = frame_of(frame);
        for (std::size_t start = 0; start + n <= field.values.size(); start += n, ++pieces) {
            for (int k = 0; k <= n / 2; ++k) {
                std::complex<double> sum = 0;
                for (int i = 0; i < n; ++i)
                    sum += window[i] * (field.values[start + i] - mean) * turn[i * k % n];
                power[k] += std::norm(sum);
            }
        }
    }
    for (double& value : power) value /= pieces * weight * variance;
    return power;
}

/// Square of the transfer of a Gaussian spread caught by square pixels, frequencies beyond the sampling's
/// folded in; `sigma` [pixels], `frequency` [1/pixel].
double squared_mtf(double frequency, double sigma) {
    if (sigma == 0) return 1;
    double sum = 0;
    for (int fold = -4; fold <= 4; ++fold) {
        const double f = frequency + fold, x = pi * f;
        sum += std::exp(-2 * pi * pi * sigma * sigma * f * f) * (std::abs(x) < 1e-9 ? 1 : std::sin(x) / x);
    }
    return sum * sum;
}

Table spectrum_table(bool quick) {
    Table table{"imaging_noise_spectrum",
                {"what", "pixel_mm", "frequency_per_mm", "measured", "expected", "deviation_percent",
                 "deviation_percent_of_zero"},
                {}};
    constexpr int side = 512, group = 4;  // neighbouring frequencies told as one
    constexpr double quanta = 54;
    const int frames = quick ? 2 : 24;
    const auto add = [&](const std::string& what, double pixel, double sigma,
                         const std::vector<double>& power) {
        // Along a row all frequencies across it are seen at once.
        double across = 0;
        for (int k = 0; k < 512; ++k) across += squared_mtf((k + 0.5) / 512 - 0.5, sigma) / 512;
        for (std::size_t k = 2; k + group <= power.size(); k += group) {
            double measured = 0, expected = 0, frequency = 0;
            for (std::size_t i = k; i < k + group; ++i) {
                const double f = static_cast<double>(i) / spectrum_length;
                measured += power[i] / group;
                expected += across * squared_mtf(f, sigma) / group;
                frequency += f / pixel / group;
            }
            table.add({what, pixel, frequency, measured / across, expected / across,
                       100 * (measured / expected - 1), 100 * (measured - expected) / across});
        }
    };
    for (const double pixel : {0.586, 0.293, 0.15}) {
        const double sigma = render::DetectorSpec{}.scintillator_blur / pixel;
        add("quanta", pixel, sigma,
            row_spectrum(
                [&](int frame) {
                    return render::read_out(Field(side, side, quanta), pixel,
                                            {render::DetectorSpec{}.scintillator_blur, 0}, 5,
                                            static_cast<std::uint64_t>(frame));
                },
                frames, quanta, quanta));
    }
    constexpr double electronic = 3;
    add("electronic", 0.293, 0,
        row_spectrum(
            [&](int frame) {
                return render::read_out(Field(side, side, 0.0f), 0.293, {0.18, electronic}, 5,
                                        static_cast<std::uint64_t>(frame));
            },
            frames, 0, electronic * electronic));
    return table;
}

/// Of each case: in per cent of what is expected where that is a tenth of the power at frequency 0 or more,
/// and everywhere of the latter.
Table largest_deviations(const Table& spectrum) {
    Table table{"imaging_noise_spectrum_largest",
                {"what", "pixel_mm", "largest_deviation_percent", "largest_percent_of_zero"},
                {}};
    for (std::size_t i = 0; i < spectrum.rows.size();) {
        const auto& first = spectrum.rows[i];
        double largest = 0, of_zero = 0;
        for (; i < spectrum.rows.size() && spectrum.rows[i][0] == first[0] && spectrum.rows[i][1] == first[1];
             ++i) {
            const auto number = [&](int k) { return std::get<double>(spectrum.rows[i][k]); };
            if (number(4) >= 0.1) largest = std::max(largest, std::abs(number(5)));
            of_zero = std::max(of_zero, std::abs(number(6)));
        }
        table.add({first[0], first[1], largest, of_zero});
    }
    return table;
}

// ---- pictures ----

Plot bin_picture() {
    Plot plot{"imaging_bins", "", 980, 480};
    plot.commands =
        "set logscale y\nset yrange [1e-5:0.2]\nset grid y\nset style data histogram\n"
        "set style histogram cluster gap 1\nset style fill solid noborder\nset xtics rotate by -30\n"
        "set key top left horizontal\nset ylabel 'largest error of transmission at 74 kV'\n"
        "plot 'imaging_bins_largest.csv' skip 1 using 2:xtic(1) title 'one energy' linecolor '#999999', \\\n"
        "     '' skip 1 using 3 title 'four of equal signal' linecolor '#E69F00', \\\n"
        "     '' skip 1 using 4 title 'four Gauss nodes' linecolor '#0072B2', \\\n"
        "     0.005 with lines linecolor 'black' dashtype 2 title 'figure to reach'\n";
    return plot;
}

Plot noise_picture() {
    Plot plot{"imaging_noise_spectrum", "", 1100, 460};
    plot.commands =
        "set multiplot layout 1,2\nset grid\nset title 'Noise power over that at frequency 0'\n"
        "set xlabel 'frequency [1/mm]'\nset yrange [0:1.3]\nset key top right\nplot ";
    const std::array<std::array<const char*, 4>, 4> series = {
        {{"quanta", "0.586", "#0072B2", "pixel 0.586 mm"},
         {"quanta", "0.293", "#D55E00", "0.293 mm"},
         {"quanta", "0.15", "#009E73", "0.15 mm"},
         {"electronic", "0.293", "#999999", "electronic, 0.293 mm"}}};
    for (const auto& [what, pixel, colour, title] : series)
        plot.commands += fmt::format(
            "'imaging_noise_spectrum.csv' skip 1 using 3:(strcol(1) eq '{}' && $2 == {} ? $4 : 1/0) with "
            "points "
            "pointtype 7 pointsize 0.6 linecolor '{}' title '{}', \\\n '' skip 1 using 3:(strcol(1) eq '{}' "
            "&& "
            "$2 == {} ? $5 : 1/0) with lines linecolor '{}' notitle{}",
            what, pixel, colour, title, what, pixel, colour,
            std::string_view(what) == "electronic" ? "\n" : ", \\\n ");
    plot.commands +=
        "set title 'Variance over that of a Poisson count'\nset xlabel 'mean quanta'\nset logscale x\n"
        "set xrange [0.7:7000]\nset yrange [0.98:1.02]\nunset key\nplot 'imaging_noise.csv' skip 1 using "
        "1:2:(2*sqrt((2+1/$1)/$4)) with yerrorbars pointtype 7 linecolor '#0072B2', 1.01 with lines "
        "linecolor "
        "'#999999' dashtype 2, 0.99 with lines linecolor '#999999' dashtype 2\nunset multiplot\n";
    return plot;
}

}  // namespace

StudyResult imaging_signal(const StudyOptions& options) {
    Table wire = wire_table(options.quick), bins = bin_table(), largest = largest_bin_errors(bins);
    Table variance = variance_table(options.quick), spectrum = spectrum_table(options.quick);
    Table deviations = largest_deviations(spectrum);
    StudyResult result;
    result.page =
        "\n## Wire\n\nTransmission of a bent wire of 0.89 mm, solid, at the energies of the bins, against 8 "
        "× 8 "
        "rays a pixel through the curve that its joints, 1 mm apart, lie on. Behind 210 mm: of the signal "
        "that so much soft tissue leaves at 74 kV; below, at the energies of its bins. Mass is the sum of 1 "
        "− "
        "transmission.\n\n" +
        to_markdown(wire) +
        "\n## Energy bins\n\nError of an object's transmission behind 120 to 300 mm of soft tissue against "
        "the "
        "full spectrum at 74 kV, the largest over the thicknesses. Signal is what tissue of 210 mm "
        "leaves.\n\n![Errors of the bins](imaging_bins.svg)\n\n" +
        to_markdown(largest) +
        "\n## Noise\n\n![Noise power spectra and variance](imaging_noise_spectrum.svg)\n\nCounts of single "
        "pixels before the scintillator; bars in the picture are two standard errors.\n\n" +
        to_markdown(variance, 5) +
        "\nPower along the rows of flat frames against the squared transfer of the scintillator's Gaussian "
        "(0.18 mm) caught by square pixels; the electronic noise is white. The largest deviation in per cent "
        "of what "
        "is expected, where that is a tenth of the power at frequency 0 or more, and everywhere of the "
        "latter.\n\n" +
        to_markdown(deviations);
    result.tables = {std::move(wire),     std::move(bins),     std::move(largest),
                     std::move(variance), std::move(spectrum), std::move(deviations)};
    result.plots = {bin_picture(), noise_picture()};
    return result;
}

}  // namespace engine
