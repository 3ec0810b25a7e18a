#include "engine/patient/voxelise.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <nifti1.h>
#include <thread>
#include <zlib.h>

#include "engine/io/files.h"
#include "engine/patient/ct_image.h"
#include "engine/patient/ct_samples.h"
#include "physics/geometry/parallel.h"

namespace patient {

using geometry::Vec3;

MeshCoverage::MeshCoverage(const geometry::TriangleMesh& mesh, const render::VolumeGrid& grid, int lines)
    : size_(grid.size), lines_(lines) {
    const geometry::Mat3 to_index = grid.axes().inverse();
    // A grid that mirrors turns triangles inside out.
    const bool mirrored = grid.axes().determinant() < 0;
    int last = -1;
    first_ = size_[2];
    Vec3 lowest = Vec3::Constant(1e9), highest = -lowest;
    const auto layers_of = [&](const std::array<Vec3, 3>& t) {
        const auto [low, high] = std::minmax({t[0].z(), t[1].z(), t[2].z()});
        const auto within = [&](double k) {
            return static_cast<int>(std::clamp(std::floor(k + 0.5), -1.0, static_cast<double>(size_[2])));
        };
        return std::pair(within(low), within(high));
    };
    for (const auto& corners : mesh.triangles) {
        std::array<Vec3, 3> t;
        for (int c = 0; c < 3; ++c) t[c] = to_index * (mesh.vertices[corners[c]] - grid.origin);
        if (mirrored) std::swap(t[1], t[2]);
        const auto [low, high] = layers_of(t);
        if (high < 0 || low >= size_[2]) continue;
        first_ = std::min(first_, std::max(low, 0));
        last = std::max(last, std::min(high, size_[2] - 1));
        triangles_.push_back(t);
        for (const Vec3& corner : t) {
            lowest = lowest.cwiseMin(corner);
            highest = highest.cwiseMax(corner);
        }
    }
    if (last < 0) {
        first_ = 0;
        return;
    }
    const auto clamped = [&](double place, int axis) {
        return static_cast<int>(std::clamp(std::floor(place + 0.5), 0.0, static_cast<double>(size_[axis])));
    };
    // One voxel more, for what a line's rounding spreads.
    window_ = {clamped(lowest.x() - 1, 0), std::min(clamped(highest.x() + 2, 0), size_[0]),
               clamped(lowest.y() - 1, 1), std::min(clamped(highest.y() + 2, 1), size_[1])};
    touching_.resize(static_cast<std::size_t>(last - first_) + 1);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const auto [low, high] = layers_of(triangles_[i]);
        for (int k = std::max(low, first_); k <= std::min(high, last); ++k)
            touching_[static_cast<std::size_t>(k - first_)].push_back(static_cast<int>(i));
    }
}

namespace {

/// Where the edge meets the height z, which lies between its ends: the same bits from either side.
Vec3 cut(const Vec3& a, const Vec3& b, double z) {
    const bool ordered = std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    const Vec3 &from = ordered ? a : b, &to = ordered ? b : a;
    return from + (z - from.z()) / (to.z() - from.z()) * (to - from);
}

}  // namespace

void MeshCoverage::layer(int k, std::vector<float>& fractions) const {
    const int nx = size_[0], ny = size_[1];
    fractions.assign(static_cast<std::size_t>(nx) * ny, 0.0f);
    if (k < first_ || k >= end_layer()) return;
    const float weight = 1.0f / static_cast<float>(lines_ * lines_);
    // Each crossing of a line changes all voxels behind it: changes first, their sums after.
    for (const int index : touching_[static_cast<std::size_t>(k - first_)]) {
        const auto& t = triangles_[static_cast<std::size_t>(index)];
        for (int line = 0; line < lines_; ++line) {
            const double z = k + (line + 0.5) / lines_ - 0.5;
            const bool above[3] = {t[0].z() >= z, t[1].z() >= z, t[2].z() >= z};
            if (above[0] == above[1] && above[1] == above[2]) continue;
            Vec3 up = Vec3::Zero(), down = Vec3::Zero();
            for (int c = 0; c < 3; ++c) {
                const int next = (c + 1) % 3;
                if (above[c] != above[next]) (above[next] ? up : down) = cut(t[c], t[next], z);
            }
            if (up.y() == down.y()) continue;
            // Seen from outside, an edge leads up on the one side and down on the other: the ray along the
            // first axis enters where `down` has the larger second coordinate.
            const float sign = down.y() > up.y() ? weight : -weight;
            const double low = std::min(up.y(), down.y()), high = std::max(up.y(), down.y());
            const double per_y = (down.x() - up.x()) / (down.y() - up.y());
            // Line m is at y = (m + ½)/lines − ½; those with low ≤ y < high.
            const auto line_from = [&](double y) {
                return static_cast<int>(
                    std::clamp(std::ceil((y + 0.5) * lines_ - 0.5), 0.0, static_cast<double>(ny) * lines_));
            };
            for (int m = line_from(low); m < line_from(high); ++m) {
                const double y = (m + 0.5) / lines_ - 0.5;
                const double x = up.x() + (y - up.y()) * per_y;
                float* row = fractions.data() + static_cast<std::size_t>(m / lines_) * nx;
                if (x <= -0.5) {
                    row[0] += sign;
                    continue;
                }
                if (!(x < nx - 0.5)) continue;
                const int voxel = static_cast<int>(x + 0.5);
                const auto rest = static_cast<float>(voxel + 0.5 - x);
                row[voxel] += sign * rest;
                if (voxel + 1 < nx) row[voxel + 1] += sign * (1.0f - rest);
            }
        }
    }
    for (int j = window_.first_row; j < window_.end_row; ++j) {
        float* row = fractions.data() + static_cast<std::size_t>(j) * nx;
        for (int i = window_.first_column + 1; i < window_.end_column; ++i) row[i] += row[i - 1];
        // Behind the mesh only rounding is left.
        std::fill(row + window_.end_column, row + nx, 0.0f);
    }
}

namespace fs = std::filesystem;

CtImage voxelised(std::span<const render::TissueLayer> layers, const render::VolumeGrid& grid,
                  const Progress& progress) {
    const auto attenuation = [](render::Material m) { return render::attenuation(m, ct_energy); };
    const double air = attenuation(render::Material::Air);
    const std::size_t in_layer = static_cast<std::size_t>(grid.size[0]) * grid.size[1];
    struct Part {
        MeshCoverage coverage;
        float change;  // of μ [1/mm]
    };
    std::vector<Part> parts;
    for (const render::TissueLayer& layer : layers)
        if (layer.material != layer.inside)
            parts.push_back({MeshCoverage(layer.mesh, grid),
                             static_cast<float>(attenuation(layer.material) - attenuation(layer.inside))});
    CtImage ct{grid, std::vector<std::int16_t>(grid.count()), {}};
    const double of_nothing = hounsfield(0.0), per_attenuation = hounsfield(1.0) - of_nothing;
    geometry::parallel_for(
        grid.size[2], static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u)),
        [&](int k) {
            std::vector<float> sum(in_layer, static_cast<float>(air)), fractions;  // [1/mm]
            for (const auto& [coverage, change] : parts) {
                if (k < coverage.first_layer() || k >= coverage.end_layer()) continue;
                coverage.layer(k, fractions);
                const MeshCoverage::Window& window = coverage.window();
                for (int j = window.first_row; j < window.end_row; ++j) {
                    const std::size_t row = static_cast<std::size_t>(j) * grid.size[0];
                    for (std::size_t i = row + window.first_column; i < row + window.end_column; ++i)
                        sum[i] += change * fractions[i];
                }
            }
            std::int16_t* to = ct.hu.data() + in_layer * static_cast<std::size_t>(k);
            for (std::size_t i = 0; i < in_layer; ++i)
                to[i] = as_hu(of_nothing + per_attenuation * static_cast<double>(sum[i])).value_or(-1000);
        },
        [&](double part) {
            if (progress) progress(part, "voxels");
        },
        4);
    return ct;
}

render::VolumeGrid grid_around(const Vec3& low, const Vec3& high, double voxel) {
    render::VolumeGrid grid;
    constexpr int margin = 2;
    grid.origin = low - Vec3::Constant((margin - 0.5) * voxel);
    for (int a = 0; a < 3; ++a) {
        grid.steps[a] = voxel * Vec3::Unit(a);
        grid.size[a] = static_cast<int>(std::ceil((high[a] - low[a]) / voxel)) + 2 * margin;
    }
    return grid;
}

namespace {

std::string sample_bytes(const CtImage& ct) {
    static_assert(std::endian::native == std::endian::little, "files are written as little endian");
    return {reinterpret_cast<const char*>(ct.hu.data()), ct.hu.size() * sizeof(std::int16_t)};
}

std::string compressed(const std::string& text, const fs::path& path) {
    z_stream stream{};
    constexpr int gzip_window = 15 + 16, fast = 1, memory = 8;
    if (deflateInit2(&stream, fast, Z_DEFLATED, gzip_window, memory, Z_DEFAULT_STRATEGY) != Z_OK)
        refuse_ct(path, "there is no memory to compress it", "expected a smaller CT");
    std::string result(deflateBound(&stream, text.size()), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.next_out = reinterpret_cast<Bytef*>(result.data());
    // zlib counts in 32 bits.
    std::size_t in = text.size(), out = result.size();
    int state = Z_OK;
    while (state == Z_OK) {
        constexpr std::size_t most = 1 << 30;
        if (stream.avail_in == 0) {
            stream.avail_in = static_cast<uInt>(std::min(in, most));
            in -= stream.avail_in;
        }
        if (stream.avail_out == 0) {
            stream.avail_out = static_cast<uInt>(std::min(out, most));
            out -= stream.avail_out;
        }
        state = deflate(&stream, in == 0 ? Z_FINISH : Z_NO_FLUSH);
    }
    result.resize(stream.total_out);
    deflateEnd(&stream);
    return result;
}

std::string nifti_text(const CtImage& ct) {
    nifti_1_header header{};
    header.sizeof_hdr = sizeof header;
    header.dim[0] = 3;
    for (int a = 0; a < 3; ++a) {
        header.dim[a + 1] = static_cast<short>(ct.grid.size[a]);
        header.pixdim[a + 1] = static_cast<float>(ct.grid.steps[a].norm());
    }
    for (int a = 4; a < 8; ++a) header.dim[a] = 1;
    header.pixdim[0] = 1;
    header.datatype = DT_INT16;
    header.bitpix = 16;
    header.scl_slope = 1;
    header.xyzt_units = NIFTI_UNITS_MM;
    header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
    float* rows[3] = {header.srow_x, header.srow_y, header.srow_z};
    for (int row = 0; row < 3; ++row) {
        const double sign = row < 2 ? -1 : 1;  // to right, front, head
        for (int a = 0; a < 3; ++a) rows[row][a] = static_cast<float>(sign * ct.grid.steps[a][row]);
        rows[row][3] = static_cast<float>(sign * ct.grid.origin[row]);
    }
    constexpr std::size_t begin = sizeof header + 4;  // four zeros: no extensions
    header.vox_offset = begin;
    std::memcpy(header.magic, "n+1", 4);
    std::string text(begin, '\0');
    std::memcpy(text.data(), &header, sizeof header);
    return text + sample_bytes(ct);
}

std::string nrrd_text(const CtImage& ct, const fs::path& path) {
    const auto vector = [](const Vec3& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); };
    const render::VolumeGrid& grid = ct.grid;
    return fmt::format(
               "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
               "space directions: {} {} {}\nkinds: domain domain domain\nendian: little\nencoding: gzip\n"
               "space origin: {}\n\n",
               grid.size[0], grid.size[1], grid.size[2], vector(grid.steps[0]), vector(grid.steps[1]),
               vector(grid.steps[2]), vector(grid.origin)) +
           compressed(sample_bytes(ct), path);
}

}  // namespace

void check_ct_name(const fs::path& path) {
    const std::string name = path.filename().string();
    for (const char* ending : {".nii.gz", ".nii", ".nrrd"})
        if (name.ends_with(ending)) return;
    refuse_ct(path, "another kind of file is wanted", "expected .nii, .nii.gz or .nrrd");
}

void write_ct(const fs::path& path, const CtImage& ct) {
    check_ct_name(path);
    const std::string name = path.filename().string();
    if (name.ends_with(".nii.gz"))
        io::write_whole(path, compressed(nifti_text(ct), path));
    else if (name.ends_with(".nii"))
        io::write_whole(path, nifti_text(ct));
    else
        io::write_whole(path, nrrd_text(ct, path));
}

}  // namespace patient
