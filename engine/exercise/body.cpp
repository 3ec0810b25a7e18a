#include "engine/exercise/body.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/packed_body.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/mapped_file.h"
#include "physics/geometry/state.h"
#include "render/patient/patient.h"
#include "render/xray/path_length.h"

namespace exercise {
namespace {

/// A guess for vessels whose place in the body is not given. The aortic bifurcation is taken to be where the
/// widest branch that leads downward leaves a root branch, or well below the vessels when none does, as in a
/// chest. The body's middle is that of the highest vessels.
geometry::BodyPlace guessed_place(const anatomy::Anatomy& anatomy) {
    const geometry::CentrelineBranch* widest = nullptr;
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        for (const geometry::Vec3& p : branch.points) lowest = std::min(lowest, p.z());
        const bool forks_root = branch.parent >= 0 && anatomy.branches[branch.parent].parent < 0;
        const bool downward = branch.points.back().z() < branch.points.front().z() - 100;
        if (forks_root && downward && (!widest || branch.radii.front() > widest->radii.front()))
            widest = &branch;
    }
    for (const geometry::Vec3& p : anatomy.lumen.vertices) highest = std::max(highest, p.z());
    double left = -std::numeric_limits<double>::infinity(), right = -left, front = right;
    for (const geometry::Vec3& p : anatomy.lumen.vertices) {
        front = std::min(front, p.y());
        if (p.z() < highest - 10.0) continue;
        left = std::max(left, p.x());
        right = std::min(right, p.x());
    }
    constexpr double below_chest = 150;  // from the end of a thoracic aorta to L4 [mm]
    return {geometry::Landmark::AorticBifurcation,
            {0.5 * (left + right), front, widest ? widest->points.front().z() : lowest - below_chest}};
}

/// The same body around the same vessels, in all their exercises: a seed from where the branches begin and
/// end.
std::uint64_t body_seed(const anatomy::Anatomy& anatomy) {
    geometry::Hash hash;
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        for (const geometry::Vec3& p : {branch.points.front(), branch.points.back()})
            for (int k = 0; k < 3; ++k) hash.add(static_cast<std::uint64_t>(std::llround(10.0 * p[k])));
    }
    return std::max<std::uint64_t>(hash.value(), 1);  // 0 would be the mean
}

render::PatientSpec patient(const anatomy::Anatomy& anatomy) {
    render::PatientSpec spec =
        render::patient_around(anatomy.lumen.vertices, anatomy.body ? *anatomy.body : guessed_place(anatomy));
    spec.seed = body_seed(anatomy);
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        // Close enough for balls to form a tube.
        double since = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (i > 0) since += (branch.points[i] - branch.points[i - 1]).norm();
            if (since < 0.5 * branch.radii[i]) continue;
            spec.vessels.push_back({branch.points[i], branch.radii[i]});
            since = 0.0;
        }
    }
    return spec;
}

/// To be raised whenever the same PatientSpec gives another body, or the layout of a kept one changes.
constexpr std::uint64_t body_version = 9;

/// Covers all that a body is made from.
std::uint64_t key_of(const render::PatientSpec& spec) {
    geometry::Hash hash;
    hash.add(body_version);
    for (const geometry::Vec3& p : {spec.lower, spec.upper, spec.origin})
        hash.add(p.data(), sizeof(double) * 3);
    hash.add(spec.width);
    hash.add(spec.depth);
    hash.add(std::uint64_t{spec.bowel_gas});
    hash.add(spec.seed);
    hash.add(std::uint64_t{spec.vessels.size()});
    for (const render::VesselSample& sample : spec.vessels) {
        hash.add(sample.place.data(), sizeof(double) * 3);
        hash.add(sample.radius);
    }
    return hash.value();
}

std::string file_name(std::uint64_t key) {
    return fmt::format("body-{:016x}.bin", key);
}

struct KeptBlob {
    render::TextureBlob blob;
    void state(geometry::StateStream& s) {
        s(blob.middle, blob.axis, blob.radius, blob.elongation, blob.fraction);
    }
};

/// A body as it is kept.
struct KeptBody {
    Body& body;

    void state(geometry::StateStream& s) {
        std::uint64_t layers = body.layers.size();
        s(body.origin, layers, body.textures);
        if (s.restores())
            body.layers.resize(std::min<std::uint64_t>(layers, 1000));  // far more than there are
        for (render::TissueLayer& layer : body.layers) {
            std::vector<Eigen::Vector3i> corners;
            std::vector<KeptBlob> texture_blobs;
            for (const auto& t : layer.mesh.triangles) corners.emplace_back(t[0], t[1], t[2]);
            for (const render::TextureBlob& blob : layer.texture_blobs) texture_blobs.push_back({blob});
            s(layer.name, layer.material, layer.inside, layer.mesh.vertices, corners, texture_blobs);
            if (!s.restores()) continue;
            for (const Eigen::Vector3i& c : corners) layer.mesh.triangles.push_back({c[0], c[1], c[2]});
            for (const KeptBlob& kept : texture_blobs) layer.texture_blobs.push_back(kept.blob);
            layer.closed = true;
        }
    }
    /// Whether materials and corners are some that there are.
    bool sound() const {
        return std::ranges::all_of(body.layers, [](const render::TissueLayer& layer) {
            const auto known = [](render::Material material) {
                return static_cast<int>(material) >= 0 && static_cast<int>(material) < render::material_count;
            };
            const auto there = [&](const std::array<int, 3>& t) {
                return std::ranges::all_of(t, [&](int corner) {
                    return corner >= 0 && corner < static_cast<int>(layer.mesh.vertices.size());
                });
            };
            return known(layer.material) && known(layer.inside) &&
                   std::ranges::all_of(layer.mesh.triangles, there);
        });
    }
};

std::shared_ptr<const Body> kept(const anatomy::CachePlace& place, std::uint64_t key) {
    if (!place.exists()) return nullptr;
    const auto file = geometry::MappedFile::of(place.path());
    return file ? body_of(file->bytes(), key) : nullptr;
}

}  // namespace

std::shared_ptr<const render::MeteredLayers> metered(std::shared_ptr<const Body> body) {
    const render::MeteredLayers* const part = &*body->metered;
    return {std::move(body), part};
}

std::string bytes_of(const Body& body, std::uint64_t key) {
    // Writing a state changes nothing.
    return anatomy::sealed(key, geometry::state_of(KeptBody{const_cast<Body&>(body)}));
}

std::shared_ptr<const Body> body_of(std::span<const std::byte> file, std::uint64_t key) {
    const std::span<const std::byte> bytes = anatomy::unsealed(key, file);
    if (bytes.empty()) return nullptr;
    const auto body = std::make_shared<Body>();
    KeptBody kept{*body};
    try {
        geometry::restore_state(kept, bytes);
    } catch (const std::runtime_error&) {
        return nullptr;
    }
    if (!kept.sound()) return nullptr;
    body->metered.emplace(body->layers);
    return body;
}

std::shared_ptr<const Body> body_around(const anatomy::Anatomy& anatomy, const anatomy::ModelCache& cache) {
    static anatomy::SharedStore<std::uint64_t, Body> store;
    const render::PatientSpec spec = patient(anatomy);
    const std::uint64_t key = key_of(spec);
    bool looked = false;
    const std::shared_ptr<const Body> found = store.get(key, [&]() -> std::shared_ptr<const Body> {
        looked = true;
        const anatomy::CachePlace place(cache, file_name(key));
        if (std::shared_ptr<const Body> body = kept(place, key)) {
            place.used();
            return body;
        }
        if (cache.progress) cache.progress(0.0, "body");
        anatomy::count(anatomy::Made::Body);
        const auto made = std::make_shared<Body>();
        made->origin = spec.origin;
        made->layers = render::make_patient(spec, &made->textures);
        for (const render::TissueLayer& layer : made->layers) render::require_closed(layer.name, layer.mesh);
        *made = rounded_body(*made);
        made->metered.emplace(made->layers);
        if (place.exists()) place.keep_file(bytes_of(*made, key));
        if (cache.progress) cache.progress(1.0, "body");
        return made;
    });
    // Another cache than that of those who share it may not have it yet.
    std::error_code ignored;
    if (!looked && !cache.folder.empty() && !std::filesystem::exists(cache.folder / file_name(key), ignored))
        anatomy::CachePlace(cache, file_name(key)).keep_file(bytes_of(*found, key));
    return found;
}

std::uint64_t body_key(const anatomy::Anatomy& anatomy) {
    return key_of(patient(anatomy));
}

bool body_is_kept(const anatomy::Anatomy& anatomy, const anatomy::ModelCache& cache) {
    const std::uint64_t key = body_key(anatomy);
    return kept(anatomy::CachePlace(cache, file_name(key)), key) != nullptr;
}

}  // namespace exercise
