#pragma once
/// Runs kept for review: as a loop, frame by frame, with another mask.

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/monitor.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace room {

/// One image of a run and, in DSA, the detector's signal.
struct KeptImage {
    exercise::FrameTime time;
    std::shared_ptr<const render::GrayImage> shown;
    std::shared_ptr<const render::Field> signal;  // per nGy; null but in DSA
};

/// The images from the pressing of a pedal to its release.
struct Sequence {
    int number = 0;  // of the exercise, from 1
    script::ImagingMode mode = script::ImagingMode::Live;
    render::CArm arm;
    double pulse_rate = 15;                        // [1/s]
    std::shared_ptr<const render::Field> opening;  // transmission of the collimator; null but in DSA
    std::shared_ptr<const render::Field> scatter;  // estimated in the first image; null but in DSA
    std::vector<KeptImage> images;
};

/// Keeps the last runs. The run being recorded is copied on write, so that a list of runs, once taken, stays
/// as it was.
class Sequences {
public:
    /// `most_images`: of fluoroscopy in a run, and of acquisitions in all runs, where one of DSA, with its
    /// signal, counts for `images_of_dsa`; the oldest go first.
    explicit Sequences(std::size_t most_images = 450, std::size_t most_acquired = 1200)
        : most_images_(most_images), most_acquired_(most_acquired) {}
    static constexpr std::size_t images_of_dsa = 5;  // by their bytes

    /// To be called after each frame, with the image then shown.
    void observe(const exercise::Frame&, exercise::Monitor&,
                 const std::shared_ptr<const render::GrayImage>& shown);
    std::vector<std::shared_ptr<const Sequence>> runs() const { return {runs_.begin(), runs_.end()}; }

private:
    void limit();

    std::size_t most_images_, most_acquired_;
    std::deque<std::shared_ptr<const Sequence>> runs_;
    bool beam_on_ = false;
    int taken_ = 0;
};

/// How an image of a run is displayed.
struct Look {
    std::size_t image = 0, mask = 0;
    double shift_x = 0, shift_y = 0;   // of the mask, to the right and down [pixels]
    double window = 256, level = 128;  // range of grey levels spread from black to white, and its middle
};

/// The image displayed that way: DSA is subtracted anew, with the mask moved by its shift and interpolated;
/// fluoroscopy is as it was shown. Throws std::out_of_range for an image or mask that does not exist.
render::GrayImage look_at(const Sequence&, const Look&);

/// Where the image is that was on the screen in a frame: before all runs, the first one.
struct Moment {
    std::shared_ptr<const Sequence> run;  // null where there is none
    std::size_t image = 0;
};
Moment moment_of(const std::vector<std::shared_ptr<const Sequence>>&, int frame);

/// A ruler on the image [pixels].
struct Ruler {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    double pixels() const;
};
/// Width [pixels] of the dark band that the ruler crosses, at half its depth; empty where there is no band.
std::optional<double> band_width(const render::GrayImage&, const Ruler&);

/// By which pixels become millimetres: at the isocentre, unless the ruler was laid across the wire.
struct Scale {
    std::optional<double> calibrated = {};  // [mm per pixel]
    std::string found = {};                 // what the last calibration found
    /// By the wire's diameter [mm], where the ruler crosses its shadow.
    void calibrate(const render::GrayImage&, const Ruler&, double diameter);

    double mm_per_pixel(const Sequence&) const;
    /// "12.34 mm  (45.6 pixels)".
    std::string length(const Sequence&, const Ruler&) const;
    /// "at the isocentre: 0.3995 mm a pixel".
    std::string text(const Sequence&) const;
};

}  // namespace room
