#pragma once
/// What a trainee should know about a run, as sentences: stops of the wire, and shortcomings of the
/// simulation.

#include <string>
#include <vector>

#include "engine/exercise/frame.h"

namespace exercise {

/// "The mask was shifted by 1.30 pixels to the right and 0.40 down", or why it was not.
std::string mask_shift_sentence(const MaskShift&);

class Notices {
public:
    /// To be called once after each frame.
    void observe(const Frame&);
    /// A sentence for each kind of event that happened, with the number of frames.
    std::vector<std::string> text() const;

private:
    int stopped_withdrawals_ = 0, past_ends_ = 0, used_up_ = 0, kinked_ = 0, restless_ = 0, crossed_ = 0;
    int settling_ = 0, refused_ = 0, buckled_ = 0, late_ = 0, flat_ = 0;
    int too_thick_ = 0, limited_doses_ = 0;
    /// Beam on a tip that it does not show.
    struct Unseen {
        int frames = 0, episodes = 0, first = 0;
        std::string remedy;  // what would have shown it then
        bool now = false;
    };
    void watch_tip(const Frame&);
    Unseen unseen_;
    bool beam_was_on_ = false,
         wire_was_out_ = false;  // at the first frame with beam nothing was in the image
    std::vector<std::string> injuries_, denied_;
    int more_injuries_ = 0;
    std::vector<std::string> changes_;
    int more_changes_ = 0;
    std::vector<std::string> mask_shifts_;  // of those that were found, or not made
    int more_mask_shifts_ = 0;
    int gasps_ = 0;
    double deepest_crossing_ = 0, most_waiting_ = 0;  // [mm]
};

}  // namespace exercise
