#pragma once
/// Runs that are kept to be looked at again: as a loop, frame by frame, with another mask.

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/monitor.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace room {

/// One image of a run, and of DSA what the detector gave.
struct KeptImage {
    exercise::FrameTime time;
    std::shared_ptr<const render::GrayImage> shown;
    std::shared_ptr<const render::Field> signal;  // per nGy; null but in DSA
};

/// The images from a pedal's pressing to its release.
struct Sequence {
    int number = 0;  // of the exercise, from 1
    script::ImagingMode mode = script::ImagingMode::Live;
    render::CArm arm;
    double pulse_rate = 15;                        // [1/s]
    std::shared_ptr<const render::Field> opening;  // transmission of the collimator; null but in DSA
    std::vector<KeptImage> images;
};

/// Keeps the last runs. A run that is being taken is a copy-on-write: who holds a list of runs sees them as
/// they were.
class Sequences {
public:
    /// `most_signals`: images of DSA kept in all, `most_images` of fluoroscopy in a run, the oldest go first.
    explicit Sequences(std::size_t most_signals = 240, std::size_t most_images = 450)
        : most_signals_(most_signals), most_images_(most_images) {}

    /// After each frame, with the image shown then.
    void observe(const exercise::Frame&, exercise::Monitor&,
                 const std::shared_ptr<const render::GrayImage>& shown);
    std::vector<std::shared_ptr<const Sequence>> runs() const { return {runs_.begin(), runs_.end()}; }

private:
    void limit();

    std::size_t most_signals_, most_images_;
    std::deque<std::shared_ptr<const Sequence>> runs_;
    bool beam_on_ = false;
    int taken_ = 0;
};

/// How an image of a run is looked at.
struct Look {
    std::size_t image = 0, mask = 0;
    double shift_x = 0, shift_y = 0;   // of the mask, to the right and down [pixels]
    double window = 256, level = 128;  // grey levels spread over black to white, and their middle
};

/// The image under that look: of DSA subtracted anew, the mask moved by its shift, interpolated; of
/// fluoroscopy as it was shown. Throws std::out_of_range for an image or mask that is not there.
render::GrayImage look_at(const Sequence&, const Look&);

/// `field` moved by so many pixels to the right and down; what comes in from outside is the edge.
render::Field shifted(const render::Field&, double x, double y);

/// A ruler on the image [pixels].
struct Ruler {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    double pixels() const;
};
/// Width of the dark band that the ruler crosses, at half its depth; empty where there is none [pixels].
std::optional<double> band_width(const render::GrayImage&, const Ruler&);

}  // namespace room
