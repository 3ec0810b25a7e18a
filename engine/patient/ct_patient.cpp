#include "engine/patient/ct_patient.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <fstream>
#include <optional>

#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/patient/ct_cleaning.h"
#include "engine/patient/ct_image.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/vessel_fit.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/mesh_topology.h"
#include "render/xray/path_length.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Mat3;
using geometry::Vec3;

constexpr std::int16_t air = -1000;

/// Leaves the box of what is denser than air, and a margin.
void crop(CtImage& ct) {
    std::array<int, 3> low = ct.grid.size, high = {-1, -1, -1};
    for (int k = 0; k < ct.grid.size[2]; ++k)
        for (int j = 0; j < ct.grid.size[1]; ++j) {
            const std::int16_t* row = ct.hu.data() + ct.grid.index(0, j, k);
            const std::int16_t* end = row + ct.grid.size[0];
            const std::int16_t* first = std::find_if(row, end, [](std::int16_t hu) { return hu > air; });
            if (first == end) continue;
            const std::int16_t* last = end - 1;
            while (*last <= air) --last;
            const std::array<int, 3> from = {static_cast<int>(first - row), j, k};
            const std::array<int, 3> to = {static_cast<int>(last - row), j, k};
            for (int a = 0; a < 3; ++a) {
                low[a] = std::min(low[a], from[a]);
                high[a] = std::max(high[a], to[a]);
            }
        }
    if (high[0] < 0) return;
    constexpr int margin = 2;  // where edges still have an effect
    for (int a = 0; a < 3; ++a) {
        low[a] = std::max(low[a] - margin, 0);
        high[a] = std::min(high[a] + margin, ct.grid.size[a] - 1);
    }
    CtImage box;
    box.grid = ct.grid;
    box.grid.origin = ct.grid.at(low[0], low[1], low[2]);
    for (int a = 0; a < 3; ++a) box.grid.size[a] = high[a] - low[a] + 1;
    if (box.grid == ct.grid) return;
    // In place: each row moves toward the front.
    for (int k = 0; k < box.grid.size[2]; ++k)
        for (int j = 0; j < box.grid.size[1]; ++j)
            std::memmove(ct.hu.data() + box.grid.index(0, j, k),
                         ct.hu.data() + ct.grid.index(low[0], low[1] + j, low[2] + k),
                         sizeof(std::int16_t) * static_cast<std::size_t>(box.grid.size[0]));
    ct.hu.resize(box.grid.count());
    ct.hu.shrink_to_fit();
    ct.grid = box.grid;
}

/// Carries on the last slice of a body that the scan cuts off toward head or feet, and lets it fade: an image
/// that reaches beyond the scan would have an edge as bright as air there.
void continue_beyond(CtImage& ct) {
    constexpr double whole = 40, faded = 120;  // from the last slice on [mm]
    constexpr double least_area = 1000;        // of the body in that slice [mm²]
    constexpr std::int16_t body = -300;
    const std::array<int, 3> size = ct.grid.size;
    int along = 0;
    for (int a = 1; a < 3; ++a) {
        const auto upright = [&](int axis) { return std::abs(ct.grid.steps[axis].normalized().z()); };
        if (upright(a) > upright(along)) along = a;
    }
    const double step = ct.grid.steps[along].norm();
    const double area = ct.grid.steps[(along + 1) % 3].cross(ct.grid.steps[(along + 2) % 3]).norm();
    double in_first = 0, in_last = 0;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i) {
                const int place = std::array{i, j, k}[along];
                if (place != 0 && place != size[along] - 1) continue;
                if (ct.hu[ct.grid.index(i, j, k)] <= body) continue;
                if (place == 0) in_first += area;
                if (place == size[along] - 1) in_last += area;
            }
    const int more = static_cast<int>(std::ceil(faded / step)), before = in_first >= least_area ? more : 0,
              after = in_last >= least_area ? more : 0;
    CtImage longer;
    longer.grid = ct.grid;
    longer.grid.size[along] += before + after;
    longer.grid.origin -= before * ct.grid.steps[along];
    if (before + after == 0 || longer.grid.size[along] > 32768 || longer.grid.count() > most_samples) return;
    longer.hu.resize(longer.grid.count());
    std::vector<float> weights;
    for (int place = 0; place < longer.grid.size[along]; ++place) {
        const double away = step * std::max({before - place, place - before - size[along] + 1, 0});
        const double gone = std::clamp((away - whole) / (faded - whole), 0.0, 1.0);
        weights.push_back(static_cast<float>(1 - gone * gone * (3 - 2 * gone)));
    }
    for (int k = 0; k < longer.grid.size[2]; ++k)
        for (int j = 0; j < longer.grid.size[1]; ++j)
            for (int i = 0; i < longer.grid.size[0]; ++i) {
                std::array<int, 3> from = {i, j, k};
                const float weight = weights[static_cast<std::size_t>(from[along])];
                from[along] = std::clamp(from[along] - before, 0, size[along] - 1);
                const int hu = ct.hu[ct.grid.index(from[0], from[1], from[2])];
                longer.hu[longer.grid.index(i, j, k)] =
                    weight == 1
                        ? static_cast<std::int16_t>(hu)
                        : static_cast<std::int16_t>(std::lround(air + weight * static_cast<float>(hu - air)));
            }
    longer.notes = std::move(ct.notes);
    ct = std::move(longer);
}

constexpr std::uint64_t prepared_version = 4;  // to be raised when preparing gives other samples

std::uint64_t fingerprint(const PatientFiles& files, const geometry::TriangleMesh& lumen) {
    geometry::Hash hash;
    hash.add(prepared_version);
    hash.add(content_hash(files.ct));
    hash.add(std::uint64_t{files.series.size()});
    hash.add(files.series.data(), files.series.size());
    hash.add(std::uint64_t{files.keep_table} + 2 * std::uint64_t{files.keep_contrast} +
             4 * std::uint64_t{files.partial});
    for (int a = 0; a < 3; ++a) {
        hash.add(files.shift[a]);
        hash.add(files.rotation[a]);
    }
    hash.add(std::uint64_t{lumen.vertices.size()});
    for (const Vec3& v : lumen.vertices) hash.add(v.data(), sizeof(double) * 3);
    return hash.value();
}

/// A prepared CT on disk: this, the samples, and the notes, each followed by an end of line.
struct PreparedHeader {
    char magic[8] = {'S', 'E', 'L', 'D', 'C', 'T', '0', '2'};
    std::uint64_t fingerprint = 0, hash = 0, notes = 0;  // the hash is of samples and notes; notes [bytes]
    std::int32_t size[4] = {};
    double origin[3] = {}, steps[9] = {};
};

std::uint64_t hash_of(const std::vector<std::int16_t>& samples, const std::string& notes) {
    geometry::Hash hash;
    hash.add(samples.data(), samples.size() * sizeof(std::int16_t));
    hash.add(notes.data(), notes.size());
    return hash.value();
}

/// Empty when it is missing, damaged or of something else.
std::optional<CtImage> kept(const fs::path& path, std::uint64_t wanted) {
    std::ifstream file(path, std::ios::binary);
    PreparedHeader header;
    if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return std::nullopt;
    if (std::memcmp(header.magic, PreparedHeader().magic, sizeof header.magic) != 0) return std::nullopt;
    if (header.fingerprint != wanted) return std::nullopt;
    CtImage ct;
    double samples = 1;
    for (int a = 0; a < 3; ++a) {
        if (header.size[a] < 1) return std::nullopt;
        samples *= header.size[a];
        ct.grid.size[a] = header.size[a];
        ct.grid.origin[a] = header.origin[a];
        for (int b = 0; b < 3; ++b) ct.grid.steps[a][b] = header.steps[3 * a + b];
    }
    std::error_code failed;
    constexpr std::uint64_t most_notes = 1 << 20;
    if (!(samples <= most_samples) || header.notes > most_notes ||
        fs::file_size(path, failed) !=
            sizeof header + ct.grid.count() * sizeof(std::int16_t) + header.notes ||
        failed)
        return std::nullopt;
    ct.hu.resize(ct.grid.count());
    std::string notes(header.notes, '\0');
    if (!file.read(reinterpret_cast<char*>(ct.hu.data()),
                   static_cast<std::streamsize>(ct.hu.size() * sizeof(std::int16_t))) ||
        !file.read(notes.data(), static_cast<std::streamsize>(notes.size())))
        return std::nullopt;
    if (hash_of(ct.hu, notes) != header.hash) return std::nullopt;
    for (std::size_t from = 0, end; (end = notes.find('\n', from)) != std::string::npos; from = end + 1)
        ct.notes.push_back(notes.substr(from, end - from));
    return ct;
}

std::string prepared_bytes(std::uint64_t name, const CtImage& ct) {
    PreparedHeader header;
    std::string notes;
    for (const std::string& note : ct.notes) notes += note + '\n';
    header.fingerprint = name;
    header.hash = hash_of(ct.hu, notes);
    header.notes = notes.size();
    for (int a = 0; a < 3; ++a) {
        header.size[a] = ct.grid.size[a];
        header.origin[a] = ct.grid.origin[a];
        for (int b = 0; b < 3; ++b) header.steps[3 * a + b] = ct.grid.steps[a][b];
    }
    std::string bytes(sizeof header + ct.hu.size() * sizeof(std::int16_t), '\0');
    std::memcpy(bytes.data(), &header, sizeof header);
    std::memcpy(bytes.data() + sizeof header, ct.hu.data(), ct.hu.size() * sizeof(std::int16_t));
    return bytes + notes;
}

CtImage prepared(const PatientFiles& files, const geometry::TriangleMesh& lumen, const Progress& progress) {
    CtImage ct = read_ct(files.ct, files.series, progress);
    const Mat3 turn = turn_by(files.rotation);
    ct.grid.origin = turn * ct.grid.origin + files.shift;
    for (Vec3& step : ct.grid.steps) step = turn * step;
    if (const std::string note = require_fit(ct, lumen, files); !note.empty()) ct.notes.push_back(note);
    if (!files.keep_table) {
        if (progress) progress(0.0, "finding the body in the CT");
        remove_surroundings(ct, files.ct);
    }
    if (!files.keep_contrast) {
        if (progress) progress(0.7, "replacing the CT's contrast by blood");
        replace_contrast(ct, lumen);
    }
    // Noise below air, or what a scanner writes outside its field of view, is air.
    for (std::int16_t& hu : ct.hu) hu = std::max(hu, air);
    crop(ct);
    continue_beyond(ct);
    interpolate_means(ct);
    return ct;
}

}  // namespace

render::DensityVolume ct_volume(const PatientFiles& files, const geometry::TriangleMesh& lumen,
                                const anatomy::ModelCache& cache) {
    try {
        const std::uint64_t name = fingerprint(files, lumen);
        const anatomy::CachePlace place(cache, fmt::format("ct-{:016x}.bin", name));
        std::optional<CtImage> ct;
        if (place.exists()) ct = kept(place.path(), name);
        if (ct) {
            place.used();
        } else {
            anatomy::count(anatomy::Made::Volume);
            ct = prepared(files, lumen, cache.progress);
            if (place.exists()) place.keep_file(prepared_bytes(name, *ct));
        }
        if (cache.note)
            for (const std::string& note : ct->notes)
                cache.note(fmt::format("{}: {}", files.ct.filename().string(), note));
        return {"CT", ct->grid, std::move(ct->hu), materials_of_hounsfield()};
    } catch (const io::InputError& error) {
        throw io::InputError(files.place.file.empty() ? error.what()
                                                      : fmt::format("{}\n  (asked for by {})", error.what(),
                                                                    io::located(files.place, "patient.ct")));
    }
}

namespace {

anatomy::TakenAxes axes_of(const PatientMesh& mesh, const std::optional<anatomy::StatedAxes>& stated) {
    return anatomy::taken_axes(mesh.file.string(), stated, mesh.axes,
                               fmt::format("axes = \"{}\"", mesh.axes));
}

}  // namespace

std::vector<std::string> mesh_notes(const PatientFiles& files) {
    std::vector<std::string> notes;
    for (const PatientMesh& mesh : files.meshes) {
        const anatomy::TakenAxes axes = axes_of(mesh, anatomy::load_stated_mesh(mesh.file).axes);
        if (axes.axes == "ras")
            notes.push_back(fmt::format("{} is in RAS (+x right, +y front), {}",
                                        mesh.file.filename().string(), axes.why));
    }
    return notes;
}

std::vector<render::TissueLayer> mesh_layers(const PatientFiles& files) {
    std::vector<render::TissueLayer> layers;
    const Mat3 turn = turn_by(files.rotation);
    for (const PatientMesh& wanted : files.meshes) {
        render::TissueLayer layer;
        layer.name = wanted.file.stem().string();
        layer.material = wanted.material;
        layer.inside = wanted.inside;
        try {
            anatomy::StatedMesh read = anatomy::load_stated_mesh(wanted.file);
            layer.mesh = std::move(read.mesh);
            const bool ras = axes_of(wanted, read.axes).axes == "ras";
            const Mat3 own = turn_by(wanted.rotation) * Vec3(ras ? -1 : 1, ras ? -1 : 1, 1).asDiagonal();
            const bool as_it_is = own == Mat3::Identity() && wanted.unit == 1 && wanted.shift == Vec3::Zero();
            for (Vec3& v : layer.mesh.vertices)
                if (!as_it_is) v = wanted.unit * (own * v) + wanted.shift;
            render::require_closed(wanted.file.string(), layer.mesh);
        } catch (const std::runtime_error& error) {
            throw io::InputError(io::located(wanted.place, error.what()));
        }
        for (Vec3& v : layer.mesh.vertices) {
            v = turn * v + files.shift;
            if (!(v.cwiseAbs().maxCoeff() <= anatomy::largest_coordinate))
                throw io::InputError(io::located(
                    wanted.place,
                    fmt::format("{}: a corner at ({:g}, {:g}, {:g}) mm; expected coordinates up to {:g} mm",
                                wanted.file.string(), v.x(), v.y(), v.z(), anatomy::largest_coordinate)));
        }
        if (geometry::signed_volume(layer.mesh) < 0)
            for (auto& triangle : layer.mesh.triangles) std::swap(triangle[1], triangle[2]);
        layers.push_back(std::move(layer));
    }
    return layers;
}

}  // namespace patient
