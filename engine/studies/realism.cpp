#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/blood/contrast_flow.h"
#include "engine/exercise/imaging.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/run/still.h"
#include "engine/scenario/scenario.h"
#include "engine/studies/forced_choice.h"
#include "engine/studies/picture_measures.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "render/panel/contact_sheet.h"
#include "render/picture/png.h"

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

/// What a file's name says of it: "hip_0.4mm.png" has pixels of 0.4 mm.
double pixel_of(const std::string& name) {
    const std::size_t end = name.rfind("mm.");
    const std::size_t start = end == std::string::npos ? end : name.find_last_not_of("0123456789.", end - 1);
    const auto given = start == std::string::npos
                           ? std::nullopt
                           : io::parse_number(std::string_view(name).substr(start + 1, end - start - 1));
    if (!given || !(*given >= 0.01 && *given <= 5))
        throw io::InputError(
            "{}: expected a name that ends in the width of a pixel, 0.01 to 5 mm, such as "
            "hip_0.4mm.png",
            name);
    return *given;
}

template <class Image>
render::Field field_of(const Image& image) {
    render::Field field(image.width, image.height);
    std::copy(image.pixels.begin(), image.pixels.end(), field.values.begin());
    return field;
}

/// Of 255, from 8 bits or 16.
render::Field grey_levels(const std::filesystem::path& file) {
    try {
        return field_of(render::read_png(file));
    } catch (const std::runtime_error&) {
    }
    try {
        render::Field grey = field_of(render::read_deep_png(file));
        for (float& value : grey.values) value *= 255.0f / 65535.0f;
        return grey;
    } catch (const std::runtime_error& error) {
        throw io::InputError(error.what());
    }
}

class Measured {
public:
    /// `shown`: grey levels of 255; `structure`: what edges and octaves are measured of.
    void add(const std::string& name, const render::Field& shown, const render::Field& structure,
             double pixel) {
        constexpr double margin = 0.08;
        constexpr int around = 15;  // [pixels]
        const render::Field inner = inner_part(shown, margin);
        const render::Field depth = depth_of_dark(inner, around);
        const Structure found = structure_of(inner_part(structure, margin), pixel);
        table.add({name, pixel, noise_of(inner), percentile(inner, 0.01), percentile(inner, 0.5),
                   percentile(inner, 0.99), percentile(depth, 0.995), found.edges[0], found.edges[1],
                   found.edges[2], found.strongest, found.evenness, found.power[1] / found.power[0],
                   found.power[2] / found.power[0], found.power[3] / found.power[0]});
    }
    io::Table table{
        "realism",
        {"picture", "pixel_mm", "noise", "p1", "p50", "p99", "dark_p99.5", "edge_p10_mm", "edge_p50_mm",
         "edge_p90_mm", "strongest", "evenness", "octave_1.6", "octave_3.2", "octave_6.4"}};
};

/// A frame of cine with the artery full of contrast.
render::GrayImage cine_of(const StudyOptions& options, int pixels) {
    scenario::Scenario scenario =
        scenario::load_scenario(options.scenarios / "coronary_lad.toml", options.devices);
    scenario.c_arm.pixels = pixels;
    run::StillRequest request;
    request.frame = 12;
    request.lao = -30 * geometry::degree;
    request.cranial = -20 * geometry::degree;
    request.mode = script::ImagingMode::Cine;
    return run::render_still(
        scenario,
        script::parse_commands("0 beam on\n2 inject 5 ml at 4 ml/s through introducer\n20 end\n", "realism"),
        request, options.cache);
}

/// Pictures from elsewhere, in the order of their names.
std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> found;
    if (folder.empty()) return found;
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator(folder, failed))
        if (entry.path().extension() == ".png") found.push_back(entry.path());
    if (failed)
        throw io::InputError("{}: expected a folder of pictures: {}", folder.string(), failed.message());
    std::ranges::sort(found);
    for (const std::filesystem::path& file : found) pixel_of(file.filename().string());
    return found;
}

}  // namespace

StudyResult run_realism(const StudyOptions& options) {
    const int pixels = options.quick ? 128 : 1024;
    const std::vector<std::filesystem::path> others = pictures_in(options.pictures);
    Measured measured;
    std::vector<NamedPicture> real, own;
    std::vector<render::GrayImage> images;
    std::vector<std::string> labels;
    io::Table table{"views", {"region", "view", "triangles", "tube_kV", "air_kerma_mGy"}};
    Work work(options, static_cast<int>(regions().size() + 1 + others.size()));
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
            render::Field expected = imaging.fluoroscope.expected_quanta(arm, {}, exposure);
            for (float& value : expected.values) value = std::log(std::max(value, 1e-3f));
            measured.add(labels.back(), field_of(images.back()), expected, render::pixel_width(arm));
            own.push_back({labels.back(), field_of(images.back()), render::pixel_width(arm)});
            const render::Technique technique = imaging.fluoroscope.technique(arm, exposure);
            table.add({region.name, angles.name, triangles, technique.kvp, technique.air_kerma});
        }
        work.tell(region.name);
    }
    if (!options.scenarios.empty()) {
        images.push_back(cine_of(options, pixels / 2));
        labels.push_back("left coronary artery, cine, RAO 30 caudal 20");
        measured.add(labels.back(), field_of(images.back()), field_of(images.back()), 360.0 / pixels);
        own.push_back({labels.back(), field_of(images.back()), 360.0 / pixels});
    }
    work.tell("cine");
    for (const std::filesystem::path& file : others) {
        const std::string name = file.filename().string();
        const render::Field grey = grey_levels(file);
        try {
            measured.add(name, grey, grey, pixel_of(name));
        } catch (const std::invalid_argument& error) {
            throw io::InputError("{}: {}", file.string(), error.what());
        }
        real.push_back({name, grey, pixel_of(name)});
        work.tell(name);
    }
    constexpr int pairs = 20;
    ForcedChoice choice = forced_choice(real, own, pairs, options.seed);
    StudyResult result;
    result.page = filled_text("realism", {{"quick", options.quick ? " --quick" : ""},
                                          {"dose", scenario::Scenario{}.imaging.acquisition_dose},
                                          {"measures", io::to_markdown(measured.table, 3)},
                                          {"table", io::to_markdown(table, 3)}});
    result.pictures = {{"realism",
                        "The procedural patient from three sides a region, at the dose of an acquisition, "
                        "and a frame of cine.",
                        render::contact_sheet(images, 3, pixels / 2, labels)}};
    result.tables = {std::move(table), std::move(measured.table)};
    if (choice.pairs.empty()) return result;
    for (StudyPicture& pair : choice.pairs) result.pictures.push_back(std::move(pair));
    result.tables.push_back(std::move(choice.answers));
    result.files.emplace_back("choice.html", std::move(choice.page));
    return result;
}

}  // namespace studies
