#include "engine/still.h"

#include <fmt/format.h>

#include "engine/headless.h"
#include "engine/imaging.h"
#include "engine/monitor.h"
#include "engine/picture_file.h"
#include "engine/text.h"

namespace engine {

render::GrayImage render_still(const Scenario& scenario, const CommandScript& script,
                               const StillRequest& request, const ModelCache& cache) {
    check(scenario, script);
    render::CArm arm = scenario.c_arm;
    arm.lao = request.lao.value_or(arm.lao);
    arm.cranial = request.cranial.value_or(arm.cranial);
    if (const auto wrong = render::problems(arm); !wrong.empty()) throw InputError(joined(wrong, "; "));
    if (script.end && request.frame > *script.end) {
        throw InputError(fmt::format("frame {} was asked for; the script ends at {}: 0 to {} are accepted",
                                     request.frame, *script.end, *script.end));
    }
    Simulation simulation(scenario, cache);
    if (const auto wrong = simulation.problems(script); !wrong.empty()) throw InputError(joined(wrong, "\n"));
    auto next = script.commands.begin();
    for (int frame = 0; frame <= request.frame; ++frame) {
        for (; next != script.commands.end() && next->frame == frame; ++next) simulation.apply(next->command);
        simulation.step();
    }
    ImagingChain imaging = make_imaging(simulation.scenario(), simulation.anatomy(), simulation.contrast());
    Pulse pulse = pulse_of(simulation, imaging.organs);
    pulse.arm.lao = request.lao.value_or(pulse.arm.lao);
    pulse.arm.cranial = request.cranial.value_or(pulse.arm.cranial);
    pulse.mode = ImagingMode::live;
    pulse.exposure.detector_dose = detector_dose(scenario, pulse.arm, pulse.mode);

    Monitor monitor(std::move(imaging.fluoroscope));
    if (request.mode != ImagingMode::live) {
        Pulse mask = pulse;
        mask.mode = ImagingMode::dsa;
        mask.exposure.detector_dose = detector_dose(scenario, mask.arm, mask.mode);
        const bool flows = has_contrast(mask.exposure);
        if (request.mode == ImagingMode::roadmap) mask.joints.clear();
        Pulse filled = mask;
        remove_contrast(mask.exposure);
        if (!flows) filled.exposure.iodine = request.iodine;
        ++filled.exposure.frame;  // another noise
        monitor.take(mask);
        monitor.take(filled);
    }
    if (request.mode != ImagingMode::dsa) {
        pulse.mode = request.mode;
        if (request.mode == ImagingMode::roadmap) remove_contrast(pulse.exposure);
        monitor.take(pulse);
    }
    return *monitor.image();
}

void check_still(const std::filesystem::path& path) {
    if (path.extension() != ".png") throw InputError(path.string() + ": a picture named .png is accepted");
    std::error_code ignored;
    if (!path.parent_path().empty() && !std::filesystem::is_directory(path.parent_path(), ignored))
        throw InputError(fmt::format("{}: cannot be written: there is no folder {}", path.string(),
                                     path.parent_path().string()));
}

void write_still(const std::filesystem::path& path, const render::GrayImage& image) {
    write_picture(path, image);
}

}  // namespace engine
