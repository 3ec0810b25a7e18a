#pragma once
/// The part of the image in which automatic exposure measures.

#include <span>

#include "render/picture/image.h"

namespace render {

/// A disc in the middle of the image, without what the collimator closes and without direct radiation: rays
/// that pass beside the patient would otherwise decide, being some hundred times as bright. Both edges are
/// soft, so that the exposure follows a moving arm without jumps. Parts that are much thinner than the rest,
/// as a neck above shoulders, are left out in the same way. Where hardly anything of the patient is in the
/// disc, the whole disc counts.
class MeasuringField {
public:
    /// Below `nothing` of soft tissue a ray counts as direct, above `body` as one through the patient [mm].
    static constexpr float nothing = 10.0f, body = 40.0f;
    /// Of the mean thickness, in which thick parts count more: below the first a part does not count, above
    /// the second it does in full [-].
    static constexpr float thin = 0.3f, thick = 0.6f;
    /// From this share of the disc on the patient alone is measured; below, both means count [-].
    static constexpr double enough = 0.25;

    /// `disc`: share of each pixel that is in the disc and open [-]; `thickness`: of what its ray passes, as
    /// soft tissue that scatters as much [mm].
    MeasuringField(const Field& disc, const Field& thickness);

    /// Mean of a signal, which must not be negative; that of patient and disc are mixed as logarithms.
    double mean(std::span<const float> signal) const;
    /// Of each pixel in the mean that a display shows in middle grey [-].
    Field weights() const;

private:
    Field disc_, patient_;  // weights of the two means [-]
    double disc_sum_ = 0.0, patient_sum_ = 0.0, patient_alone_ = 0.0;
};

}  // namespace render
