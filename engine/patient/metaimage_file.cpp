#include <array>
#include <cmath>
#include <fmt/format.h>
#include <map>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

/// The lines "Name = value" of a header.
struct MetaHeader {
    const fs::path& path;
    std::map<std::string, std::string> fields = {};  // names in lower case
    std::uint64_t end = 0;                           // behind the last line, which names the data [bytes]

    [[noreturn]] void refuse(const std::string& key, const std::string& accepted) const {
        const auto found = fields.find(key);
        refuse_ct(path,
                  found == fields.end()
                      ? fmt::format("no '{}' was found in its header", key)
                      : fmt::format("'{} = {}' was found", key, found->second.substr(0, 80)),
                  accepted);
    }
    std::string given(std::initializer_list<const char*> keys, const std::string& otherwise) const {
        for (const char* key : keys)
            if (const auto found = fields.find(key); found != fields.end()) return found->second;
        return otherwise;
    }
    bool flag(const char* key) const { return io::lower_case(given({key}, "false")) == "true"; }
    template <std::size_t N>
    std::array<double, N> numbers(std::initializer_list<const char*> keys,
                                  const std::string& otherwise) const {
        const std::string text = given(keys, otherwise);
        const std::vector<std::string_view> parts = io::words_of(text);
        std::array<double, N> result{};
        for (std::size_t i = 0; i < N; ++i) {
            const std::optional<double> number =
                parts.size() == N ? io::parse_number(parts[i]) : std::nullopt;
            if (!number || !std::isfinite(*number))
                refuse(*keys.begin(), fmt::format("expected {} finite numbers", N));
            result[i] = *number;
        }
        return result;
    }
};

MetaHeader read_meta_header(const fs::path& path) {
    constexpr std::size_t longest = 1 << 16;
    std::ifstream file(path, std::ios::binary);
    std::string text(longest, '\0');
    file.read(text.data(), longest);
    text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    MetaHeader header{path};
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view line = io::trimmed(std::string_view(text).substr(begin, end - begin));
        const std::size_t sign = line.find('=');
        if (sign == std::string_view::npos && !line.empty())
            refuse_ct(path, fmt::format("the line '{}' was found in its header", line.substr(0, 40)),
                      "expected a MetaImage (.mha, .mhd), whose lines are 'Name = value'");
        begin = std::min(end + 1, text.size());
        if (line.empty()) continue;
        const std::string key = io::lower_case(io::trimmed(line.substr(0, sign)));
        if (!header.fields.emplace(key, io::trimmed(line.substr(sign + 1))).second)
            header.refuse(key, "expected one line of each field");
        header.end = begin;
        if (key == "elementdatafile") return header;
    }
    refuse_ct(path, "no 'ElementDataFile' was found in its header", "expected a MetaImage (.mha, .mhd)");
}

io::NumberType meta_type(const MetaHeader& header) {
    constexpr io::NumberNames names = {"met_char",  "met_uchar", "met_short",     "met_ushort",
                                       "met_int",   "met_uint",  "met_long_long", "met_ulong_long",
                                       "met_float", "met_double"};
    const auto type = io::number_type_named(io::lower_case(header.given({"elementtype"}, "")), names);
    if (!type) header.refuse("elementtype", "expected a type of whole numbers, MET_FLOAT or MET_DOUBLE");
    return *type;
}

render::VolumeGrid meta_grid(const MetaHeader& header) {
    if (header.given({"ndims"}, "") != "3")
        header.refuse("ndims", "expected three dimensions: save one volume in a file");
    if (header.given({"elementnumberofchannels"}, "1") != "1")
        header.refuse("elementnumberofchannels", "expected one value a sample");
    render::VolumeGrid grid;
    const auto size = header.numbers<3>({"dimsize"}, "");
    const auto spacing = header.numbers<3>({"elementspacing"}, "1 1 1");
    const auto origin = header.numbers<3>({"offset", "position", "origin"}, "0 0 0");
    const auto turn = header.numbers<9>({"transformmatrix", "rotation", "orientation"}, "1 0 0 0 1 0 0 0 1");
    // A MetaImage's axes are those of DICOM: left, back, head; a row of its matrix is the direction of an
    // axis.
    for (std::size_t a = 0; a < 3; ++a) {
        if (!(size[a] == std::floor(size[a]) && size[a] >= 1 && size[a] <= 32768))
            header.refuse("dimsize", "expected three whole numbers from 2 to 32768");
        grid.size[a] = static_cast<int>(size[a]);
        grid.origin[static_cast<int>(a)] = origin[a];
        grid.steps[a] = spacing[a] * Vec3(turn[3 * a], turn[3 * a + 1], turn[3 * a + 2]);
    }
    return grid;
}

/// Whether it says where it lies, and so is more than a stack of pixels.
bool is_placed(const MetaHeader& header) {
    return !header.given({"offset", "position", "origin"}, "").empty() &&
           !header.given({"elementspacing"}, "").empty();
}

/// Empty where the samples follow the header.
std::optional<fs::path> meta_data_file(const MetaHeader& header) {
    const std::string name = header.given({"elementdatafile"}, "");
    if (io::lower_case(name) == "local") return std::nullopt;
    if (name.empty() || io::lower_case(name).starts_with("list") || name.find('%') != std::string::npos)
        header.refuse("elementdatafile", "expected LOCAL or the name of one file");
    return io::file_beside(header.path, "ElementDataFile", name);
}

std::vector<std::int16_t> samples_of(const fs::path& path, const Progress& progress, SampleKind kind,
                                     render::VolumeGrid& grid, SampleFindings& findings) {
    const MetaHeader header = read_meta_header(path);
    const io::NumberType type = meta_type(header);
    grid = meta_grid(header);
    require_usable(path, grid);
    if (!is_placed(header))
        refuse_ct(path, "its header does not say where it lies in the patient",
                  "expected Offset and ElementSpacing");
    if (io::lower_case(header.given({"binarydata"}, "true")) != "true")
        header.refuse("binarydata", "expected True");
    const std::optional<fs::path> apart = meta_data_file(header);
    const fs::path data = apart.value_or(path);
    io::require_no_device(data);
    std::uint64_t begin = apart ? 0 : header.end;
    const bool packed = header.flag("compresseddata");
    if (const std::string skip = header.given({"headersize"}, "0"); skip == "-1" && !packed) {
        std::error_code failed;
        const std::uint64_t size = fs::file_size(data, failed), needed = grid.count() * io::size_of(type);
        if (!failed && size >= needed) begin = size - needed;
    } else if (const std::optional<int> bytes = io::parse_integer(skip); bytes && *bytes >= 0) {
        begin += static_cast<std::uint64_t>(*bytes);
    } else {
        header.refuse("headersize", "expected 0 or more bytes, or -1");
    }
    ByteSource source(data, begin, packed ? Packing::Deflate : Packing::None);
    const bool big_endian = header.flag("binarydatabyteordermsb") || header.flag("elementbyteordermsb");
    return read_samples(source, data, grid.count(), type, big_endian, {}, progress, kind, findings);
}

}  // namespace

std::vector<fs::path> metaimage_data_files(const fs::path& path) {
    const auto file = meta_data_file(read_meta_header(path));
    return file ? std::vector{*file} : std::vector<fs::path>{};
}

CtImage read_metaimage(const fs::path& path, const Progress& progress) {
    CtImage ct;
    SampleFindings findings;
    ct.hu = samples_of(path, progress, SampleKind::Hounsfield, ct.grid, findings);
    findings.tell(ct);
    return ct;
}

LabelImage read_metaimage_labels(const fs::path& path, const Progress& progress) {
    LabelImage labels;
    SampleFindings findings;
    labels.values = samples_of(path, progress, SampleKind::Labels, labels.grid, findings);
    labels.fractions = findings.fractions;
    return labels;
}

}  // namespace patient
