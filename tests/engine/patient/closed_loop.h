#pragma once
/// The closed loop: the procedural patient becomes a CT with contrast in a vessel, which is read and imaged
/// again.

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <gtest/gtest.h>
#include <vector>

#include "engine/patient/ct_patient.h"
#include "engine/patient/voxelise.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"

namespace test {

struct LoopError {
    double signal = 0;     // rms of the difference, in means of the signal
    double logarithm = 0;  // rms of the difference of the logarithms
};
using LoopErrors = std::array<LoopError, 3>;  // AP, lateral, LAO 35 cranial 20

/// Signals before noise, over all pixels that receive less than 90 % of the open beam, of square images
/// of that many pixels and 200 mm.
inline LoopErrors closed_loop(const std::filesystem::path& file, double voxel, int pixels,
                              bool with_gas = true) {
    using geometry::Vec3;
    using render::Field;
    std::vector<render::TissueLayer> layers = render::make_patient({});
    for (render::TissueLayer& layer : layers) layer.texture_blobs.clear();  // a voxelised patient has none
    if (!with_gas)
        std::erase_if(layers, [](const render::TissueLayer& layer) { return layer.name == "bowel gas"; });
    const auto lumen =
        render::tube({{0, 0, -190}, {10, -5, 0}, {0, 0, 190}}, Vec3::UnitX(), {8, 8, 8}, {8, 8, 8}, 32);
    Vec3 low = layers.front().mesh.vertices.front(), high = low;
    for (const Vec3& v : layers.front().mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    // As far up and down as the rays reach.
    low.z() = -170;
    high.z() = 170;
    {
        std::vector<render::TissueLayer> scanned = layers;
        // Trabecular bone has about the HU of an artery in CT angiography.
        scanned.push_back(
            {"contrast", render::Material::TrabecularBone, render::Material::SoftTissue, lumen});
        patient::write_ct(file, patient::voxelised(scanned, patient::grid_around(low, high, voxel)));
    }
    patient::PatientFiles files;
    files.ct = file;
    render::Fluoroscope meshes({}, layers), ct({}, {}, {}, {}, {patient::ct_volume(files, lumen)}),
        nothing({}, {});
    LoopErrors errors;
    const double views[3][2] = {{0, 0}, {90, 0}, {35, 20}};
    for (int view = 0; view < 3; ++view) {
        render::CArm arm{.lao = views[view][0] * geometry::degree,
                         .cranial = views[view][1] * geometry::degree,
                         .detector_width = 200,
                         .pixels = pixels};
        render::Exposure exposure{.kvp = 80};
        const Field a = meshes.expected_quanta(arm, {}, exposure), b = ct.expected_quanta(arm, {}, exposure);
        Field open = nothing.expected_quanta(arm, {}, exposure);
        // From the tube's output without a patient to that with one.
        const auto charge = [&](render::Fluoroscope& of) {
            const render::Technique technique = of.technique(arm, exposure);
            return technique.current * technique.pulse_width;
        };
        const double output = charge(meshes) / charge(nothing);
        double squares = 0, logarithms = 0, sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < a.values.size(); ++i) {
            if (a.values[i] > 0.9 * output * open.values[i]) continue;
            squares += std::pow(a.values[i] - b.values[i], 2);
            logarithms += std::pow(std::log(a.values[i] / b.values[i]), 2);
            sum += a.values[i];
            ++count;
        }
        EXPECT_GT(count, pixels * pixels / 2);
        errors[view] = {std::sqrt(squares / count) / (sum / count), std::sqrt(logarithms / count)};
        std::printf(
            "voxels of %.2g mm, LAO %.0f cranial %.0f: rms %.2f %% of the signal, %.4f of its logarithm\n",
            voxel, views[view][0], views[view][1], 100 * errors[view].signal, errors[view].logarithm);
    }
    return errors;
}

}  // namespace test
