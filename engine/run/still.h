#pragma once
/// One image of a scenario, from any side.

#include <optional>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "render/picture/image.h"

namespace run {

struct StillRequest {
    int frame = 0;                                 // of the script; commands up to it are carried out
    std::optional<double> lao = {}, cranial = {};  // by default as the script left the arm [rad]
    script::ImagingMode mode = script::ImagingMode::Live;
    double iodine = 60;  // DSA and roadmap: fills the vessels when they hold no contrast [mg/ml]
};

/// DSA subtracts the same view without contrast; a roadmap lays the vessels with contrast, taken before the
/// wire was there, under the wire. Throws InputError for a scenario, script or angles that can't be followed.
render::GrayImage render_still(const scenario::Scenario&, const script::CommandScript&, const StillRequest&,
                               const anatomy::ModelCache& = {});

/// To be called before any work: throws InputError unless the picture is named .png and can be written.
void check_still(const std::filesystem::path&);

}  // namespace run
