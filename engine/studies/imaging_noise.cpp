#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <functional>
#include <numbers>
#include <utility>

#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "render/xray/detector.h"

namespace studies {
namespace {

using render::Field;
using std::numbers::pi;

io::Table variance_table(bool quick) {
    io::Table table{"imaging_noise", {"mean_quanta", "variance_over_mean", "mean_error_percent", "pixels"}};
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

/// Mean periodogram along the rows, relative to white noise of `variance`, at k / spectrum_length of the
/// sampling frequency. Von Hann's window keeps strong low frequencies from leaking into weak high ones.
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

/// Square of the transfer function of a Gaussian spread sampled by square pixels, with aliased frequencies
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

io::Table spectrum_table(bool quick) {
    io::Table table{"imaging_noise_spectrum",
                    {"what", "pixel_mm", "frequency_per_mm", "measured", "expected", "deviation_percent",
                     "deviation_percent_of_zero"}};
    constexpr int side = 512, group = 4;  // neighbouring frequencies averaged
    constexpr double quanta = 54;
    const int frames = quick ? 2 : 24;
    const auto add = [&](const std::string& what, double pixel, double sigma,
                         const std::vector<double>& power) {
        // Along a row all frequencies across it contribute at once.
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

/// For each case: in per cent of the expected power where that is a tenth of the power at frequency 0 or
/// more, and everywhere in per cent of the power at 0.
io::Table largest_deviations(const io::Table& spectrum) {
    io::Table table{"imaging_noise_spectrum_largest",
                    {"what", "pixel_mm", "largest_deviation_percent", "largest_percent_of_zero"}};
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

}  // namespace

StudyResult imaging_noise(const StudyOptions& options) {
    io::Table variance = variance_table(options.quick), spectrum = spectrum_table(options.quick);
    io::Table deviations = largest_deviations(spectrum);
    StudyResult result;
    result.page = filled_text("imaging_noise", {{"variance", io::to_markdown(variance, 5)},
                                                {"deviations", io::to_markdown(deviations)}});
    result.tables = {std::move(variance), std::move(spectrum), std::move(deviations)};
    result.plots = {filled_plot("imaging_noise_spectrum", 1100, 460, {})};
    return result;
}

}  // namespace studies
