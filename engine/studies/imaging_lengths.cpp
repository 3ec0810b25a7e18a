#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <numbers>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/exercise/imaging.h"
#include "engine/studies/all_hits.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "render/xray/surface_crossings.h"

namespace studies {
namespace {

using geometry::TriangleMesh;
using render::CArm;

using std::numbers::pi;

/// A body whose chords are known.
struct Solid {
    std::string_view name;
    double radius;  // reference for its error [mm]
    std::function<TriangleMesh(int around)> mesh;
    std::function<double(const Vec3& origin, const Vec3& direction)> chord;
};

double sphere_chord(const Vec3& o, const Vec3& d, double radius) {
    const double square = radius * radius - (o - o.dot(d) * d).squaredNorm();
    return square > 0 ? 2 * std::sqrt(square) : 0;
}

/// A cylinder about z, from −half to half.
double cylinder_chord(const Vec3& o, const Vec3& d, double radius, double half) {
    const double a = d.head<2>().squaredNorm(), b = o.head<2>().dot(d.head<2>());
    const double root = b * b - a * (o.head<2>().squaredNorm() - radius * radius);
    if (root <= 0) return 0;
    const auto [low, high] = std::minmax({(-half - o.z()) / d.z(), (half - o.z()) / d.z()});
    return std::max(0.0,
                    std::min(high, (-b + std::sqrt(root)) / a) - std::max(low, (-b - std::sqrt(root)) / a));
}

/// A torus about z. With p = o + t·d and o nearest to the centre, (|p|² + R² − r²)² = 4R²(p_x² + p_y²) is a
/// quartic without its cubic term; its roots are the eigenvalues of the companion matrix.
double torus_chord(const Vec3& from, const Vec3& d, double major, double minor) {
    const Vec3 o = from - from.dot(d) * d;
    if (o.norm() > major + minor) return 0;
    const double k = o.squaredNorm() + major * major - minor * minor, four = 4 * major * major;
    Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
    companion.diagonal(-1).setOnes();
    companion.col(3) << four * o.head<2>().squaredNorm() - k * k, 2 * four * o.head<2>().dot(d.head<2>()),
        four * d.head<2>().squaredNorm() - 2 * k, 0;
    std::vector<double> roots;
    for (const std::complex<double>& root : companion.eigenvalues())
        if (std::abs(root.imag()) < 1e-6) roots.push_back(root.real());
    std::sort(roots.begin(), roots.end());
    double sum = 0;
    for (std::size_t i = 1; i < roots.size(); i += 2) sum += roots[i] - roots[i - 1];
    return sum;
}

TriangleMesh torus(double major, double minor, int around) {
    const int along = static_cast<int>(std::lround(around * major / minor));
    TriangleMesh mesh;
    for (int i = 0; i < along; ++i) {
        for (int j = 0; j < around; ++j) {
            const double a = 2 * pi * i / along, b = 2 * pi * j / around, r = major + minor * std::cos(b);
            mesh.vertices.emplace_back(r * std::cos(a), r * std::sin(a), minor * std::sin(b));
            const int right = (i + 1) % along * around, up = (j + 1) % around;
            mesh.triangles.push_back({i * around + j, right + j, right + up});
            mesh.triangles.push_back({i * around + j, right + up, i * around + up});
        }
    }
    return mesh;
}

constexpr double ball = 30, tube = 9, length = 60, major = 28, minor = 9;  // of the solids [mm]

std::vector<Solid> solids() {
    return {{"sphere", ball, [](int n) { return render::ellipsoid(Vec3::Zero(), Vec3::Constant(ball), n); },
             [](const Vec3& o, const Vec3& d) { return sphere_chord(o, d, ball); }},
            {"cylinder", tube,
             [](int n) {
                 return render::tube({{0, 0, -length / 2}, {0, 0, length / 2}}, Vec3::UnitX(), {tube, tube},
                                     {tube, tube}, n);
             },
             [](const Vec3& o, const Vec3& d) { return cylinder_chord(o, d, tube, length / 2); }},
            {"torus", minor, [](int n) { return torus(major, minor, n); },
             [](const Vec3& o, const Vec3& d) { return torus_chord(o, d, major, minor); }}};
}

CArm oblique(int pixels, double width) {
    CArm arm;
    arm.lao = 0.5;
    arm.cranial = -0.2;
    arm.detector_width = width;
    arm.pixels = pixels;
    return arm;
}

template <class Use>
void for_each_ray(const CArm& arm, const Use& use) {
    for (int j = 0; j < arm.pixels; ++j)
        for (int i = 0; i < arm.pixels; ++i)
            use(static_cast<std::size_t>(j) * arm.pixels + i, render::ray_direction(arm, i + 0.5, j + 0.5));
}

/// Slope of ln y over ln x by least squares.
double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
    double mx = 0, my = 0, xx = 0, xy = 0;
    const double n = static_cast<double>(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) mx += std::log(x[i]) / n, my += std::log(y[i]) / n;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += (std::log(x[i]) - mx) * (std::log(x[i]) - mx);
        xy += (std::log(x[i]) - mx) * (std::log(y[i]) - my);
    }
    return xy / xx;
}

struct ClosedForms {
    io::Table errors{
        "imaging_closed_forms",
        {"solid", "around", "facet_over_radius", "mean_error_percent", "mean_error_mm", "triangles"}};
    io::Table slopes{"imaging_closed_form_orders", {"solid", "order"}};
};

ClosedForms closed_forms(bool quick) {
    ClosedForms result;
    const CArm arm = oblique(quick ? 96 : 256, 140);
    for (const Solid& solid : solids()) {
        std::vector<double> facets, errors;
        for (const int around : {12, 20, 28, 48, 96, 192}) {
            const TriangleMesh mesh = solid.mesh(around);
            render::PathLengthRenderer renderer;
            const render::Field drawn = renderer.render(renderer.add(mesh), arm).length;
            double error = 0;
            int pixels = 0;
            for_each_ray(arm, [&](std::size_t pixel, const Vec3& ray) {
                const double exact = solid.chord(render::source(arm), ray);
                if (exact == 0 && drawn.values[pixel] == 0) return;
                error += std::abs(drawn.values[pixel] - exact);
                ++pixels;
            });
            facets.push_back(2 * pi / around);
            errors.push_back(error / pixels);
            result.errors.add({solid.name, around, facets.back(), 100 * errors.back() / solid.radius,
                               errors.back(), mesh.triangles.size()});
        }
        result.slopes.add({solid.name, log_slope(facets, errors)});
    }
    return result;
}

CArm view_of(const TriangleMesh& lumen, int pixels, double lao, double cranial) {
    Eigen::AlignedBox3d box;
    for (const Vec3& v : lumen.vertices) box.extend(v);
    CArm arm;
    arm.lao = lao * pi / 180;
    arm.cranial = cranial * pi / 180;
    arm.isocentre = box.center();
    arm.pixels = pixels;
    return arm;
}

/// Compares a generated lumen with the implicit surface that it was cut from: each crossing of a ray is moved
/// along the ray to f = 0.
void add_vessel(io::Table& table, std::string_view preset, int pixels) {
    const anatomy::ClosedLumen closed =
        anatomy::closed_surface(anatomy::grow(anatomy::vessel_preset(preset)));
    const CArm arm = view_of(closed.mesh, pixels, 20, -10);
    const render::SurfaceCrossings met = render::surface_crossings(closed.mesh, arm, 1);
    double error = 0, relative = 0;
    int rays = 0;
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const Vec3 ray = render::ray_direction(arm, i + 0.5, j + 0.5), from = render::source(arm);
            const double slant = 1 / ray.dot(render::axes(arm).beam);
            double shift = 0, radius = 0;
            for (const render::Crossing& crossing : met.of(i, j)) {
                double t = (crossing.depth + arm.sod) * slant;
                const double start = t;
                for (int step = 0; step < 8; ++step) {
                    const anatomy::ImplicitLumen::Value value = closed.implicit.at(from + t * ray);
                    radius = value.radius;
                    const double rate = value.gradient.dot(ray);
                    // A grazing ray may have no crossing of the smooth surface at all.
                    if (std::abs(rate) < 0.05) break;
                    t -= value.distance / rate;
                }
                shift += crossing.entry ? start - t : t - start;
            }
            if (met.of(i, j).empty() || !(radius > 0)) continue;
            error += std::abs(shift);
            relative += std::abs(shift) / radius;
            ++rays;
        }
    }
    table.add({preset, closed.mesh.triangles.size(), rays, error / rays, 100 * relative / rays});
}

/// Layers of a patient around a generated anatomy, the lumen last.
std::vector<render::TissueLayer> patient_of(const anatomy::Anatomy& anatomy) {
    return exercise::tissue_layers(scenario::Scenario{}, anatomy);
}

struct Agreement {
    double rays = 0, undecided = 0, square = 0, beyond = 0, largest = 0;

    void add(const Agreement& other) {
        rays += other.rays, undecided += other.undecided, square += other.square, beyond += other.beyond;
        largest = std::max(largest, other.largest);
    }
    std::vector<io::TableCell> row(const std::string& anatomy, const std::string& layer,
                                   double triangles) const {
        return {anatomy,
                layer,
                triangles,
                rays,
                undecided,
                std::sqrt(square / std::max(rays, 1.0)),
                1e6 * beyond / std::max(rays, 1.0),
                largest};
    }
};

render::Field drawn_lengths(const TriangleMesh& mesh, const CArm& arm) {
    render::PathLengthRenderer renderer;
    return renderer.render(renderer.add(mesh), arm).length;
}

/// The lumen as contrast sees it: from the crossings of one ray per pixel.
render::Field crossed_lengths(const TriangleMesh& mesh, const CArm& arm) {
    const render::SurfaceCrossings met = render::surface_crossings(mesh, arm, 1);
    render::Field lengths(arm.pixels, arm.pixels);
    const Vec3 beam = render::axes(arm).beam;
    for_each_ray(arm, [&](std::size_t pixel, const Vec3& ray) {
        double depth = 0;
        const int column = static_cast<int>(pixel) % arm.pixels, row = static_cast<int>(pixel) / arm.pixels;
        for (const render::Crossing& crossing : met.of(column, row))
            depth += crossing.entry ? -crossing.depth : crossing.depth;
        lengths.values[pixel] = static_cast<float>(depth / ray.dot(beam));
    });
    return lengths;
}

Agreement agreement(const render::Field& lengths, const AllHits& oracle, const CArm& arm) {
    Agreement result;
    const Vec3 from = render::source(arm);
    for_each_ray(arm, [&](std::size_t pixel, const Vec3& ray) {
        const AllHits::Sum traced = oracle.along(from, ray);
        if (traced.balance != 0) {
            ++result.undecided;
            return;
        }
        if (traced.length == 0 && lengths.values[pixel] == 0) return;
        const double error = std::abs(lengths.values[pixel] - traced.length);
        ++result.rays;
        result.square += error * error;
        result.beyond += error > 0.01;
        result.largest = std::max(result.largest, error);
    });
    return result;
}

void add_agreement(io::Table& table, std::string_view preset, const std::vector<render::TissueLayer>& layers,
                   const std::vector<CArm>& arms) {
    Agreement all, crossed;
    double triangles = 0;
    for (const render::TissueLayer& layer : layers) {
        Agreement own;
        const AllHits oracle(layer.mesh);
        for (const CArm& arm : arms) {
            own.add(agreement(drawn_lengths(layer.mesh, arm), oracle, arm));
            if (layer.takes_contrast) crossed.add(agreement(crossed_lengths(layer.mesh, arm), oracle, arm));
        }
        const auto count = static_cast<double>(layer.mesh.triangles.size());
        all.add(own);
        triangles += count;
        if (own.rays == 0) continue;
        table.add(own.row(std::string(preset), layer.name, count));
        if (crossed.rays > 0)
            table.add(crossed.row(std::string(preset), layer.name + ", for contrast", count));
    }
    table.add(all.row(std::string(preset), "all drawn", triangles));
}

/// Unbalanced pixels over many poses; poses whose source lies within a mesh's reach are counted separately.
void add_balance(io::Table& table, std::string_view preset, const std::vector<render::TissueLayer>& layers,
                 const StudyOptions& options) {
    const TriangleMesh& lumen = layers.back().mesh;
    render::PathLengthRenderer renderer;
    for (const render::TissueLayer& layer : layers) renderer.add(layer.mesh);
    const int step = options.quick ? 60 : 15;
    int poses = 0, unbalanced = 0, behind = 0, behind_unbalanced = 0;
    std::string named;
    for (int lao = -120; lao <= 120; lao += step) {
        for (const int cranial : {-45, 0, 45}) {
            const CArm arm = view_of(lumen, options.quick ? 128 : 512, lao, cranial);
            const Vec3 from = render::source(arm), beam = render::axes(arm).beam;
            int found = 0;
            bool reaches = false;
            for (std::size_t k = 0; k < layers.size(); ++k) {
                found += renderer.render(static_cast<int>(k), arm).unbalanced_pixels;
                const auto& v = layers[k].mesh.vertices;
                reaches = reaches || std::any_of(v.begin(), v.end(),
                                                 [&](const Vec3& p) { return beam.dot(p - from) <= 0; });
            }
            ++poses;
            (reaches ? behind_unbalanced : unbalanced) += found;
            if (!reaches) continue;
            ++behind;
            named += fmt::format("{}{}/{}", named.empty() ? "" : ", ", lao, cranial);
        }
    }
    table.add({preset, poses - behind, unbalanced, behind, behind_unbalanced, named});
}

}  // namespace

StudyResult imaging_lengths(const StudyOptions& options) {
    StudyResult result;
    ClosedForms forms = closed_forms(options.quick);
    io::Table vessels{"imaging_vessels",
                      {"anatomy", "triangles", "rays", "mean_error_mm", "mean_error_percent"}};
    io::Table agreements{
        "imaging_ray_tracer",
        {"anatomy", "layer", "triangles", "rays", "undecided", "rms_mm", "beyond_0.01_mm_ppm", "largest_mm"}};
    io::Table balance{"imaging_balance",
                      {"anatomy", "poses", "unbalanced_pixels", "poses_with_parts_behind_the_source",
                       "unbalanced_there", "those_poses_lao_cranial_deg"}};
    const int pixels = options.quick ? 96 : 512;
    std::vector<std::string_view> presets = {"iliac-renal"};
    if (!options.quick) presets.push_back("arch-1");
    for (const std::string_view preset : presets) {
        add_vessel(vessels, preset, pixels);
        const anatomy::Anatomy anatomy =
            anatomy::generated_anatomy(anatomy::vessel_preset(preset), options.cache);
        const std::vector<render::TissueLayer> layers = patient_of(anatomy);
        std::vector<CArm> arms = {view_of(layers.back().mesh, pixels, 0, 0)};
        if (!options.quick) arms.push_back(view_of(layers.back().mesh, pixels, 35, -20));
        add_agreement(agreements, preset, layers, arms);
        add_balance(balance, preset, layers, options);
    }
    result.page = filled_text("imaging_lengths", {{"errors", io::to_markdown(forms.errors)},
                                                  {"slopes", io::to_markdown(forms.slopes)},
                                                  {"vessels", io::to_markdown(vessels)},
                                                  {"agreements", io::to_markdown(agreements)},
                                                  {"balance", io::to_markdown(balance)}});
    result.tables = {std::move(forms.errors), std::move(forms.slopes), std::move(vessels),
                     std::move(agreements), std::move(balance)};
    result.plots = {filled_plot("imaging_closed_forms", 760, 520, {})};
    return result;
}

}  // namespace studies
