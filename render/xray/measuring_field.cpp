#include "render/xray/measuring_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace render {
namespace {

/// 0 below 0, 1 above 1, smooth between.
template <class Number>
Number smooth_step(Number t) {
    const Number within = std::clamp(t, Number(0), Number(1));
    return within * within * (Number(3) - Number(2) * within);
}

}  // namespace

MeasuringField::MeasuringField(const Field& disc, const Field& thickness) : disc_(disc), patient_(disc) {
    assert(disc.values.size() == thickness.values.size());
    double length = 0.0, square = 0.0, covered = 0.0;
    for (std::size_t i = 0; i < disc.values.size(); ++i) {
        const float t = thickness.values[i];
        patient_.values[i] *= smooth_step((t - nothing) / (body - nothing));
        const double weighed = static_cast<double>(patient_.values[i]) * std::max(t, 0.0f);
        disc_sum_ += disc_.values[i];
        covered += patient_.values[i];
        length += weighed;
        square += weighed * t;
    }
    if (!(length > 0.0 && disc_sum_ > 0.0)) return;
    const auto mean = static_cast<float>(square / length);
    for (std::size_t i = 0; i < disc.values.size(); ++i) {
        patient_.values[i] *= smooth_step((thickness.values[i] / mean - thin) / (thick - thin));
        patient_sum_ += patient_.values[i];
    }
    patient_alone_ = smooth_step(covered / disc_sum_ / enough);
}

double MeasuringField::mean(std::span<const float> signal) const {
    assert(signal.size() == disc_.values.size());
    if (!(disc_sum_ > 0.0)) return 0.0;
    double all = 0.0, patient = 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i) {
        all += static_cast<double>(disc_.values[i]) * signal[i];
        patient += static_cast<double>(patient_.values[i]) * signal[i];
    }
    all /= disc_sum_;
    if (!(all > 0.0) || !(patient_sum_ > 0.0) || !(patient > 0.0)) return all;
    return all * std::exp(patient_alone_ * std::log(patient / patient_sum_ / all));
}

Field MeasuringField::weights() const {
    Field result = disc_;
    const auto share = static_cast<float>(patient_alone_);
    for (std::size_t i = 0; i < result.values.size(); ++i)
        result.values[i] += share * (patient_.values[i] - disc_.values[i]);
    return result;
}

}  // namespace render
