#include <array>
#include <fmt/format.h>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/blood/contrast_flow.h"
#include "engine/exercise/imaging.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "render/panel/contact_sheet.h"

namespace studies {
namespace {

struct Angles {
    const char* name;
    double lao, cranial;  // [deg]
};

struct Region {
    const char *name, *preset;
    geometry::Vec3 isocentre;  // [mm]
    double width;              // of the detector [mm]
    std::array<Angles, 3> angles;
};

/// Four regions in their usual fields, each in the projections that DOMAIN.md's workups begin with.
const std::array<Region, 4>& regions() {
    static const std::array<Region, 4> all = {
        {{"abdomen and pelvis",
          "iliac-renal",
          {0, 0, -10},
          400,
          {{{"PA", 0, 0}, {"LAO 30", 30, 0}, {"lateral", 90, 0}}}},
         {"chest", "arch-1", {0, 0, 60}, 400, {{{"PA", 0, 0}, {"LAO 40", 40, 0}, {"RAO 30", -30, 0}}}},
         {"head",
          "cerebral",
          {0, 0, 10},
          300,
          {{{"PA", 0, 0}, {"PA cranial 25", 0, 25}, {"lateral", 90, 0}}}},
         {"leg", "femoral", {70, 0, -230}, 300, {{{"PA", 0, 0}, {"RAO 30", -30, 0}, {"lateral", 90, 0}}}}}};
    return all;
}

render::CArm arm_at(const Region& region, const Angles& angles, int pixels) {
    render::CArm arm;
    arm.isocentre = region.isocentre;
    arm.detector_width = region.width;
    arm.lao = angles.lao * geometry::degree;
    arm.cranial = angles.cranial * geometry::degree;
    arm.pixels = pixels;
    return arm;
}

}  // namespace

StudyResult run_views(const StudyOptions& options) {
    const int pixels = options.quick ? 64 : 512;
    std::vector<render::GrayImage> images;
    std::vector<std::string> labels;
    io::Table table{"views", {"region", "view", "triangles", "tube_kV", "air_kerma_mGy"}};
    Work work(options, static_cast<int>(regions().size()));
    for (const Region& region : regions()) {
        scenario::Scenario scenario;
        const anatomy::Anatomy anatomy =
            anatomy::generated_anatomy(anatomy::vessel_preset(region.preset), options.cache);
        const blood::ContrastFlow flow(anatomy);
        exercise::ImagingChain imaging = exercise::make_imaging(scenario, anatomy, flow, options.cache);
        double triangles = 0;
        for (const render::TissueLayer& layer : exercise::tissue_layers(scenario, anatomy))
            triangles += static_cast<double>(layer.mesh.triangles.size());
        render::Exposure exposure;
        exposure.seed = options.seed;
        exposure.detector_dose = scenario.imaging.acquisition_dose;
        for (const Angles& angles : region.angles) {
            const render::CArm arm = arm_at(region, angles, pixels);
            images.push_back(imaging.fluoroscope.expose(arm, {}, exposure));
            labels.push_back(fmt::format("{}, {}", region.name, angles.name));
            const render::Technique technique = imaging.fluoroscope.technique(arm, exposure);
            table.add({region.name, angles.name, triangles, technique.kvp, technique.air_kerma});
        }
        work.tell(region.name);
    }
    StudyResult result;
    result.page = filled_text("views", {{"quick", options.quick ? " --quick" : ""},
                                        {"dose", scenario::Scenario{}.imaging.acquisition_dose},
                                        {"table", io::to_markdown(table, 3)}});
    result.pictures = {{"views",
                        "The procedural patient from three sides a region, at the dose of an acquisition.",
                        render::contact_sheet(images, 3, pixels, labels)}};
    result.tables = {std::move(table)};
    return result;
}

}  // namespace studies
