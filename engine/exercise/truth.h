#pragma once
/// Ground truth of an image, for training and testing trackers: where the wire, its tip and the vessels are.

#include "engine/exercise/monitor.h"

namespace exercise {

struct Truth {
    Pulse pulse;                                // the pulse that the image shows
    render::GrayImage wire;                     // 255 where the wire casts its shadow, else 0
    std::optional<render::GrayImage> catheter;  // the same; none in an exercise without
    render::GrayImage vessels;                  // 255 where a lumen lies in the beam, else 0
};

Truth truth_of(const Pulse&, render::Fluoroscope&, bool has_catheter = false);

}  // namespace exercise
