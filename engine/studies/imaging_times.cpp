#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <functional>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/blood/contrast_flow.h"
#include "engine/exercise/imaging.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "render/panel/panel.h"
#include "render/patient/solids.h"
#include "render/picture/png.h"
#include "render/xray/path_length.h"
#include "render/xray/subtraction.h"

namespace studies {
namespace {

using render::CArm;
using render::Exposure;
using render::Field;

/// Median over the calls of the processor time of all threads together [ms].
double median_ms(int calls, const std::function<void()>& call) {
    std::vector<double> times;
    for (int i = 0; i < calls; ++i) {
        const double start = io::process_cpu_seconds();
        call();
        times.push_back(1e3 * (io::process_cpu_seconds() - start));
    }
    return quantile(std::move(times), 0.5);
}

double triangles_of(const std::vector<render::TissueLayer>& layers) {
    double count = 0;
    for (const render::TissueLayer& layer : layers) count += static_cast<double>(layer.mesh.triangles.size());
    return count;
}

struct Meshes {
    std::string name;
    std::vector<render::TissueLayer> layers;
};

/// Cuts triangles into four, layers with the fewest first, until there are about this many.
Meshes finer(Meshes scene, const std::string& name, double triangles) {
    std::vector<std::size_t> order(scene.layers.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto count = [&](std::size_t i) { return scene.layers[i].mesh.triangles.size(); };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return count(a) < count(b); });
    for (const std::size_t i : order) {
        if (triangles_of(scene.layers) + 3 * static_cast<double>(count(i)) > 1.05 * triangles) continue;
        scene.layers[i].mesh = render::subdivided(scene.layers[i].mesh);
    }
    scene.name = name;
    return scene;
}

/// Gives a new pose with every call.
void turn(CArm& arm) {
    arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.02;
}

/// What is in the beam in one anatomy, at several levels of detail, and what flows in it.
struct Room {
    anatomy::Anatomy anatomy;
    blood::ContrastFlow flow;
    std::vector<Meshes> scenes;
    Polyline joints;

    explicit Room(const StudyOptions& options)
        : anatomy(anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache)),
          flow(anatomy) {
        scenario::Scenario scenario;
        Meshes patient{"patient", exercise::tissue_layers(scenario, anatomy)};
        for (const exercise::BlushingOrgan& organ :
             exercise::blushing_organs(patient.layers, flow.blood().outlets))
            patient.layers[organ.layer].perfused = true;
        scenario.imaging.patient = false;
        scenes.push_back({"lumen in air", exercise::tissue_layers(scenario, anatomy)});
        if (!options.quick) {
            scenes.push_back(patient);
            scenes.push_back(finer(patient, "patient, finer", 400e3));
            scenes.push_back(finer(patient, "patient, finest", 700e3));
        }
        // 200 joints 1 mm apart, as an advanced wire has.
        const Polyline& line = anatomy.branches.front().points;
        for (std::size_t i = 0; i < line.size() && joints.size() < 200; ++i)
            if (joints.empty() || (line[i] - joints.back()).norm() >= 1) joints.push_back(line[i]);
    }

    render::LumenContrast contrast(const Meshes& scene) const {
        return {scene.layers.back().mesh,
                {flow.nodes().begin(), flow.nodes().end()},
                {flow.radii().begin(), flow.radii().end()}};
    }
    render::Fluoroscope fluoroscope(const Meshes& scene) const {
        return render::Fluoroscope({}, scene.layers, contrast(scene));
    }
    CArm arm(int pixels) const {
        Eigen::AlignedBox3d box;
        for (const Vec3& v : anatomy.lumen.vertices) box.extend(v);
        CArm arm;
        arm.isocentre = box.center();
        arm.pixels = pixels;
        return arm;
    }
    /// Contrast in all vessels and organs.
    Exposure filled(const Meshes& scene) const {
        Exposure exposure;
        exposure.vessel_iodine.assign(flow.nodes().size(), 100.0f);
        for (std::size_t i = 0; i < scene.layers.size(); ++i)
            if (scene.layers[i].perfused) exposure.organs.push_back({static_cast<int>(i), 1.0});
        return exposure;
    }
    /// Median time of a new pose, to its first frame without contrast [ms].
    double pose_change(render::Fluoroscope& scope, CArm& arm, int calls) const {
        const auto change = [&] {
            turn(arm);
            scope.expose(arm, joints, {});
        };
        change();
        return median_ms(calls, change);
    }
};

std::vector<io::TableCell> pose_row(const Room& room, const Meshes& scene, int pixels, int calls) {
    CArm arm = room.arm(pixels);
    std::array<double, 2> lengths{};  // by OpenGL, by the processor
    for (const render::Rasteriser by : {render::Rasteriser::OpenGl, render::Rasteriser::Processor}) {
        render::PathLengthRenderer renderer(by);
        int drawn = 0;
        // As in the fluoroscope, for which a lumen like its surroundings is visible by contrast only.
        for (const render::TissueLayer& layer : scene.layers)
            if (layer.material != layer.inside || layer.perfused) drawn = renderer.add(layer.mesh) + 1;
        Field sum(pixels, pixels);
        const auto all = [&] {
            turn(arm);
            for (int mesh = 0; mesh < drawn; ++mesh) renderer.accumulate(mesh, arm, sum);
        };
        all();
        lengths[static_cast<std::size_t>(by)] = median_ms(calls, all);
    }
    render::Fluoroscope scope = room.fluoroscope(scene);
    const double whole = room.pose_change(scope, arm, calls);
    const double frame = median_ms(calls, [&] { scope.expose(arm, room.joints, {}); });
    const render::LumenContrast contrast = room.contrast(scene);
    const double matrix = median_ms(calls, [&] {
        turn(arm);
        contrast.at(arm);
    });
    return {scene.name,
            triangles_of(scene.layers),
            scene.layers.size(),
            pixels,
            lengths[0],
            lengths[1],
            std::max(0.0, whole - lengths[0] - frame),
            frame,
            matrix,
            whole,
            whole + matrix};
}

std::vector<io::TableCell> frame_row(const Room& room, const Meshes& scene, int pixels, int calls) {
    const CArm arm = room.arm(pixels);
    render::Fluoroscope scope = room.fluoroscope(scene);
    Exposure plain, filled = room.filled(scene);
    const double pixel = render::pixel_width(arm);
    scope.expose(arm, room.joints, filled);
    const auto expected = [&](const Polyline& joints, Exposure& exposure) {
        return median_ms(calls, [&] {
            ++exposure.frame;
            scope.expected_quanta(arm, joints, exposure);
        });
    };
    const double bare = expected({}, plain), wired = expected(room.joints, plain);
    const double contrast = expected(room.joints, filled) - wired;
    const Field quanta = scope.expected_quanta(arm, room.joints, plain);
    const auto read = [&](const render::DetectorSpec& spec) {
        return median_ms(calls, [&] { render::read_out(quanta, pixel, spec, 1, ++plain.frame); });
    };
    const render::DetectorSpec detector;
    const double counted = read({0, 0}), spread = read({detector.scintillator_blur, 0}), all = read(detector);
    const Field signal = scope.read(arm, room.joints, plain);
    const render::Display& display = scope.display(arm, plain);
    render::GrayImage image;
    const double shown = median_ms(calls, [&] { image = display.show(signal); });
    const double file = median_ms(calls, [&] { render::encode_png(image); });
    const auto whole = [&](Exposure& exposure) {
        return median_ms(calls, [&] {
            ++exposure.frame;
            scope.expose(arm, room.joints, exposure);
        });
    };
    const double frame = whole(plain), with_contrast = whole(filled);
    render::Subtraction subtraction(signal, scope.opening(arm));
    const Field later = scope.read(arm, room.joints, filled);
    subtraction.opacify(later);
    const double subtracted = median_ms(calls, [&] { subtraction.subtracted(later); });
    const double roadmap = median_ms(calls, [&] { subtraction.roadmap(signal); });
    render::Panel panel;
    const render::Readout readout;
    panel.draw(image, &image, readout);
    const double drawn = median_ms(calls, [&] { panel.draw(image, &image, readout); });
    return {pixels,
            bare,
            std::max(0.0, wired - bare),
            std::max(0.0, contrast),
            counted,
            std::max(0.0, spread - counted),
            std::max(0.0, all - spread),
            shown,
            frame,
            with_contrast,
            subtracted,
            roadmap,
            file,
            drawn};
}

}  // namespace

StudyResult imaging_times(const StudyOptions& options) {
    const Room room(options);
    const int calls = options.quick ? 1 : 15;
    const std::vector<int> sizes = options.quick ? std::vector{128} : std::vector{512, 1024};
    io::Table poses{
        "imaging_pose_ms",
        {"scene", "triangles", "layers", "pixels", "path_lengths", "path_lengths_by_processor",
         "beam_and_display", "frame", "contrast_matrix", "pose_change", "pose_change_with_matrix"}};
    io::Table frames{"imaging_frame_ms",
                     {"pixels", "bare_image", "wire", "contrast", "quanta", "scintillator", "electronics",
                      "display", "frame", "frame_with_contrast", "subtraction", "roadmap", "png", "panel"}};
    io::Table previews{"imaging_preview_ms", {"scene", "triangles", "pixels", "pose_change"}};
    for (const int pixels : sizes) {
        for (const Meshes& scene : room.scenes) poses.add(pose_row(room, scene, pixels, calls));
        const Meshes& usual = room.scenes[options.quick ? 0 : 1];
        frames.add(frame_row(room, usual, pixels, options.quick ? 1 : 41));
    }
    for (const Meshes& scene : room.scenes)
        for (const int pixels : options.quick ? std::vector{64} : std::vector{128, 192, 256}) {
            CArm arm = room.arm(pixels);
            render::Fluoroscope scope = room.fluoroscope(scene);
            previews.add(
                {scene.name, triangles_of(scene.layers), pixels, room.pose_change(scope, arm, calls)});
        }
    StudyResult result;
    result.page = filled_text("imaging_times", {{"frames", io::to_markdown(frames, 3)},
                                                {"poses", io::to_markdown(poses, 3)},
                                                {"previews", io::to_markdown(previews, 3)}});
    result.tables = {std::move(frames), std::move(poses), std::move(previews)};
    result.plots = {filled_plot("imaging_times", 1200, 480, {})};
    return result;
}

}  // namespace studies
