#include "render/xray/path_length.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "physics/geometry/mesh_topology.h"
#include "render/picture/gl_source.h"
#include "render/xray/signed_depths.h"
#include "render/xray/surface_crossings.h"

namespace render {
int unmatched_edges(const TriangleMesh& mesh) {
    const int count = static_cast<int>(mesh.vertices.size());
    for (int i = 0; i < count; ++i)
        if (!mesh.vertices[i].allFinite())
            throw std::invalid_argument("vertex " + std::to_string(i) + " is not finite");
    const std::vector<int> corner = geometry::first_at_place(mesh.vertices);
    // Edges by their lower corner, which few of them share. An edge that is run through equally often in both
    // directions is matched.
    std::vector<std::size_t> starts(mesh.vertices.size() + 1, 0);
    const auto for_each_edge = [&](const auto& use) {
        for (const auto& triangle : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int a = corner[triangle[k]], b = corner[triangle[(k + 1) % 3]];
                if (a != b) use(std::min(a, b), std::max(a, b), a < b ? 1 : -1);
            }
        }
    };
    for (const auto& triangle : mesh.triangles) {
        for (const int v : triangle) {
            if (v >= 0 && v < count) continue;
            throw std::invalid_argument("a triangle names vertex " + std::to_string(v) + " of " +
                                        std::to_string(count));
        }
    }
    for_each_edge([&](int low, int, int) { ++starts[low + 1]; });
    for (int i = 0; i < count; ++i) starts[i + 1] += starts[i];
    struct HalfEdge {
        int other, forward;
    };
    std::vector<HalfEdge> half_edges(starts.back());
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    for_each_edge([&](int low, int high, int forward) { half_edges[next[low]++] = {high, forward}; });
    int unmatched = 0;
    for (int i = 0; i < count; ++i) {
        const auto own = std::span(half_edges).subspan(starts[i], starts[i + 1] - starts[i]);
        std::sort(own.begin(), own.end(),
                  [](const HalfEdge& a, const HalfEdge& b) { return a.other < b.other; });
        for (std::size_t k = 0; k < own.size();) {
            const int other = own[k].other;
            int sum = 0;
            for (; k < own.size() && own[k].other == other; ++k) sum += own[k].forward;
            unmatched += std::abs(sum);
        }
    }
    return unmatched;
}

OpenMeshError::OpenMeshError(const std::string& name, int edges, int pixels)
    : std::runtime_error("the mesh '" + name + "' is open: " + std::to_string(edges) + " unmatched edges, " +
                         std::to_string(pixels) +
                         " pixels whose ray enters and leaves unequally often; close it first"),
      edges_(edges),
      pixels_(pixels) {}

struct PathLengthRenderer::State {
    struct Mesh {
        std::size_t vertices = 0;
        bool displaced = false;
        Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // of the box around it at every phase [mm]
    };

    std::mutex mutex;  // of one call at a time
    std::unique_ptr<SignedDepths> depths;
    std::vector<Mesh> meshes;

    explicit State(Rasteriser rasteriser)
        : depths(rasteriser == Rasteriser::OpenGl ? signed_depths_by_opengl()
                                                  : signed_depths_by_processor()) {}
};

Rasteriser usual_rasteriser() {
    return gl_source::adds_floats() ? Rasteriser::OpenGl : Rasteriser::Processor;
}

PathLengthRenderer::PathLengthRenderer(Rasteriser rasteriser) : rasteriser_(rasteriser) {}
PathLengthRenderer::~PathLengthRenderer() = default;

PathLengthRenderer::State& PathLengthRenderer::state() {
    if (!state_) state_ = std::make_unique<State>(rasteriser_);
    return *state_;
}

int PathLengthRenderer::add(const TriangleMesh& mesh) {
    return add(mesh, {}, {});
}

int PathLengthRenderer::add(const TriangleMesh& mesh, std::span<const Eigen::Vector3f> breath,
                            std::span<const Eigen::Vector3f> beat, std::span<const Eigen::Vector3f> drift) {
    const SignedDepths::Moves moves{breath, beat, drift};
    State::Mesh made;
    made.vertices = mesh.vertices.size();
    for (const auto& displacements : moves) {
        if (!displacements.empty() && displacements.size() != made.vertices)
            throw std::invalid_argument(std::to_string(made.vertices) + " vertices have " +
                                        std::to_string(displacements.size()) + " displacements");
        made.displaced = made.displaced || !displacements.empty();
    }
    if (!mesh.vertices.empty()) made.low = made.high = mesh.vertices.front();
    for (std::size_t i = 0; i < made.vertices; ++i) {
        const Vec3& vertex = mesh.vertices[i];
        made.low = made.low.cwiseMin(vertex);
        made.high = made.high.cwiseMax(vertex);
        for (const auto& displacements : moves) {
            if (displacements.empty()) continue;
            const Vec3 reach = 3.0 * displacements[i].cast<double>().cwiseAbs();
            made.low = made.low.cwiseMin(vertex - reach);
            made.high = made.high.cwiseMax(vertex + reach);
        }
    }
    State& state = this->state();
    const std::lock_guard lock(state.mutex);
    state.depths->add(mesh, moves);
    state.meshes.push_back(made);
    return static_cast<int>(state.meshes.size()) - 1;
}

void PathLengthRenderer::move(int mesh, const TriangleMesh& moved) {
    State& state = this->state();
    const std::lock_guard lock(state.mutex);
    State::Mesh& known = state.meshes.at(static_cast<std::size_t>(mesh));
    if (moved.vertices.size() != known.vertices || known.displaced)
        throw std::invalid_argument(std::to_string(known.vertices) + " vertices cannot move to " +
                                    std::to_string(moved.vertices.size()) + " places");
    for (const Vec3& vertex : moved.vertices) {
        known.low = known.low.cwiseMin(vertex);
        known.high = known.high.cwiseMax(vertex);
    }
    state.depths->move(mesh, moved);
}

/// The window that the image of a box may cover: all of it when the box reaches toward the source's plane.
static Window window_of(const Vec3& low, const Vec3& high, const CArm& arm) {
    double left = arm.pixels, top = arm.pixels, right = 0, bottom = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Pixel at = project(arm, {(corner & 1 ? high : low).x(), (corner & 2 ? high : low).y(),
                                       (corner & 4 ? high : low).z()});
        if (!(at.depth > 1.0)) return {0, 0, arm.pixels, arm.pixels};
        left = std::min(left, at.x);
        top = std::min(top, at.y);
        right = std::max(right, at.x);
        bottom = std::max(bottom, at.y);
    }
    // One pixel more for rounding.
    const auto within = [&arm](double place) {
        return static_cast<int>(std::clamp(place, 0.0, static_cast<double>(arm.pixels)));
    };
    return {within(left - 1), within(top - 1), within(std::ceil(right) + 1), within(std::ceil(bottom) + 1)};
}

PathLengthRenderer::Result PathLengthRenderer::render(int mesh, const CArm& arm, Phase phase) {
    Result result{Field(arm.pixels, arm.pixels), 0};
    result.unbalanced_pixels = accumulate(mesh, arm, result.length, phase);
    return result;
}

int PathLengthRenderer::accumulate(std::span<const int> meshes, const CArm& arm, Field& sum, Phase phase,
                                   Field* before) {
    State& state = this->state();
    const std::lock_guard lock(state.mutex);
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    Window window{pixels, pixels, 0, 0};
    std::vector<int> seen;
    for (const int mesh : meshes) {
        const State::Mesh& drawn = state.meshes.at(static_cast<std::size_t>(mesh));
        const Window own = window_of(drawn.low, drawn.high, arm);
        if (own.empty()) continue;
        seen.push_back(mesh);
        window = {std::min(window.left, own.left), std::min(window.top, own.top),
                  std::max(window.right, own.right), std::max(window.bottom, own.bottom)};
    }
    if (seen.empty()) return 0;
    const float* from = state.depths->draw(seen, arm, phase, window).data();
    int unbalanced = 0;
    const double step = pixel_width(arm) / arm.sid;
    for (int j = window.top; j < window.bottom; ++j) {
        const double y = (j + 0.5 - 0.5 * pixels) * step;
        float* to = sum.values.data() + static_cast<std::size_t>(j) * pixels;
        float* to_before = before ? before->values.data() + static_cast<std::size_t>(j) * pixels : nullptr;
        for (int i = window.left; i < window.right; ++i, from += 4) {
            if (from[2] != 0.0f) {
                ++unbalanced;
                continue;
            }
            const double depth = from[0];
            if (!(depth > 0.0)) continue;
            // From depth along the beam axis to length along the ray.
            const double x = (i + 0.5 - 0.5 * pixels) * step;
            const double oblique = std::sqrt(1.0 + x * x + y * y);
            to[i] += static_cast<float>(depth * oblique);
            if (to_before) to_before[i] += static_cast<float>(from[1] * oblique);
        }
    }
    return unbalanced;
}

/// A distant, oblique view that shows the whole mesh: axis-aligned holes would be edge-on from the front.
static CArm view_of(const TriangleMesh& mesh) {
    Vec3 low = mesh.vertices.front(), high = low;
    for (const Vec3& v : mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    const double radius = std::max(0.5 * (high - low).norm(), 1e-3);
    CArm arm;
    arm.lao = 0.5;
    arm.cranial = 0.4;
    arm.isocentre = 0.5 * (low + high);
    arm.sod = 10.0 * radius;
    arm.sid = 12.0 * radius;
    arm.detector_width = 2.6 * radius;
    return arm;
}

void require_closed(const std::string& name, const TriangleMesh& mesh) {
    int edges = 0;
    try {
        edges = unmatched_edges(mesh);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error("the mesh '" + name + "' is broken: " + error.what());
    }
    if (edges == 0) return;
    const CArm arm = view_of(mesh);
    PathLengthRenderer renderer;
    throw OpenMeshError(name, edges, renderer.render(renderer.add(mesh), arm).unbalanced_pixels);
}

OverlappingMeshError::OverlappingMeshError(const std::string& name, int pixels, int covered)
    : std::runtime_error(
          "the mesh '" + name + "' overlaps itself or is inside out: " + std::to_string(pixels) + " of the " +
          std::to_string(covered) +
          " pixels that it covers in a view are unbalanced on the way; expected at most one in a hundred"),
      pixels_(pixels) {}

void require_simple(const std::string& name, const TriangleMesh& mesh) {
    CArm arm = view_of(mesh);
    arm.pixels = 256;
    const SurfaceCrossings met = surface_crossings(mesh, arm, 1);
    int wrong = 0, covered = 0;
    for (int v = 0; v < met.side; ++v) {
        for (int u = 0; u < met.side; ++u) {
            int inside = 0;
            bool alternates = true;
            for (const Crossing& crossing : met.of(u, v)) {
                inside += crossing.entry ? 1 : -1;
                alternates = alternates && (inside == 0 || inside == 1);
            }
            wrong += !alternates;
            covered += !met.of(u, v).empty();
        }
    }
    // A few intersecting triangles, as in a surface drawn by hand, do not change any image.
    constexpr double tolerated = 0.01;
    if (wrong > tolerated * covered) throw OverlappingMeshError(name, wrong, covered);
}

}  // namespace render
