#include <algorithm>
#include <fmt/format.h>
#include <map>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

std::string_view trimmed(std::string_view text) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
}

/// "(1,0,0)", finite; empty for anything else.
std::optional<geometry::Vec3> vector_of(std::string_view text) {
    text = trimmed(text);
    if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
    text = text.substr(1, text.size() - 2);
    const std::vector<std::string_view> parts = io::split(text, ',');
    if (parts.size() != 3) return std::nullopt;
    geometry::Vec3 result;
    for (int k = 0; k < 3; ++k) result[k] = io::parse_number(trimmed(parts[k])).value_or(std::nan(""));
    return result.allFinite() ? std::optional(result) : std::nullopt;
}

/// The fields of a header by their names in lower case, and where it ends.
struct Header {
    const fs::path& path;
    std::map<std::string, std::string> fields = {};
    std::uint64_t end = 0;  // behind the blank line [bytes]

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
            trimmed(std::string_view(text).substr(begin, std::min(end, text.size()) - begin));
        if (line.empty() && end != std::string::npos) {
            header.end = end + 1;
            break;
        }
        const std::size_t colon = line.find(':');
        // "key:=value" is of users, and '#' a remark.
        if (begin > 0 && colon != std::string_view::npos && line.front() != '#' &&
            !line.substr(colon).starts_with(":=")) {
            std::string key = io::lower_case(trimmed(line.substr(0, colon)));
            if (key == "datafile") key = "data file";
            if (key == "byteskip") key = "byte skip";
            if (key == "lineskip") key = "line skip";
            if (!header.fields.emplace(key, trimmed(line.substr(colon + 1))).second)
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

render::VolumeGrid nrrd_grid(const Header& header) {
    render::VolumeGrid grid;
    const char* const three = "expected three dimensions";
    if (header.need("dimension", three) != "3") header.refuse("dimension", three);
    const char* const counts = "expected three numbers from 2 to 32768";
    const std::vector<std::string_view> sizes = io::words_of(header.need("sizes", counts));
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
    for (int a = 0; a < 3; ++a) {
        const std::size_t end = directions.find(')');
        const auto step =
            end == std::string_view::npos ? std::nullopt : vector_of(directions.substr(0, end + 1));
        if (!step) header.refuse("space directions", directed);
        grid.steps[a] = space->second.cwiseProduct(*step);
        directions.remove_prefix(end + 1);
    }
    if (!trimmed(directions).empty()) header.refuse("space directions", directed);
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

std::vector<std::int16_t> ascii_samples(const fs::path& path, std::uint64_t begin, std::size_t count) {
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
        const std::optional<std::int16_t> sample = number ? as_hu(*number) : std::nullopt;
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

std::optional<fs::path> data_file(const Header& header) {
    const auto found = header.fields.find("data file");
    if (found == header.fields.end()) return std::nullopt;
    const std::string& name = found->second;
    if (name.empty() || io::lower_case(name).starts_with("list") || name.find('%') != std::string::npos)
        header.refuse("data file", "expected the name of one file");
    return header.path.parent_path() / name;
}

}  // namespace

std::optional<fs::path> detached_data(const fs::path& path) {
    return data_file(read_header(path));
}

CtImage read_nrrd(const fs::path& path, const Progress& progress) {
    const Header header = read_header(path);
    const io::NumberType type = type_of(header);
    CtImage ct;
    ct.grid = nrrd_grid(header);
    require_usable(path, ct.grid);
    const std::string encoding = io::lower_case(header.need("encoding", "expected raw, gzip or ascii"));
    const bool raw = encoding == "raw", gzip = encoding == "gzip" || encoding == "gz";
    const bool ascii = encoding == "ascii" || encoding == "text" || encoding == "txt";
    if (!raw && !gzip && !ascii) header.refuse("encoding", "expected raw, gzip or ascii");
    bool big_endian = false;
    if (!ascii && io::size_of(type) > 1) {
        const std::string endian = io::lower_case(header.need("endian", "expected little or big"));
        if (endian != "little" && endian != "big") header.refuse("endian", "expected little or big");
        big_endian = endian == "big";
    }
    const std::optional<fs::path> apart = data_file(header);
    const fs::path data = apart.value_or(path);
    io::require_no_device(data);
    std::uint64_t begin = apart ? 0 : header.end;
    const long long lines = skip_of(header, "line skip", false);
    const long long bytes = skip_of(header, "byte skip", raw);
    if (lines != 0) header.refuse("line skip", "expected 0");
    if (ascii) {
        if (bytes != 0) header.refuse("byte skip", "expected 0 with this encoding");
        ct.hu = ascii_samples(data, begin, ct.grid.count());
        return ct;
    }
    if (bytes < 0) {  // the samples are the last of the file
        std::error_code failed;
        const std::uint64_t size = fs::file_size(data, failed), needed = ct.grid.count() * io::size_of(type);
        if (!failed && size < needed)
            refuse_ct(data,
                      fmt::format("its header asks for {} bytes of samples; the file has {}", needed, size),
                      "expected a whole file");
        if (!failed) begin = size - needed;
    } else if (!gzip) {
        begin += static_cast<std::uint64_t>(bytes);
    }
    ByteSource source(data, begin, gzip);
    source.require(static_cast<double>(ct.grid.count()) * static_cast<double>(io::size_of(type)));
    if (gzip) source.skip(static_cast<std::uint64_t>(bytes));  // of what is decompressed
    ct.hu = read_samples(source, data, ct.grid.count(), type, big_endian, {}, progress);
    return ct;
}

}  // namespace patient
