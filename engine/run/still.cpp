#include "engine/run/still.h"

#include "engine/exercise/imaging.h"
#include "engine/exercise/monitor.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"

namespace run {

render::GrayImage render_still(const scenario::Scenario& scenario, const script::CommandScript& script,
                               const StillRequest& request, const anatomy::ModelCache& cache) {
    check(scenario, script);
    render::CArm arm = scenario.c_arm;
    arm.lao = request.lao.value_or(arm.lao);
    arm.cranial = request.cranial.value_or(arm.cranial);
    if (const auto wrong = render::problems(arm); !wrong.empty())
        throw io::InputError(io::joined(wrong, "; "));
    if (script.end && request.frame > *script.end) {
        throw io::InputError("frame {} was asked for; the script ends at {}: expected 0 to {}", request.frame,
                             *script.end, *script.end);
    }
    exercise::Simulation simulation(scenario, cache, &script);
    for (int frame = 0; frame <= request.frame; ++frame) {
        for (const script::TimedCommand& timed : script.at(frame)) simulation.apply(timed.command);
        simulation.step();
    }
    exercise::ImagingChain imaging =
        exercise::make_imaging(simulation.scenario(), simulation.anatomy(), simulation.contrast(), cache);
    exercise::Pulse pulse = exercise::pulse_of(
        simulation, {request.frame, simulation.frames() - 1, simulation.time()}, imaging.organs);
    pulse.arm.lao = request.lao.value_or(pulse.arm.lao);
    pulse.arm.cranial = request.cranial.value_or(pulse.arm.cranial);
    const bool subtracts =
        request.mode == script::ImagingMode::Dsa || request.mode == script::ImagingMode::Roadmap;
    exercise::set_mode(pulse, scenario, subtracts ? script::ImagingMode::Live : request.mode);
    if (request.mode == script::ImagingMode::Cine && !exercise::has_contrast(pulse.exposure))
        pulse.exposure.iodine = request.iodine;

    exercise::Monitor monitor(std::move(imaging.fluoroscope));
    if (subtracts) {
        exercise::Pulse mask = pulse;
        exercise::set_mode(mask, scenario, script::ImagingMode::Dsa);
        const bool flows = exercise::has_contrast(mask.exposure);
        if (request.mode == script::ImagingMode::Roadmap) mask.devices.front().joints.clear();
        exercise::Pulse filled = mask;
        exercise::remove_contrast(mask);
        if (!flows) filled.exposure.iodine = request.iodine;
        ++filled.exposure.frame;  // for different noise
        monitor.take(mask);
        monitor.take(filled);
    }
    if (request.mode != script::ImagingMode::Dsa) {
        pulse.mode = request.mode;
        if (request.mode == script::ImagingMode::Roadmap) exercise::remove_contrast(pulse);
        monitor.take(pulse);
    }
    return *monitor.image();
}

void check_still(const std::filesystem::path& path) {
    if (path.extension() != ".png") throw io::InputError(path.string() + ": expected a picture named .png");
    std::error_code ignored;
    if (!path.parent_path().empty() && !std::filesystem::is_directory(path.parent_path(), ignored))
        throw io::InputError("{}: cannot be written: there is no folder {}", path.string(),
                             path.parent_path().string());
    io::require_writable(path);
}

}  // namespace run
