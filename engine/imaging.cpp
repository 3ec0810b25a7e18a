#include "engine/imaging.h"

#include <algorithm>

#include "engine/error.h"
#include "render/path_length.h"
#include "render/patient.h"

namespace engine {
namespace {

/// Height of the widest fork of a root branch, or of the middle of the vessels when nothing forks [mm].
double bifurcation(const Anatomy& anatomy) {
    const physics::CentrelineBranch* widest = nullptr;
    for (const physics::CentrelineBranch& branch : anatomy.branches) {
        const bool forks_root = branch.parent >= 0 && anatomy.branches[branch.parent].parent < 0;
        if (forks_root && (!widest || branch.radii.front() > widest->radii.front())) widest = &branch;
    }
    if (widest) return widest->points.front().z();
    double least = anatomy.branches.front().points.front().z(), most = least;
    for (const physics::Vec3& p : anatomy.branches.front().points) {
        least = std::min(least, p.z());
        most = std::max(most, p.z());
    }
    return 0.5 * (least + most);
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
