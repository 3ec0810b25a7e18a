#include "engine/exercise/smoothness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace exercise {
namespace {

constexpr double highest_frequency = 10;  // [Hz]
constexpr double least_amplitude = 0.05;  // of the greatest amplitude
constexpr std::size_t padding = 16, most_frames = std::size_t{1} << 18;

}  // namespace

std::optional<double> spectral_arc_length(std::span<const double> speed, double rate) {
    if (speed.size() < 2 || speed.size() > most_frames) return {};
    const std::size_t length = padding * std::bit_ceil(speed.size());
    std::vector<double> padded(length, 0.0);
    std::copy(speed.begin(), speed.end(), padded.begin());
    std::vector<std::complex<double>> spectrum;
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    fft.fwd(spectrum, padded);

    std::vector<double> fraction(spectrum.size());
    for (std::size_t k = 0; k < fraction.size(); ++k) fraction[k] = std::abs(spectrum[k]);
    const double greatest = *std::max_element(fraction.begin(), fraction.end());
    if (!(greatest > 0)) return {};
    for (double& value : fraction) value /= greatest;
    const double step = rate / static_cast<double>(length);
    const auto within = static_cast<std::size_t>(highest_frequency / step);
    if (fraction.size() > within + 1) fraction.resize(within + 1);
    const auto counts = [](double value) { return value >= least_amplitude; };
    const auto first = std::find_if(fraction.begin(), fraction.end(), counts);
    const auto last = std::find_if(fraction.rbegin(), fraction.rend(), counts).base();  // one past it
    if (last - first < 2) return 0.0;
    const double band = 1.0 / static_cast<double>(last - first - 1);
    double arc = 0;
    for (auto it = first + 1; it != last; ++it) arc += std::hypot(band, *it - *(it - 1));
    return -arc;
}

std::optional<double> log_dimensionless_jerk(std::span<const double> speed, double rate) {
    if (speed.size() < 3) return {};
    const double peak = *std::max_element(speed.begin(), speed.end());
    double sum = 0;  // ∫ (d²v/dt²)² dt
    for (std::size_t i = 1; i + 1 < speed.size(); ++i) {
        const double second = (speed[i + 1] - 2 * speed[i] + speed[i - 1]) * rate * rate;
        sum += second * second / rate;
    }
    if (!(peak > 0) || !(sum > 0)) return {};
    const double duration = static_cast<double>(speed.size()) / rate;
    return -std::log(duration * duration * duration / (peak * peak) * sum);
}

}  // namespace exercise
