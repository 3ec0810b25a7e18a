#include "engine/imaging.h"

#include <algorithm>
#include <limits>

#include "engine/error.h"
#include "render/path_length.h"
#include "render/patient.h"

namespace engine {
namespace {

/// Height of the aortic bifurcation: where the widest branch that leads downward leaves a root branch; well
/// below the vessels when none does, as in a chest [mm].
double bifurcation(const Anatomy& anatomy) {
    const physics::CentrelineBranch* widest = nullptr;
    double lowest = std::numeric_limits<double>::infinity();
    for (const physics::CentrelineBranch& branch : anatomy.branches) {
        for (const physics::Vec3& p : branch.points) lowest = std::min(lowest, p.z());
        const bool forks_root = branch.parent >= 0 && anatomy.branches[branch.parent].parent < 0;
        const bool downward = branch.points.back().z() < branch.points.front().z() - 100;
        if (forks_root && downward && (!widest || branch.radii.front() > widest->radii.front()))
            widest = &branch;
    }
    constexpr double below_chest = 150;  // from the end of a thoracic aorta to L4 [mm]
    return widest ? widest->points.front().z() : lowest - below_chest;
}

}  // namespace

std::vector<render::TissueLayer> tissue_layers(const Scenario& scenario, const Anatomy& anatomy) {
    std::vector<render::TissueLayer> layers;
    if (scenario.imaging.patient) {
        layers = render::make_patient(render::patient_around(anatomy.lumen.vertices, bifurcation(anatomy)));
    }
    render::TissueLayer lumen;
    lumen.name = "lumen";
    lumen.material = render::Material::soft_tissue;
    lumen.inside = scenario.imaging.patient ? render::Material::soft_tissue : render::Material::air;
    lumen.mesh = closed_lumen(anatomy);
    lumen.takes_contrast = true;
    layers.push_back(std::move(lumen));
    return layers;
}

Pulse pulse_of(const Simulation& simulation) {
    const Scenario& scenario = simulation.scenario();
    const Imaging& imaging = scenario.imaging;
    Pulse pulse;
    pulse.arm = simulation.console().arm();
    pulse.joints = simulation.wire().joints;
    pulse.mode = simulation.console().mode();
    render::Exposure& exposure = pulse.exposure;
    exposure.frame = static_cast<std::uint64_t>(simulation.frames() - 1);
    exposure.seed = scenario.seed;
    exposure.detector_dose =
        pulse.mode == ImagingMode::dsa ? imaging.acquisition_dose : imaging.detector_dose;
    exposure.kvp = imaging.kvp;
    exposure.iodine = simulation.iodine();
    exposure.vessel_shift = simulation.vessel_shift();
    return pulse;
}

bool has_contrast(const render::Exposure& exposure) {
    return exposure.iodine > 0;
}

void remove_contrast(render::Exposure& exposure) {
    exposure.iodine = 0;
    exposure.organs.clear();
}

render::Fluoroscope make_fluoroscope(const Scenario& scenario, const Anatomy& anatomy) {
    render::FluoroscopeConfig config;
    config.wire.diameter = scenario.guidewire.diameter;
    config.wire.marker_length = std::min(config.wire.marker_length, scenario.guidewire.tip_length);
    try {
        return render::Fluoroscope(config, tissue_layers(scenario, anatomy));
    } catch (const render::OpenMeshError& error) {
        throw InputError(anatomy.name + ": a closed mesh is needed for imaging: " + error.what());
    }
}

}  // namespace engine
