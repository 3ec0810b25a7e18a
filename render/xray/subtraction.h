#pragma once
/// Images of the difference between two pulses: DSA and roadmap.

#include <cstddef>
#include <span>

#include "render/picture/image.h"

namespace render {

struct SubtractionSpec {
    /// Share of the signal's mean about each pixel that is taken for scatter and removed before the
    /// logarithm: left in, it pales vessels behind bone. Less than there is, or noise would be divided by
    /// nothing.
    double scatter = 0.31;
    double scatter_reach = 0.08;  // standard deviation of that mean, in image widths [-]
    double dsa_gain = 160.0;      // grey levels per e-fold of signal
    double dsa_background = 205;  // grey where nothing changed
    double map_blur = 0.8;        // standard deviation before the peak is taken, against noise [pixels]
    double roadmap_gain = 230.0;  // of what changed since the mask: the wire, in grey levels per e-fold
    double roadmap_background = 100;
    double map_brightness = 115;  // that the densest vessels add to it
    double map_density = 1.6;     // how soon they reach it [1/e-fold]
};

/// Keeps a mask and the vessels that contrast has shown since. What moved after the mask was taken shows
/// twice: dark where it is, bright where it was.
class Subtraction {
public:
    /// `mask`: detector signal per unit of dose, `open`: transmission of the collimator. Equal sizes.
    Subtraction(Field mask, Field open, const SubtractionSpec& = {});
    /// Without a mask, to be restored.
    Subtraction() = default;
    void state(geometry::StateStream& s) {
        s(scatter_, log_mask_, open_, map_);
        if (s.restores()) vessels_ = {};
    }

    /// −ln of `signal`, per unit of dose as the mask, over the mask: vessels with contrast are dark.
    GrayImage subtracted(const Field& signal) const;

    /// Takes a pulse into the map: of each pixel the most opaque that it has been (peak opacification).
    void opacify(const Field& signal);
    bool has_map() const { return !map_.values.empty(); }

    /// The map, bright, behind what has changed since the mask, dark. Throws std::logic_error without a map.
    GrayImage roadmap(const Field& signal);

private:
    // Fields pass in pieces that stay in the cache; `start`: the first pixel of one.
    void log_of(std::span<const float> signal, std::size_t start, std::span<float> log) const;
    /// Calls use(start, differences): ln(mask) − ln(signal), positive where less arrives than did.
    template <class Use>
    void for_differences(const Field& signal, const Use&) const;
    /// Of grey(pixel, difference), behind the collimator.
    template <class Grey>
    GrayImage framed(const Field& signal, const Grey&) const;
    const Field& vessels();

    SubtractionSpec spec_;
    Field scatter_;  // of the mask, in its unit
    Field log_mask_, open_, map_;
    Field vessels_;  // grey that the map adds; empty until it is asked for
};

}  // namespace render
