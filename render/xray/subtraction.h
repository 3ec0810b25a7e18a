#pragma once
/// Images from the difference between two pulses: DSA and roadmap.

#include <cstddef>
#include <span>

#include "render/picture/image.h"

namespace render {

struct SubtractionSpec {
    /// Share of the signal's mean around each pixel that is taken to be scatter and removed before the
    /// logarithm: left in, it makes vessels behind bone pale. It is less than the real share, as noise would
    /// otherwise be divided by nothing.
    double scatter = 0.31;
    double scatter_reach = 0.08;  // standard deviation of that mean, in image widths [-]
    double dsa_gain = 160.0;      // grey levels per e-fold of signal
    double dsa_background = 205;  // grey where nothing has changed
    double map_blur = 0.8;        // standard deviation before the peak is taken, against noise [pixels]
    double roadmap_gain = 230.0;  // of changes since the mask, that is the wire, in grey levels per e-fold
    double roadmap_background = 100;
    double map_brightness = 115;  // added to it by the densest vessels
    double map_density = 1.6;     // how soon vessels reach that [1/e-fold]
};

/// Keeps a mask and the vessels that contrast has shown since. Anything that moved after the mask was taken
/// shows twice: dark where it is, bright where it was.
class Subtraction {
public:
    /// `mask`: detector signal per unit of dose, `open`: transmission of the collimator. Equal sizes.
    Subtraction(Field mask, Field open, const SubtractionSpec& = {});
    /// An object without a mask, to be restored into.
    Subtraction() = default;
    void state(geometry::StateStream& s) {
        s(scatter_, log_mask_, open_, map_);
        if (s.restores()) vessels_ = {};
    }

    /// −ln of `signal` (per unit of dose, like the mask) over the mask: vessels with contrast are dark.
    GrayImage subtracted(const Field& signal) const;

    /// Adds a pulse to the map, which keeps the most opaque value of each pixel (peak opacification).
    void opacify(const Field& signal);
    bool has_map() const { return !map_.values.empty(); }

    /// The map, bright, behind changes since the mask, dark. Throws std::logic_error without a map.
    GrayImage roadmap(const Field& signal);

private:
    // Fields are processed in pieces that stay in the cache; `start`: the first pixel of a piece.
    void log_of(std::span<const float> signal, std::size_t start, std::span<float> log) const;
    /// Calls use(start, differences): ln(mask) − ln(signal), positive where less signal arrives than before.
    template <class Use>
    void for_differences(const Field& signal, const Use&) const;
    /// The image of grey(pixel, difference), behind the collimator.
    template <class Grey>
    GrayImage framed(const Field& signal, const Grey&) const;
    const Field& vessels();

    SubtractionSpec spec_;
    Field scatter_;  // of the mask, in the mask's unit
    Field log_mask_, open_, map_;
    Field vessels_;  // grey that the map adds; empty until requested
};

}  // namespace render
