#pragma once
/// Ground truth of an image, for training and testing trackers: where the wire, its tip and the vessels are.

#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/monitor.h"
#include "engine/exercise/simulation.h"

namespace exercise {

/// What to make besides masks.
struct TruthParts {
    bool signal = false;    // of the detector, with its noise
    bool expected = false;  // the same without noise
    bool labels = false;    // of vessels
    bool lengths = false;   // of rays in each layer of the patient
    bool any() const { return signal || expected || labels || lengths; }
};

struct Truth {
    Pulse pulse;                             // the pulse that the image shows
    std::vector<render::GrayImage> devices;  // of each of the pulse's: 255 where it casts its shadow, else 0
    render::GrayImage vessels;               // 255 where a lumen lies in the beam, else 0
    double dose = 0;                         // of the pulse at the detector [nGy]
    std::optional<render::Field> signal = {}, expected = {};  // [quanta]
    std::optional<render::DeepImage> labels =
        {};                                  // the branch that the ray runs through longest, from 1; 0 = none
    std::vector<std::string> branches = {};  // names, that of label k at k − 1; with labels
    std::vector<render::Fluoroscope::LayerLength> lengths = {};
};

/// Of the monitor's last pulse, which must exist.
Truth truth_of(Monitor&, const Simulation&, const TruthParts& = {});

}  // namespace exercise
