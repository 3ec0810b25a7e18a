/// The closed loop: a patient of meshes becomes a CT and is imaged again; and how CTs and meshes are asked for.

#include "engine/patient/ct_patient.h"

#include <cmath>
#include <numeric>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/exercise/imaging.h"
#include "engine/patient/voxelise.h"
#include "engine/scenario/scenario.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/dicom_writer.h"

namespace patient {
namespace {

using geometry::Vec3;
using render::Field;

render::VolumeGrid grid_of(const std::vector<render::TissueLayer>& layers, double voxel) {
    Vec3 low = layers.front().mesh.vertices.front(), high = low;
    for (const Vec3& v : layers.front().mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    return grid_around(low, high, voxel);
}

struct Agreement {
    double signal = 0;     // rms of the difference, in means of the signal behind the anatomy
    double logarithm = 0;  // rms of the difference of the logarithms there
};

/// Over pixels that see the body.
Agreement compare(const Field& meshes, const Field& ct, double open_beam) {
    double squares = 0, logs = 0, sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < meshes.values.size(); ++i) {
        const double a = meshes.values[i], b = ct.values[i];
        if (a > 0.9 * open_beam) continue;
        squares += (a - b) * (a - b);
        logs += std::pow(std::log(a / b), 2);
        sum += a;
        ++count;
    }
    EXPECT_GT(count, 1000);
    return {std::sqrt(squares / count) / (sum / count), std::sqrt(logs / count)};
}

void write_stl(const std::filesystem::path& path, const geometry::TriangleMesh& mesh, int leave_out = 0) {
    std::string text = "solid a\n";
    for (std::size_t t = static_cast<std::size_t>(leave_out); t < mesh.triangles.size(); ++t) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int c : mesh.triangles[t])
            text += fmt::format("vertex {} {} {}\n", mesh.vertices[c].x(), mesh.vertices[c].y(), mesh.vertices[c].z());
        text += "endloop\nendfacet\n";
    }
    test::write(path, text + "endsolid a\n");
}

}  // namespace

TEST(CtPatient, ImagesOfThePatientAndOfItsCtAgree) {
    // The limit is the voxel: an edge that it blurs, in the image by the magnification times as wide.
    const test::TemporaryFolder folder;
    const render::PatientSpec spec;
    std::vector<render::TissueLayer> layers = render::make_patient(spec);
    const auto lumen = render::tube({{0, 0, -100}, {0, 0, 100}}, Vec3::UnitX(), {8, 8}, {8, 8}, 32);
    const CtImage ct = voxelised(layers, grid_of(layers, 1.5));
    write_ct(folder / "patient.nii.gz", ct);
    write_ct(folder / "patient.nrrd", ct);
    test::DicomSeries series;
    series.with_sign = true;
    test::write_dicom(folder / "patient", ct, series);
    PatientFiles files;
    files.ct = folder / "patient.nii.gz";
    files.keep_contrast = true;
    const render::DensityVolume volume = ct_volume(files, lumen);
    for (const char* other : {"patient.nrrd", "patient"}) {
        files.ct = folder / other;
        const render::DensityVolume same = ct_volume(files, lumen);
        EXPECT_EQ(same.samples, volume.samples) << other;
        EXPECT_LT((same.grid.origin - volume.grid.origin).norm(), 1e-3) << other;
    }
    render::Fluoroscope of_meshes({}, layers);
    render::Fluoroscope of_ct({}, {}, {}, {}, {volume});
    render::Fluoroscope of_nothing({}, {});
    for (const auto& [name, lao, cranial] : {std::tuple("AP", 0.0, 0.0), std::tuple("lateral", 90.0, 0.0),
                                             std::tuple("LAO 35 cranial 20", 35.0, 20.0)}) {
        render::CArm arm;
        arm.pixels = 256;
        arm.lao = lao * geometry::degree;
        arm.cranial = cranial * geometry::degree;
        render::Exposure exposure;
        exposure.kvp = 80;
        const Field a = of_meshes.expected_quanta(arm, {}, exposure), b = of_ct.expected_quanta(arm, {}, exposure);
        const Field open = of_nothing.expected_quanta(arm, {}, exposure);
        // Each is exposed for the same dose behind itself: the open beam of the first.
        const double flat = of_nothing.technique(arm, exposure).current > 0
                                ? open.values[open.values.size() / 2] *
                                      of_meshes.technique(arm, exposure).current *
                                      of_meshes.technique(arm, exposure).pulse_width /
                                      (of_nothing.technique(arm, exposure).current *
                                       of_nothing.technique(arm, exposure).pulse_width)
                                : 0;
        const Agreement agreement = compare(a, b, flat);
        std::printf("%s: rms %.2f %% of the signal, %.4f of its logarithm\n", name, 100 * agreement.signal,
                    agreement.logarithm);
        EXPECT_LT(agreement.signal, 0.02) << name;
        EXPECT_LT(agreement.logarithm, 0.02) << name;
    }
}

}  // namespace patient
