#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <nifti2_io.h>

#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

std::optional<io::NumberType> sample_type(int datatype) {
    constexpr int of_types[] = {DT_INT8,   DT_UINT8, DT_INT16,  DT_UINT16,  DT_INT32,
                                DT_UINT32, DT_INT64, DT_UINT64, DT_FLOAT32, DT_FLOAT64};
    const auto at = std::ranges::find(of_types, datatype);
    if (at == std::end(of_types)) return std::nullopt;
    return static_cast<io::NumberType>(at - std::begin(of_types));
}

struct FreeImage {
    void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using Image = std::unique_ptr<nifti_image, FreeImage>;

Image interpreted(const nifti_1_header& header, const char* name) {
    return Image(nifti_convert_n1hdr2nim(header, name));
}
Image interpreted(const nifti_2_header& header, const char* name) {
    return Image(nifti_convert_n2hdr2nim(header, name));
}

/// What libnifti makes of a header, and what the header alone says.
struct Interpreted {
    Image image;
    bool swapped = false;
    double data_begin = 0;  // [bytes]
};

/// `header` has its first four bytes, by which the versions differ. libnifti writes about a bad header to
/// stderr and trusts some of its numbers; what it would not stand is refused before.
template <class Header>
Interpreted interpret(ByteSource& source, const fs::path& path, std::int32_t first, bool swapped) {
    constexpr int version = sizeof(Header) == sizeof(nifti_1_header) ? 1 : 2;
    Header header;
    std::memcpy(&header, &first, sizeof first);
    source.read(reinterpret_cast<char*>(&header) + sizeof first, sizeof header - sizeof first);
    if (std::memcmp(header.magic, version == 1 ? "n+1" : "n+2", 4) != 0)
        refuse_ct(path, "no mark of NIfTI with its samples in the same file was found",
                  "expected one file .nii or .nii.gz");
    if (swapped) swap_nifti_header(&header, version);
    bool fine = header.dim[0] >= 3 && header.dim[0] <= 7;
    for (int a = 1; fine && a <= header.dim[0]; ++a)
        fine = a <= 3 ? header.dim[a] >= 1 && header.dim[a] <= 32768 : header.dim[a] == 1;
    if (!fine)
        refuse_ct(path,
                  fmt::format("an image of {} dimensions, {} × {} × {} × {}, was found", header.dim[0],
                              header.dim[1], header.dim[2], header.dim[3], header.dim[4]),
                  "expected three dimensions of up to 32768 samples");
    // Beyond those of the image they mean nothing.
    for (int a = header.dim[0] + 1; a < 8; ++a) header.dim[a] = 1;
    if (!sample_type(header.datatype))
        refuse_ct(path, fmt::format("samples of type {} were found", header.datatype),
                  "expected whole numbers and floating-point numbers, one for each sample");
    const double begin = static_cast<double>(header.vox_offset);
    if (!(begin >= sizeof header && begin < 1e8))
        refuse_ct(path, fmt::format("samples that begin at byte {:.4g} were found", begin),
                  fmt::format("expected {} to 100000000", sizeof header));
    Interpreted result{interpreted(header, path.c_str()), swapped, begin};
    if (!result.image) refuse_ct(path, "libnifti does not accept its header", "expected a whole .nii file");
    return result;
}

render::VolumeGrid nifti_grid(const fs::path& path, const nifti_image& image) {
    render::VolumeGrid grid;
    grid.size = {static_cast<int>(image.nx), static_cast<int>(image.ny), static_cast<int>(image.nz)};
    if (image.sform_code <= 0 && image.qform_code <= 0)
        refuse_ct(path, "neither its qform nor its sform places it in the patient",
                  "expected a file that dcm2niix, 3D Slicer or ITK-SNAP wrote, which has one");
    const auto& to_ras = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
    double unit = 1;
    if (image.xyz_units == NIFTI_UNITS_METER) unit = 1e3;
    if (image.xyz_units == NIFTI_UNITS_MICRON) unit = 1e-3;
    // NIfTI counts from left to right and from back to front: +x right, +y front.
    for (int row = 0; row < 3; ++row) {
        const double sign = row < 2 ? -unit : unit;
        for (int a = 0; a < 3; ++a) grid.steps[a][row] = sign * static_cast<double>(to_ras.m[row][a]);
        grid.origin[row] = sign * static_cast<double>(to_ras.m[row][3]);
    }
    return grid;
}

}  // namespace

CtImage read_nifti(const fs::path& path, const Progress& progress) {
    nifti_set_debug_level(0);
    ByteSource source(path, 0, is_gzip(path));
    std::int32_t first = 0;
    source.read(&first, sizeof first);
    const auto turned = static_cast<std::int32_t>(__builtin_bswap32(static_cast<std::uint32_t>(first)));
    Interpreted header;
    std::size_t taken = 0;
    constexpr std::int32_t size_1 = sizeof(nifti_1_header), size_2 = sizeof(nifti_2_header);
    if (first == size_1 || turned == size_1) {
        header = interpret<nifti_1_header>(source, path, first, turned == size_1);
        taken = size_1;
    } else if (first == size_2 || turned == size_2) {
        header = interpret<nifti_2_header>(source, path, first, turned == size_2);
        taken = size_2;
    } else {
        refuse_ct(path, "no header of NIfTI was found", "expected a file .nii or .nii.gz");
    }
    const nifti_image& image = *header.image;
    CtImage ct;
    ct.grid = nifti_grid(path, image);
    require_usable(path, ct.grid);
    Rescale rescale;
    if (image.scl_slope != 0) rescale = {image.scl_slope, image.scl_inter};
    if (!std::isfinite(rescale.slope) || !std::isfinite(rescale.intercept))
        refuse_ct(path, "its rescale slope or intercept is not finite", "expected finite numbers");
    source.skip(static_cast<std::uint64_t>(header.data_begin) - taken);
    ct.hu = read_samples(source, path, ct.grid.count(), *sample_type(image.datatype),
                         header.swapped != (std::endian::native == std::endian::big), rescale, progress);
    return ct;
}

}  // namespace patient
