#include "engine/exercise/body.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <utility>

#include "engine/anatomy/shared_store.h"
#include "engine/io/mapped_file.h"
#include "physics/geometry/hash.h"
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
constexpr std::uint64_t body_version = 1;

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

/// The beginning of a kept body; its layers follow.
struct BodyHead {
    char magic[8] = {'S', 'E', 'L', 'D', 'B', 'O', 'D', 'Y'};
    std::uint64_t key = 0, size = 0, hash = 0, layers = 0;  // size and hash: of what follows
    double origin[3] = {};
};
/// The beginning of a layer. Name, vertices, triangles and lumps follow, each from a multiple of 8 bytes on.
struct LayerHead {
    std::uint64_t name = 0, vertices = 0, triangles = 0, lumps = 0;  // how many of each
    std::int32_t material = 0, inside = 0;
};
/// render::Lump as its numbers.
struct KeptLump {
    float middle[3], axis[3], radius, elongation, share;
};
static_assert(sizeof(geometry::Vec3) == 3 * sizeof(double) && sizeof(std::array<int, 3>) == 12);

std::uint64_t hash_of(std::span<const std::byte> bytes) {
    geometry::Hash hash;
    hash.add(bytes.data(), bytes.size());
    return hash.value();
}

/// Takes values from bytes, one list after the other; false where there are fewer.
class Taking {
public:
    explicit Taking(std::span<const std::byte> bytes) : left_(bytes) {}
    template <class Value>
    bool operator()(Value* to, std::uint64_t count) {
        if (count > left_.size() / sizeof(Value)) return false;
        const std::size_t size = static_cast<std::size_t>(count) * sizeof(Value);
        if (size > 0) std::memcpy(static_cast<void*>(to), left_.data(), size);
        left_ = left_.subspan(std::min((size + 7) / 8 * 8, left_.size()));
        return true;
    }
    /// Whether so many values are there, before memory is taken for them.
    template <class Value>
    bool has(std::uint64_t count) const {
        return count <= left_.size() / sizeof(Value);
    }
    bool done() const { return left_.empty(); }

private:
    std::span<const std::byte> left_;
};

bool take_layer(Taking& take, render::TissueLayer& layer) {
    LayerHead head;
    if (!take(&head, 1)) return false;
    for (const std::int32_t material : {head.material, head.inside})
        if (material < 0 || material > static_cast<int>(render::Material::CaesiumIodide)) return false;
    layer.material = static_cast<render::Material>(head.material);
    layer.inside = static_cast<render::Material>(head.inside);
    if (!take.has<char>(head.name)) return false;
    layer.name.resize(static_cast<std::size_t>(head.name));
    if (!take(layer.name.data(), head.name) || !take.has<geometry::Vec3>(head.vertices)) return false;
    layer.mesh.vertices.resize(static_cast<std::size_t>(head.vertices));
    if (!take(layer.mesh.vertices.data(), head.vertices) || !take.has<std::array<int, 3>>(head.triangles))
        return false;
    layer.mesh.triangles.resize(static_cast<std::size_t>(head.triangles));
    if (!take(layer.mesh.triangles.data(), head.triangles) || !take.has<KeptLump>(head.lumps)) return false;
    const auto count = static_cast<std::int64_t>(head.vertices);
    for (const auto& triangle : layer.mesh.triangles)
        for (const int corner : triangle)
            if (corner < 0 || corner >= count) return false;
    std::vector<KeptLump> lumps(static_cast<std::size_t>(head.lumps));
    if (!take(lumps.data(), head.lumps)) return false;
    layer.lumps.reserve(lumps.size());
    for (const KeptLump& lump : lumps)
        layer.lumps.push_back({Eigen::Vector3f(lump.middle), Eigen::Vector3f(lump.axis), lump.radius,
                               lump.elongation, lump.share});
    layer.closed = true;
    return true;
}

std::shared_ptr<const Body> kept(const anatomy::CachePlace& place, std::uint64_t key) {
    if (!place.exists()) return nullptr;
    const std::optional<io::MappedFile> file = io::MappedFile::of(place.path());
    return file ? body_of(file->bytes(), key) : nullptr;
}

}  // namespace

std::shared_ptr<const render::MeteredLayers> metered(std::shared_ptr<const Body> body) {
    const render::MeteredLayers* const part = &*body->metered;
    return {std::move(body), part};
}

std::string bytes_of(const Body& body, std::uint64_t key) {
    std::string bytes;
    const auto give = [&bytes](const auto* values, std::size_t count) {
        bytes.append(reinterpret_cast<const char*>(values), count * sizeof *values);
        bytes.resize((bytes.size() + 7) / 8 * 8);
    };
    BodyHead head;
    head.key = key;
    head.layers = body.layers.size();
    for (int k = 0; k < 3; ++k) head.origin[k] = body.origin[k];
    give(&head, 1);
    for (const render::TissueLayer& layer : body.layers) {
        const LayerHead own{layer.name.size(),
                            layer.mesh.vertices.size(),
                            layer.mesh.triangles.size(),
                            layer.lumps.size(),
                            static_cast<std::int32_t>(layer.material),
                            static_cast<std::int32_t>(layer.inside)};
        give(&own, 1);
        give(layer.name.data(), layer.name.size());
        give(layer.mesh.vertices.data(), layer.mesh.vertices.size());
        give(layer.mesh.triangles.data(), layer.mesh.triangles.size());
        std::vector<KeptLump> lumps;
        for (const render::Lump& lump : layer.lumps) {
            KeptLump& one = lumps.emplace_back(KeptLump{{}, {}, lump.radius, lump.elongation, lump.share});
            for (int k = 0; k < 3; ++k) one.middle[k] = lump.middle[k], one.axis[k] = lump.axis[k];
        }
        give(lumps.data(), lumps.size());
    }
    const std::size_t start = offsetof(BodyHead, layers);
    head.size = bytes.size() - start;
    head.hash = hash_of(std::as_bytes(std::span(bytes)).subspan(start));
    std::memcpy(bytes.data(), &head, sizeof head);
    return bytes;
}

std::shared_ptr<const Body> body_of(std::span<const std::byte> bytes, std::uint64_t key) {
    BodyHead head;
    const std::size_t start = offsetof(BodyHead, layers);
    if (bytes.size() < sizeof head) return nullptr;
    std::memcpy(&head, bytes.data(), sizeof head);
    if (std::memcmp(head.magic, BodyHead().magic, sizeof head.magic) != 0 || head.key != key ||
        head.size != bytes.size() - start || head.hash != hash_of(bytes.subspan(start)))
        return nullptr;
    const auto body = std::make_shared<Body>();
    body->origin = geometry::Vec3(head.origin);
    Taking take(bytes.subspan(sizeof head));
    for (std::uint64_t layer = 0; layer < head.layers; ++layer)
        if (!take_layer(take, body->layers.emplace_back())) return nullptr;
    if (!take.done()) return nullptr;
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
        made->layers = render::make_patient(spec);
        for (render::TissueLayer& layer : made->layers) {
            render::require_closed(layer.name, layer.mesh);
            layer.closed = true;
        }
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

bool body_is_kept(const anatomy::Anatomy& anatomy, const anatomy::ModelCache& cache) {
    const std::uint64_t key = key_of(patient(anatomy));
    return kept(anatomy::CachePlace(cache, file_name(key)), key) != nullptr;
}

}  // namespace exercise
