#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

/// "(1,0,0)", finite; empty for anything else.
std::optional<geometry::Vec3> vector_of(std::string_view text) {
    text = io::trimmed(text);
    if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
    text = text.substr(1, text.size() - 2);
    const std::vector<std::string_view> parts = io::split(text, ',');
    if (parts.size() != 3) return std::nullopt;
    geometry::Vec3 result;
    for (int k = 0; k < 3; ++k) result[k] = io::parse_number(io::trimmed(parts[k])).value_or(std::nan(""));
    return result.allFinite() ? std::optional(result) : std::nullopt;
}

/// The fields of a header by their names in lower case, and where it ends.
struct Header {
    const fs::path& path;
    std::map<std::string, std::string> fields = {};
    std::map<std::string, std::string> own = {};  // "key:=value" of the program that wrote it
    std::vector<std::string> listed = {};         // lines behind "data file: LIST"
    std::uint64_t end = 0;                        // behind the blank line [bytes]

    [[noreturn]] void refuse(const std::string& key, const std::string& accepted) const {
        const auto found = fields.find(key);
        refuse_ct(path,
                  found == fields.end() ? fmt::format("no '{}' was found in its header", key)
                                        : fmt::format("'{}: {}' was found", key, found->second.substr(0, 80)),
                  accepted);
    }
    const std::string& need(const std::string& key, const std::string& accepted) const {
        const auto found = fields.find(key);
        if (found == fields.end()) refuse(key, accepted);
        return found->second;
    }
    std::string given(const std::string& key, const std::string& otherwise) const {
        const auto found = fields.find(key);
        return found == fields.end() ? otherwise : found->second;
    }
};

Header read_header(const fs::path& path) {
    constexpr std::size_t longest = 1 << 16;
    std::ifstream file(path, std::ios::binary);
    std::string text(longest, '\0');
    file.read(text.data(), longest);
    text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    if (!text.starts_with("NRRD000"))
        refuse_ct(path, "no header of NRRD was found", "expected a file .nrrd or .nhdr");
    Header header{path};
    std::size_t begin = 0;
    while (true) {
        const std::size_t end = text.find('\n', begin);
        if (end == std::string::npos) {
            // A detached header may end without a blank line.
            if (text.size() == longest)
                refuse_ct(path, "a header of more than 65536 bytes was found", "expected a shorter one");
            header.end = text.size();
        }
        const std::string_view line =
            io::trimmed(std::string_view(text).substr(begin, std::min(end, text.size()) - begin));
        if (line.empty() && end != std::string::npos) {
            header.end = end + 1;
            break;
        }
        if (const auto list = header.fields.find("data file");
            list != header.fields.end() && io::lower_case(list->second).starts_with("list")) {
            if (!line.empty()) header.listed.emplace_back(line);
            if (end == std::string::npos) break;
            begin = end + 1;
            continue;
        }
        const std::size_t colon = line.find(':');
        // "key:=value" is of users, and '#' a remark.
        if (const std::size_t sign = line.find(":="); sign != std::string_view::npos && sign == colon)
            header.own.emplace(line.substr(0, sign), line.substr(sign + 2));
        if (begin > 0 && colon != std::string_view::npos && line.front() != '#' &&
            !line.substr(colon).starts_with(":=")) {
            std::string key = io::lower_case(io::trimmed(line.substr(0, colon)));
            if (key == "datafile") key = "data file";
            if (key == "byteskip") key = "byte skip";
            if (key == "lineskip") key = "line skip";
            if (!header.fields.emplace(key, io::trimmed(line.substr(colon + 1))).second)
                header.refuse(key, "expected one line of each field");
        }
        if (end == std::string::npos) break;
        begin = end + 1;
    }
    return header;
}

io::NumberType type_of(const Header& header) {
    constexpr io::NumberNames names = {
        "signed char,int8,int8_t",
        "uchar,unsigned char,uint8,uint8_t",
        "short,short int,signed short,signed short int,int16,int16_t",
        "ushort,unsigned short,unsigned short int,uint16,uint16_t",
        "int,signed int,int32,int32_t",
        "uint,unsigned int,uint32,uint32_t",
        "longlong,long long,long long int,signed long long,signed long long int,"
        "int64,int64_t",
        "ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t",
        "float",
        "double"};
    const char* const accepted = "expected a type of whole numbers, float or double";
    const auto type = io::number_type_named(io::lower_case(header.need("type", accepted)), names);
    if (!type) header.refuse("type", accepted);
    return *type;
}

/// `layers`, where it is given, becomes the samples of each voxel, which a first axis of kind 'list' counts.
render::VolumeGrid nrrd_grid(const Header& header, int* layers = nullptr) {
    render::VolumeGrid grid;
    const char* const three = "expected three dimensions: save one volume in a file";
    const std::string dimension = header.need("dimension", three);
    const bool layered = layers && dimension == "4";
    if (dimension != "3" && !layered) header.refuse("dimension", three);
    const char* const counts = "expected three numbers from 2 to 32768";
    std::vector<std::string_view> sizes = io::words_of(header.need("sizes", counts));
    if (layered) {
        const std::string kinds = io::lower_case(header.need("kinds", three));
        if (!kinds.starts_with("list") && !kinds.starts_with("vector")) header.refuse("kinds", three);
        const std::optional<int> count = sizes.empty() ? std::nullopt : io::parse_integer(sizes[0]);
        if (!count || *count < 1 || *count > 1000) header.refuse("sizes", "expected 1 to 1000 layers");
        *layers = *count;
        sizes.erase(sizes.begin());
    }
    for (std::size_t a = 0; a < 3; ++a) {
        const std::optional<int> size = sizes.size() == 3 ? io::parse_integer(sizes[a]) : std::nullopt;
        if (!size) header.refuse("sizes", counts);
        grid.size[a] = *size;
    }
    // Signs that turn each space into left, posterior, superior.
    const std::map<std::string, geometry::Vec3> spaces = {
        {"left-posterior-superior", {1, 1, 1}},   {"lps", {1, 1, 1}},
        {"right-anterior-superior", {-1, -1, 1}}, {"ras", {-1, -1, 1}},
        {"left-anterior-superior", {1, -1, 1}},   {"las", {1, -1, 1}}};
    const char* const known =
        "expected left-posterior-superior, right-anterior-superior or left-anterior-superior";
    const auto space = spaces.find(io::lower_case(header.need("space", known)));
    if (space == spaces.end()) header.refuse("space", known);
    const char* const placed = "expected a vector such as (-120.5,-80,30)";
    const auto origin = vector_of(header.need("space origin", placed));
    if (!origin) header.refuse("space origin", placed);
    grid.origin = space->second.cwiseProduct(*origin);
    const char* const directed = "expected three vectors such as (0.7,0,0) (0,0.7,0) (0,0,1)";
    std::string_view directions = header.need("space directions", directed);
    if (layered) {
        directions = io::trimmed(directions);
        if (!directions.starts_with("none")) header.refuse("space directions", directed);
        directions.remove_prefix(4);
    }
    for (int a = 0; a < 3; ++a) {
        const std::size_t end = directions.find(')');
        const auto step =
            end == std::string_view::npos ? std::nullopt : vector_of(directions.substr(0, end + 1));
        if (!step) header.refuse("space directions", directed);
        grid.steps[a] = space->second.cwiseProduct(*step);
        directions.remove_prefix(end + 1);
    }
    if (!io::trimmed(directions).empty()) header.refuse("space directions", directed);
    if (const auto units = header.fields.find("space units"); units != header.fields.end()) {
        for (const std::string_view unit : io::words_of(units->second))
            if (unit != "\"mm\"" && unit != "mm" && unit != "\"\"")
                header.refuse("space units", "expected mm");
    }
    return grid;
}

/// The number of a field from 0 to 10⁹, or −1 where that is allowed; 0 when it is not given.
long long skip_of(const Header& header, const std::string& key, bool from_end) {
    const std::string text = header.given(key, "0");
    const std::optional<int> number = io::parse_integer(text);
    if (!number || *number > 1'000'000'000 || *number < (from_end ? -1 : 0))
        header.refuse(key, from_end ? "expected -1 to 1000000000" : "expected 0 to 1000000000");
    return *number;
}

std::vector<std::int16_t> ascii_samples(const fs::path& path, std::uint64_t begin, std::size_t count,
                                        SampleKind kind, SampleFindings& findings) {
    const std::string text = io::read_text(path, "CT", "expected a whole file");
    std::string_view left = std::string_view(text).substr(std::min<std::uint64_t>(begin, text.size()));
    // At least a digit and what parts it from the next.
    if (2.0 * static_cast<double>(count) - 1 > static_cast<double>(left.size()))
        refuse_ct(path,
                  fmt::format("its header asks for {} samples; {} bytes of text follow", count, left.size()),
                  "expected a whole file");
    std::vector<std::int16_t> hu;
    hu.reserve(count);
    while (hu.size() < count) {
        while (!left.empty() && (left.front() == ',' || static_cast<unsigned char>(left.front()) <= ' '))
            left.remove_prefix(1);
        std::size_t end = 0;
        while (end < left.size() && left[end] != ',' && static_cast<unsigned char>(left[end]) > ' ') ++end;
        const std::optional<double> number = io::parse_number(left.substr(0, end));
        const std::optional<std::int16_t> sample = number ? findings.sample(*number, kind) : std::nullopt;
        if (!sample)
            refuse_ct(path,
                      fmt::format("'{}' was found for sample {} of {}",
                                  left.substr(0, std::min<std::size_t>(end, 20)), hu.size(), count),
                      "expected a finite number");
        hu.push_back(*sample);
        left.remove_prefix(end);
    }
    return hu;
}

/// Names of a pattern such as "slice%03d.raw 1 65 1", as printf makes them.
std::vector<std::string> names_of_pattern(const Header& header, const std::string& text) {
    const char* const accepted =
        "expected a name, LIST, or a pattern with its first and last number and step, such as slice%03d.raw "
        "1 65 1";
    constexpr int most = 32768;
    const std::vector<std::string_view> parts = io::words_of(text);
    const auto number = [&](std::size_t part) {
        return parts.size() > part ? io::parse_integer(parts[part]) : std::nullopt;
    };
    const auto first = number(1), last = number(2), step = number(3);
    if (!first || !last || !step || *step == 0 || *first < 0 || *last < 0)
        header.refuse("data file", accepted);
    const std::string_view pattern = parts[0];
    const std::size_t sign = pattern.find('%'), kind = pattern.find('d', sign);
    if (kind == std::string_view::npos || pattern.find('%', sign + 1) != std::string_view::npos)
        header.refuse("data file", accepted);
    const std::string_view format = pattern.substr(sign + 1, kind - sign - 1);
    const std::optional<int> width = format.empty() ? std::optional(0) : io::parse_integer(format);
    if (!width || *width < 0 || *width > 20) header.refuse("data file", accepted);
    const bool zeros = format.starts_with('0');
    std::vector<std::string> names;
    for (int n = *first; *step > 0 ? n <= *last : n >= *last; n += *step) {
        if (names.size() == most) header.refuse("data file", fmt::format("expected at most {} files", most));
        const std::string digits = zeros ? fmt::format("{:0{}}", n, *width) : fmt::format("{:{}}", n, *width);
        names.push_back(std::string(pattern.substr(0, sign)) + digits +
                        std::string(pattern.substr(kind + 1)));
    }
    if (names.empty()) header.refuse("data file", accepted);
    return names;
}

/// The files that a detached header names; none for one with its samples behind it.
std::vector<fs::path> data_files(const Header& header) {
    const auto found = header.fields.find("data file");
    if (found == header.fields.end()) return {};
    const std::string& text = found->second;
    std::vector<std::string> names;
    if (io::lower_case(text).starts_with("list"))
        names = header.listed;
    else if (text.find('%') != std::string::npos)
        names = names_of_pattern(header, text);
    else
        names = {text};
    if (names.empty() || names.front().empty())
        header.refuse("data file", "expected the names of files behind it");
    std::vector<fs::path> files;
    for (const std::string& name : names) files.push_back(io::file_beside(header.path, "data file", name));
    return files;
}

}  // namespace

std::vector<fs::path> nrrd_data_files(const fs::path& path) {
    return data_files(read_header(path));
}

namespace {

/// How the samples of a header's files are stored.
struct Storage {
    io::NumberType type;
    Packing packing = Packing::None;
    bool ascii = false, big_endian = false;
    long long lines = 0, bytes = 0;  // to skip, first lines; −1 bytes: the samples are the last of the file
};

Storage storage_of(const Header& header) {
    const char* const accepted = "expected raw, gzip, bzip2, hex or ascii";
    Storage storage{type_of(header)};
    const std::string encoding = io::lower_case(header.need("encoding", accepted));
    const auto is = [&](std::initializer_list<const char*> names) {
        return std::ranges::any_of(names, [&](const char* name) { return encoding == name; });
    };
    storage.ascii = is({"ascii", "text", "txt"});
    if (is({"gzip", "gz"}))
        storage.packing = Packing::Deflate;
    else if (is({"bzip2", "bz2"}))
        storage.packing = Packing::Bzip2;
    else if (is({"hex"}))
        storage.packing = Packing::Hex;
    else if (!storage.ascii && encoding != "raw")
        header.refuse("encoding", accepted);
    if (!storage.ascii && io::size_of(storage.type) > 1) {
        const std::string endian = io::lower_case(header.need("endian", "expected little or big"));
        if (endian != "little" && endian != "big") header.refuse("endian", "expected little or big");
        storage.big_endian = endian == "big";
    }
    storage.lines = skip_of(header, "line skip", false);
    storage.bytes = skip_of(header, "byte skip", encoding == "raw");
    if (storage.ascii && storage.bytes != 0) header.refuse("byte skip", "expected 0 with this encoding");
    return storage;
}

/// Where the line after so many begins.
std::uint64_t behind_lines(const fs::path& path, std::uint64_t begin, long long lines) {
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(begin));
    for (long long n = 0; n < lines; ++n) {
        file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
        if (!file)
            refuse_ct(path, fmt::format("the file ends after {} of {} lines to skip", n, lines),
                      "expected a whole file");
    }
    return lines == 0 ? begin : static_cast<std::uint64_t>(file.tellg());
}

/// `count` samples of one file, from `begin` on.
std::vector<std::int16_t> samples_of_file(const fs::path& data, std::uint64_t begin, const Storage& storage,
                                          std::size_t count, const Progress& progress, SampleKind kind,
                                          SampleFindings& findings) {
    io::require_no_device(data);
    begin = behind_lines(data, begin, storage.lines);
    if (storage.ascii) return ascii_samples(data, begin, count, kind, findings);
    if (storage.bytes < 0) {  // the samples are the last of the file
        std::error_code failed;
        const std::uint64_t size = fs::file_size(data, failed), needed = count * io::size_of(storage.type);
        if (!failed && size < needed)
            refuse_ct(data,
                      fmt::format("its header asks for {} bytes of samples; the file has {}", needed, size),
                      "expected a whole file");
        if (!failed) begin = size - needed;
    } else if (storage.packing == Packing::None) {
        begin += static_cast<std::uint64_t>(storage.bytes);
    }
    ByteSource source(data, begin, storage.packing);
    source.require(static_cast<double>(count) * static_cast<double>(io::size_of(storage.type)));
    if (storage.packing != Packing::None)
        source.skip(static_cast<std::uint64_t>(storage.bytes));  // of what is unpacked
    return read_samples(source, data, count, storage.type, storage.big_endian, {}, progress, kind, findings);
}

/// `count` samples of a volume, from one file, or the same number from each of several.
std::vector<std::int16_t> nrrd_samples(const Header& header, std::size_t count, const Progress& progress,
                                       SampleKind kind, SampleFindings& findings) {
    const Storage storage = storage_of(header);
    const std::vector<fs::path> files = data_files(header);
    if (files.empty())
        return samples_of_file(header.path, header.end, storage, count, progress, kind, findings);
    if (count % files.size() != 0)
        header.refuse("data file", fmt::format("expected as many samples in each of {} files, of {} in all",
                                               files.size(), count));
    const std::size_t in_each = count / files.size();
    if (files.size() == 1) return samples_of_file(files[0], 0, storage, count, progress, kind, findings);
    std::vector<std::int16_t> all;
    all.reserve(count);
    for (std::size_t k = 0; k < files.size(); ++k) {
        if (progress) progress(static_cast<double>(k) / static_cast<double>(files.size()), "reading the CT");
        const std::vector<std::int16_t> some =
            samples_of_file(files[k], 0, storage, in_each, {}, kind, findings);
        all.insert(all.end(), some.begin(), some.end());
    }
    return all;
}

/// Slicer's Segment3_Name, Segment3_LabelValue, Segment3_Layer.
std::vector<LabelImage::Name> segments_of(const Header& header) {
    std::vector<LabelImage::Name> names;
    for (int s = 0; s < 10000; ++s) {
        const auto field = [&](const char* key) -> std::optional<std::string> {
            const auto found = header.own.find(fmt::format("Segment{}_{}", s, key));
            if (found == header.own.end()) return std::nullopt;
            return std::string(io::trimmed(found->second));
        };
        const auto name = field("Name"), id = field("ID");
        if (!name && !id) break;
        const auto number = [&](const char* key, int otherwise) {
            return io::parse_integer(field(key).value_or("")).value_or(otherwise);
        };
        names.push_back({number("LabelValue", 1), number("Layer", 0), name.value_or(id.value_or(""))});
    }
    return names;
}

}  // namespace

CtImage read_nrrd(const fs::path& path, const Progress& progress) {
    const Header header = read_header(path);
    type_of(header);
    CtImage ct;
    ct.grid = nrrd_grid(header);
    require_usable(path, ct.grid);
    SampleFindings findings;
    ct.hu = nrrd_samples(header, ct.grid.count(), progress, SampleKind::Hounsfield, findings);
    findings.tell(ct);
    return ct;
}

LabelImage read_nrrd_labels(const fs::path& path, const Progress& progress) {
    const Header header = read_header(path);
    type_of(header);
    LabelImage labels;
    labels.grid = nrrd_grid(header, &labels.layers);
    require_usable(path, labels.grid);
    const double samples = static_cast<double>(labels.grid.count()) * labels.layers;
    if (samples > most_samples)
        refuse_ct(
            path,
            fmt::format("{:.0f} million samples in {} layers were found", 1e-6 * samples, labels.layers),
            fmt::format("expected at most {:.0f} million", 1e-6 * most_samples));
    SampleFindings findings;
    labels.values = nrrd_samples(header, labels.grid.count() * static_cast<std::size_t>(labels.layers),
                                 progress, SampleKind::Labels, findings);
    labels.fractions = findings.fractions;
    labels.names = segments_of(header);
    return labels;
}

}  // namespace patient
