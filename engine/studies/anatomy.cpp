#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/anatomy_sign.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/vec.h"

namespace studies {
namespace {

using geometry::TriangleMesh;

/// Distances of the triangles' centroids from f = 0, in order [mm].
std::vector<double> centroid_errors(const TriangleMesh& mesh, const anatomy::ImplicitLumen& lumen) {
    std::vector<double> errors;
    for (const auto& t : mesh.triangles) {
        const geometry::Vec3 centroid = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
        errors.push_back(std::abs(lumen.at(centroid).distance));
    }
    std::sort(errors.begin(), errors.end());
    return errors;
}

/// Returns what was generated.
anatomy::Anatomy add_row(io::Table& table, std::string_view preset, std::uint64_t seed) {
    const anatomy::VesselTreeSpec spec = anatomy::vessel_preset(preset, seed);
    anatomy::GeneratorOptions options;
    options.threads = 1;
    const double start = io::thread_cpu_seconds();
    const anatomy::VesselTree tree = anatomy::grow(spec);
    const anatomy::ClosedLumen closed = anatomy::closed_surface(tree, options);
    anatomy::Anatomy anatomy = anatomy::cut_open(spec, tree, closed);
    const double spent = io::thread_cpu_seconds() - start;
    const geometry::Topology before = geometry::topology(closed.mesh),
                             after = geometry::topology(anatomy.lumen);
    const anatomy::TriangleAngles angles = anatomy::smallest_angles(anatomy.lumen);
    const std::vector<double> errors = centroid_errors(anatomy.lumen, closed.implicit);
    table.add({preset, seed, spent, anatomy.lumen.triangles.size(), angles.least / geometry::degree,
               angles.percentile / geometry::degree, errors[errors.size() / 2],
               errors[errors.size() * 99 / 100], errors.back(), before.boundary_edges,
               anatomy::euler_characteristic(closed.mesh), after.non_manifold_edges,
               anatomy::self_intersections(anatomy.lumen)});
    return anatomy;
}

void add_import(io::Table& table, const std::string& name, const anatomy::Anatomy& truth,
                const TriangleMesh& mesh) {
    anatomy::ImportOptions options;
    options.unit = "mm";
    options.threads = 1;
    for (const anatomy::VesselEnd& end : truth.ends)
        if (end.role == anatomy::EndRole::Inlet) options.inlet = end.opening.centre;
    const double start = io::thread_cpu_seconds();
    const anatomy::ImportedLumen lumen = anatomy::import_lumen(mesh, truth.name, options);
    const double spent = io::thread_cpu_seconds() - start;
    const ImportErrors errors = import_errors(truth, lumen.anatomy);
    table.add({name, spent, errors.branches, errors.true_branches, errors.invented, errors.ends,
               errors.true_ends, errors.end_centre, 100 * errors.end_radius,
               errors.end_normal / geometry::degree, errors.centre_p50, errors.centre_p95, errors.centre_max,
               100 * errors.radius_p50, 100 * errors.radius_p95});
}

/// Real meshes come without a known truth: only the findings are reported.
void add_real(io::Table& table, const std::filesystem::path& mesh) {
    if (!std::filesystem::exists(mesh)) return;
    anatomy::ImportOptions options;
    options.unit = "mm";
    options.threads = 1;
    const double start = io::thread_cpu_seconds();
    const anatomy::Anatomy anatomy = anatomy::import_lumen(mesh, options).anatomy;
    const double spent = io::thread_cpu_seconds() - start, none = std::nan("");
    table.add({mesh.filename().string(), spent, anatomy.branches.size(), none, none, anatomy.ends.size(),
               none, none, none, none, none, none, none, none, none});
}

}  // namespace

StudyResult run_anatomy(const StudyOptions& options) {
    io::Table table{"generator",
                    {"preset", "seed", "cpu_s", "triangles", "least_angle_deg", "p1_angle_deg",
                     "error_p50_mm", "error_p99_mm", "error_max_mm", "boundary_edges_before_cut",
                     "euler_before_cut", "non_manifold_edges", "self_intersections"}};
    io::Table imports{"importer",
                      {"case", "cpu_s", "branches", "true_branches", "invented", "ends", "true_ends",
                       "end_centre_max_mm", "end_radius_max_percent", "end_normal_max_deg", "centre_p50_mm",
                       "centre_p95_mm", "centre_max_mm", "radius_p50_percent", "radius_p95_percent"}};
    const auto presets = anatomy::vessel_presets();
    const int seeds = options.quick ? 1 : 2, of = static_cast<int>(presets.size()) * (seeds + 1) + 3;
    Work work(options, of);
    std::vector<anatomy::Anatomy> truths;  // of seed 0
    for (const anatomy::VesselPreset& preset : presets) {
        for (int seed = 0; seed < seeds; ++seed) {
            anatomy::Anatomy made = add_row(table, preset.name, static_cast<std::uint64_t>(seed));
            if (seed == 0) truths.push_back(std::move(made));
            work.tell(fmt::format("{}, seed {}", preset.name, seed));
        }
    }
    for (const anatomy::Anatomy& truth : truths) {
        add_import(imports, truth.name, truth, truth.lumen);
        add_import(imports, truth.name + ", corrupted", truth, corrupted(truth.lumen, 1));
        const TriangleMesh closed = flat_capped(truth.lumen);
        add_import(imports, truth.name + ", capped", truth, closed);
        add_import(imports, truth.name + ", capped, corrupted", truth, corrupted(closed, 1));
        work.tell(fmt::format("{} imported", truth.name));
    }
    for (const char* mesh : {"sofa_carotids.stl", "sofa_phantom.obj", "carotid_stenosis_lumen.stl",
                             "steve_thrombectomy_remesh.obj"})
        add_real(imports, options.real_meshes / mesh);
    work.tell("real meshes imported");
    io::Table signs = sign_table();
    for (const char* preset : {"arch-1", "lca"}) {
        add_signs(signs, preset, options);
        work.tell(fmt::format("{} inside and outside", preset));
    }
    StudyResult result;
    result.page = filled_text("anatomy", {{"quick", options.quick ? " --quick" : ""},
                                          {"generator", io::to_markdown(table)},
                                          {"importer", io::to_markdown(imports)},
                                          {"signs", io::to_markdown(signs)}});
    result.tables = {std::move(table), std::move(imports), std::move(signs)};
    result.plots = {filled_plot("generator", 1000, 420, {})};
    return result;
}

}  // namespace studies
