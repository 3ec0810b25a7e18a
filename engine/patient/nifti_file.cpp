#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <nifti2_io.h>

#include "engine/io/text.h"
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
    bool apart = false;     // the samples lie in a file .img
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
    const bool apart = std::memcmp(header.magic, version == 1 ? "ni1" : "ni2", 4) == 0;
    if (!apart && std::memcmp(header.magic, version == 1 ? "n+1" : "n+2", 4) != 0)
        refuse_ct(path, "no mark of NIfTI was found", "expected .nii, .nii.gz, or .hdr with its .img");
    if (swapped) swap_nifti_header(&header, version);
    bool fine = header.dim[0] >= 3 && header.dim[0] <= 7;
    for (int a = 1; fine && a <= header.dim[0]; ++a)
        fine = a <= 3 ? header.dim[a] >= 1 && header.dim[a] <= 32768 : header.dim[a] == 1;
    if (!fine)
        refuse_ct(path,
                  fmt::format("an image of {} dimensions, {} × {} × {} × {}, was found", header.dim[0],
                              header.dim[1], header.dim[2], header.dim[3], header.dim[4]),
                  "expected three dimensions of up to 32768 samples: save one volume in a file");
    // Beyond those of the image they mean nothing.
    for (int a = header.dim[0] + 1; a < 8; ++a) header.dim[a] = 1;
    if (!sample_type(header.datatype))
        refuse_ct(path, fmt::format("samples of type {} were found", header.datatype),
                  "expected whole numbers and floating-point numbers, one for each sample");
    // 0 stands for the first place: behind the header and four bytes that say that no extension follows.
    constexpr int extension = 4;
    const double stated = static_cast<double>(header.vox_offset);
    const double begin = stated == 0 && !apart ? static_cast<double>(sizeof header + extension) : stated;
    if (!(begin >= (apart ? 0.0 : static_cast<double>(sizeof header)) && begin < 1e8))
        refuse_ct(path, fmt::format("samples that begin at byte {:.4g} were found", begin),
                  fmt::format("expected 0, or {} to 100000000", apart ? 0 : sizeof header));
    Interpreted result{interpreted(header, path.c_str()), swapped, apart, begin};
    if (!result.image) refuse_ct(path, "libnifti does not accept its header", "expected a whole .nii file");
    return result;
}

/// Largest distance between the places of a corner by both of its transformations [in the file's unit].
template <class Matrix>
double apart_by(const nifti_image& image, const Matrix& a, const Matrix& b) {
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const double at[] = {corner & 1 ? static_cast<double>(image.nx - 1) : 0.0,
                             corner & 2 ? static_cast<double>(image.ny - 1) : 0.0,
                             corner & 4 ? static_cast<double>(image.nz - 1) : 0.0, 1};
        geometry::Vec3 away = geometry::Vec3::Zero();
        for (int row = 0; row < 3; ++row)
            for (int k = 0; k < 4; ++k)
                away[row] += at[k] * (static_cast<double>(a.m[row][k]) - static_cast<double>(b.m[row][k]));
        most = std::max(most, away.norm());
    }
    return most;
}

/// Its place, and a note where it states two.
render::VolumeGrid nifti_grid(const fs::path& path, const nifti_image& image,
                              std::vector<std::string>& notes) {
    render::VolumeGrid grid;
    grid.size = {static_cast<int>(image.nx), static_cast<int>(image.ny), static_cast<int>(image.nz)};
    if (image.sform_code <= 0 && image.qform_code <= 0)
        refuse_ct(path, "neither its qform nor its sform places it in the patient",
                  "expected a file that dcm2niix, 3D Slicer or ITK-SNAP wrote, which has one");
    const auto& to_ras = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
    double unit = 1;
    if (image.xyz_units == NIFTI_UNITS_METER) unit = 1e3;
    if (image.xyz_units == NIFTI_UNITS_MICRON) unit = 1e-3;
    constexpr double worth_a_word = 0.5;  // [mm]
    if (image.sform_code > 0 && image.qform_code > 0)
        if (const double by = unit * apart_by(image, image.sto_xyz, image.qto_xyz); by > worth_a_word)
            notes.push_back(fmt::format(
                "its sform and its qform place it up to {:.3g} mm apart; the sform was taken", by));
    // NIfTI counts from left to right and from back to front: +x right, +y front.
    for (int row = 0; row < 3; ++row) {
        const double sign = row < 2 ? -unit : unit;
        for (int a = 0; a < 3; ++a) grid.steps[a][row] = sign * static_cast<double>(to_ras.m[row][a]);
        grid.origin[row] = sign * static_cast<double>(to_ras.m[row][3]);
    }
    return grid;
}

}  // namespace

namespace {

/// Names of labels that the file has behind its header, as TotalSegmentator writes them in Caret's manner:
/// <Label Key="52" …><![CDATA[aorta]]></Label>.
std::vector<LabelImage::Name> names_in(std::string_view text) {
    std::vector<LabelImage::Name> names;
    for (std::size_t at = 0; (at = text.find("<Label Key=\"", at)) != std::string_view::npos;) {
        at += std::string_view("<Label Key=\"").size();
        const std::size_t quote = text.find('"', at), open = text.find('>', at),
                          close = text.find("</Label>", at);
        if (quote == std::string_view::npos || open == std::string_view::npos ||
            close == std::string_view::npos || open > close || quote > open)
            break;
        std::string_view name = text.substr(open + 1, close - open - 1);
        if (constexpr std::string_view data = "<![CDATA["; name.starts_with(data) && name.ends_with("]]>"))
            name = name.substr(data.size(), name.size() - data.size() - 3);
        if (const auto value = io::parse_integer(text.substr(at, quote - at)))
            names.push_back({*value, 0, std::string(name)});
    }
    return names;
}

/// The extension without .gz, in lower case.
std::string kind_of(fs::path path) {
    if (path.extension() == ".gz") path.replace_extension();
    return io::lower_case(path.extension().string());
}

/// The other file of a pair .hdr and .img, beside it.
fs::path beside(const fs::path& path, const std::string& kind) {
    fs::path base = path;
    if (base.extension() == ".gz") base.replace_extension();
    std::string upper = kind;
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    std::error_code failed;
    for (const std::string& ending : {kind, kind + ".gz", upper})
        if (const fs::path file = fs::path(base).replace_extension(ending); fs::is_regular_file(file, failed))
            return file;
    refuse_ct(path, kind == ".img" ? "no file with its samples lies beside it" : "no header lies beside it",
              fmt::format("expected {}", fs::path(base).replace_extension(kind).filename().string()));
}

/// The header of a pair, whichever of the two was named.
fs::path header_of(const fs::path& path) {
    return kind_of(path) == ".img" ? beside(path, ".hdr") : path;
}

/// `between` takes what lies between header and samples.
template <class Between, class Samples>
void read_nifti_parts(const fs::path& given, std::vector<std::string>& notes, const Between& between,
                      const Samples& samples) {
    nifti_set_debug_level(0);
    const fs::path path = header_of(given);
    const auto packing = [](const fs::path& file) {
        return is_gzip(file) ? Packing::Deflate : Packing::None;
    };
    ByteSource source(path, 0, packing(path));
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
        refuse_ct(path, "no header of NIfTI was found",
                  "expected a file .nii or .nii.gz, or a pair .hdr and .img");
    }
    const nifti_image& image = *header.image;
    const render::VolumeGrid grid = nifti_grid(path, image, notes);
    require_usable(path, grid);
    Rescale rescale;
    if (image.scl_slope != 0) rescale = {image.scl_slope, image.scl_inter};
    if (!std::isfinite(rescale.slope) || !std::isfinite(rescale.intercept))
        refuse_ct(path, "its rescale slope or intercept is not finite", "expected finite numbers");
    const bool big_endian = header.swapped != (std::endian::native == std::endian::big);
    if (!header.apart) {
        between(source, static_cast<std::uint64_t>(header.data_begin) - taken);
        return samples(source, path, grid, *sample_type(image.datatype), big_endian, rescale);
    }
    const fs::path file = beside(path, ".img");
    ByteSource data(file, 0, packing(file));
    data.skip(static_cast<std::uint64_t>(header.data_begin));
    samples(data, file, grid, *sample_type(image.datatype), big_endian, rescale);
}

}  // namespace

std::vector<fs::path> nifti_data_files(const fs::path& path) {
    const std::string kind = kind_of(path);
    if (kind != ".hdr" && kind != ".img") return {};
    return {beside(path, kind == ".hdr" ? ".img" : ".hdr")};
}

CtImage read_nifti(const fs::path& path, const Progress& progress) {
    CtImage ct;
    read_nifti_parts(
        path, ct.notes, [](ByteSource& source, std::uint64_t bytes) { source.skip(bytes); },
        [&](ByteSource& source, const fs::path& file, const render::VolumeGrid& grid, io::NumberType type,
            bool big_endian, Rescale rescale) {
            ct.grid = grid;
            SampleFindings findings;
            ct.hu = read_samples(source, file, grid.count(), type, big_endian, rescale, progress,
                                 SampleKind::Hounsfield, findings);
            findings.tell(ct);
        });
    return ct;
}

LabelImage read_nifti_labels(const fs::path& path, const Progress& progress) {
    LabelImage labels;
    std::vector<std::string> notes;
    read_nifti_parts(
        path, notes,
        [&](ByteSource& source, std::uint64_t bytes) {
            std::string text(std::min<std::uint64_t>(bytes, 1 << 20), '\0');
            source.read(text.data(), text.size());
            source.skip(bytes - text.size());
            labels.names = names_in(text);
        },
        [&](ByteSource& source, const fs::path& file, const render::VolumeGrid& grid, io::NumberType type,
            bool big_endian, Rescale rescale) {
            labels.grid = grid;
            SampleFindings findings;
            labels.values = read_samples(source, file, grid.count(), type, big_endian, rescale, progress,
                                         SampleKind::Labels, findings);
            labels.fractions = findings.fractions;
        });
    return labels;
}

}  // namespace patient
