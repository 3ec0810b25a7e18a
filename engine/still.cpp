#include "engine/still.h"

#include <fmt/format.h>

#include "engine/headless.h"
#include "engine/imaging.h"
#include "engine/monitor.h"
#include "engine/text.h"
#include "render/png.h"

namespace engine {

render::GrayImage render_still(const Scenario& scenario, const CommandScript& script,
                               const StillRequest& request, const ModelCache& cache) {
    check(scenario, script);
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
    if (const auto wrong = render::problems(pulse.arm); !wrong.empty()) throw InputError(joined(wrong, "; "));
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

void write_still(const std::filesystem::path& path, const render::GrayImage& image) {
    try {
        render::write_png(path, image);
    } catch (const std::runtime_error& error) {
        throw InputError(error.what());
    }
}

}  // namespace engine
