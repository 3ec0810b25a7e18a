#pragma once
/// Images from the difference between two pulses: DSA and roadmap.

#include <cstddef>
#include <span>

#include "physics/geometry/state.h"
#include "render/picture/image.h"
#include "render/xray/registration.h"

namespace render {

struct SubtractionSpec {
    /// Fraction of the estimated scatter that is removed before the logarithm: left in, it makes vessels
    /// behind bone pale. Not all, as an estimate above the truth would exaggerate them instead.
    double scatter = 0.95;
    double dsa_gain = 160.0;      // grey levels per e-fold of signal
    double dsa_background = 205;  // grey where nothing has changed
    /// Fraction of the way from the background to black or white that is linear; beyond, grey approaches them
    /// without reaching them, so that dense contrast keeps its shades.
    double linear = 0.5;
    double map_blur = 0.8;        // standard deviation before the peak is taken, against noise [pixels]
    double map_fraction = 0.5;    // of the newest pulse in the mean whose peak is taken, against noise [-]
    double roadmap_gain = 230.0;  // of changes since the mask, that is the wire, in grey levels per e-fold
    double roadmap_background = 100;
    double map_brightness = 115;  // added to it by the densest vessels
    double map_density = 1.6;     // how soon vessels reach that [1/e-fold]
};

/// Keeps a mask and the vessels that contrast has shown since. Anything that moved after the mask was taken
/// shows twice: dark where it is, bright where it was. The mask may be shifted to make up for that.
class Subtraction {
public:
    /// `mask`: detector signal per unit of dose, `open`: transmission of the collimator, `scatter`: estimate
    /// of the scatter in the mask, in the mask's unit. Equal sizes.
    Subtraction(Field mask, Field open, Field scatter, const SubtractionSpec& = {});
    /// Removes no scatter.
    Subtraction(Field mask, Field open, const SubtractionSpec& = {});
    /// An object without a mask, to be restored into.
    Subtraction() = default;
    void state(geometry::StateStream& s) {
        s(scatter_, log_mask_, open_, mean_, map_, shift_, map_shift_);
        if (s.restores()) make_shifted();
    }

    /// The mask's shift, to the right and down [pixels].
    struct Shift {
        double x = 0.0, y = 0.0;
        bool any() const { return x != 0.0 || y != 0.0; }
        void state(geometry::StateStream& s) { s(x, y); }
    };
    const Shift& shift() const { return shift_; }
    /// Moves the mask to this shift from where it was taken, and `with_map` the map by as much as the mask:
    /// under a roadmap both lie where the patient was, while in DSA the map already has the places of the
    /// image. Where the collimator or the edge hid the mask nothing is known: that part stays behind the
    /// collimator.
    void shift_mask(const Shift&, bool with_map);
    /// The shift that lays the mask best on a signal, where `where` is above ½, up to `reach` either way
    /// [pixels]; see registration. Whatever the shift is now.
    Registration registration_with(const Field& signal, const Field& where, double reach) const;

    /// ln(mask) − ln(signal) without scatter, positive where less arrives than before [e-folds].
    Field difference(const Field& signal) const;

    /// −ln of `signal` (per unit of dose, like the mask) over the mask: vessels with contrast are dark.
    GrayImage subtracted(const Field& signal) const;

    /// Adds a pulse to the map, which keeps the most opaque value of each pixel (peak opacification) of a
    /// running mean: the peak of single pulses would collect their noise.
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
    /// The image of grey(pixel, difference), linear around `background`, behind the collimator.
    template <class Grey>
    GrayImage framed(const Field& signal, double background, const Grey&) const;
    const Field& vessels();
    void make_shifted();
    const Field& log_mask() const { return shifted_mask_.values.empty() ? log_mask_ : shifted_mask_; }
    const Field& open() const { return shifted_open_.values.empty() ? open_ : shifted_open_; }

    SubtractionSpec spec_;
    Field scatter_;  // removed, in the mask's unit
    Field log_mask_, open_;
    Field mean_, map_;                   // of opacity [e-folds]
    Shift shift_, map_shift_;            // of the mask; of the map, from where its pulses were taken
    Field shifted_mask_, shifted_open_;  // empty without a shift
    Field vessels_;                      // grey that the map adds; empty until requested
};

}  // namespace render
