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
#include "engine/patient/ct_samples.h"
#include "engine/patient/hounsfield.h"
#include "engine/patient/mesh_coverage.h"
#include "physics/geometry/parallel.h"

namespace patient {

namespace fs = std::filesystem;
using geometry::Vec3;

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
    CtImage ct{grid, std::vector<std::int16_t>(grid.count())};
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
