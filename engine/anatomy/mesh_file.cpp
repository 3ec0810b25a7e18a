#include "engine/anatomy/mesh_file.h"

#include <algorithm>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/ply_mesh.h"
#include "engine/anatomy/polydata.h"
#include "engine/anatomy/text_scanner.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/wall.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using nlohmann::json;

class GltfCheck {
public:
    GltfCheck(const std::string& text, const std::filesystem::path& path) : path_(path), text_(text) {}

    void run() {
        read_json();
        if (!root_.is_object() || !root_.contains("asset"))
            refuse("", "this is not glTF", "a JSON object with 'asset'");
        if (const json required = root_.value("extensionsRequired", json::array()); !required.empty())
            refuse("extensionsRequired", required.dump().substr(0, 60) + " was found",
                   "a file that needs no extensions, as without compression,");
        check_buffers();
        check_views();
        check_accessors();
        check_meshes();
        check_nodes();
    }

private:
    [[noreturn]] void refuse(const std::string& where, const std::string& found,
                             const std::string& accepted) const {
        throw io::InputError("{}: {}{}{}; expected {}", path_.string(), where, where.empty() ? "" : ": ",
                             found, accepted);
    }

    /// A binary container is a head of 12 bytes, a piece of JSON and one of bytes.
    void read_json() {
        std::string_view document = text_;
        if (text_.starts_with("glTF")) {
            if (text_.size() < 20 || word(4) != 2 || word(8) > text_.size())
                refuse("", fmt::format("{} bytes were found", text_.size()),
                       fmt::format("version 2 and {} bytes, as the head says,",
                                   text_.size() < 12 ? 20 : word(8)));
            const std::size_t length = word(12);
            if (word(16) != 0x4E4F534A || length > text_.size() - 20)
                refuse("", fmt::format("the first piece is not JSON of {} bytes", length), "a whole file");
            document = std::string_view(text_).substr(20, length);
            const std::size_t next = 20 + length;
            if (next + 8 <= text_.size()) {
                binary_ = word(next);
                if (binary_ > text_.size() - next - 8)
                    refuse("",
                           fmt::format("{} bytes of data are missing", binary_ - (text_.size() - next - 8)),
                           "a whole file");
            }
        }
        io::check_json_depth(document, path_.string());
        try {
            root_ = json::parse(document);
        } catch (const json::parse_error& error) {
            refuse("", fmt::format("its JSON is broken at byte {}", error.byte), "a whole file");
        } catch (const json::exception&) {
            refuse("", "a number of its JSON is too large", "a whole file");
        }
    }
    std::uint32_t word(std::size_t at) const {
        std::uint32_t value = 0;
        std::memcpy(&value, text_.data() + at, sizeof value);
        return value;
    }

    /// A list of objects, or an empty one.
    const json& list(const char* name) const {
        static const json none = json::array();
        if (!root_.contains(name)) return none;
        const json& found = root_.at(name);
        if (!found.is_array()) refuse(name, "it is no list", "a list of objects");
        for (const json& item : found)
            if (!item.is_object())
                refuse(name, item.dump().substr(0, 40) + " was found", "a list of objects");
        return found;
    }
    std::uint64_t whole(const json& item, const char* key, const std::string& where, std::uint64_t below,
                        std::optional<std::uint64_t> otherwise = {}) const {
        if (!item.contains(key) && otherwise) return *otherwise;
        const json value = item.value(key, json());
        if (!value.is_number_integer() || value.get<std::int64_t>() < 0 ||
            value.get<std::uint64_t>() >= below)
            refuse(fmt::format("{}: {}", where, key), value.dump().substr(0, 40) + " was found",
                   below == 0 ? "nothing" : fmt::format("0 to {}", below - 1));
        return value.get<std::uint64_t>();
    }

    void check_buffers() {
        const json& buffers = list("buffers");
        for (std::size_t i = 0; i < buffers.size(); ++i) {
            const std::string where = fmt::format("buffer {}", i);
            const std::uint64_t length = whole(buffers[i], "byteLength", where, std::uint64_t{1} << 31);
            std::uint64_t there = binary_;
            if (const json uri = buffers[i].value("uri", json()); uri.is_string()) {
                const std::string name = uri.get<std::string>();
                std::error_code unknown;
                there = name.starts_with("data:")
                            ? name.size() / 4 * 3
                            : std::filesystem::file_size(io::file_beside(path_, where, name), unknown);
                if (unknown)
                    refuse(where, fmt::format("'{}' cannot be read", name.substr(0, 60)),
                           "a file beside this one");
            }
            if (length > there)
                refuse(where, fmt::format("{} bytes are there", there),
                       fmt::format("{}, as it says,", length));
            buffers_.push_back(length);
        }
    }
    void check_views() {
        const json& views = list("bufferViews");
        for (std::size_t i = 0; i < views.size(); ++i) {
            const std::string where = fmt::format("bufferView {}", i);
            const std::uint64_t size =
                buffers_.empty() ? 0 : buffers_[whole(views[i], "buffer", where, buffers_.size())];
            const std::uint64_t offset = whole(views[i], "byteOffset", where, size + 1, 0);
            views_.push_back({whole(views[i], "byteLength", where, size - offset + 1),
                              whole(views[i], "byteStride", where, 253, 0)});
        }
    }
    void check_accessors() {
        const std::map<std::uint64_t, std::uint64_t> sizes = {{5120, 1}, {5121, 1}, {5122, 2},
                                                              {5123, 2}, {5125, 4}, {5126, 4}};
        const std::map<std::string, std::uint64_t> components = {
            {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
        const json& accessors = list("accessors");
        for (std::size_t i = 0; i < accessors.size(); ++i) {
            const json& accessor = accessors[i];
            const std::string where = fmt::format("accessor {}", i);
            const auto size = sizes.find(whole(accessor, "componentType", where, 6000));
            const json type = accessor.value("type", json());
            const auto parts = type.is_string() ? components.find(type.get<std::string>()) : components.end();
            if (size == sizes.end() || parts == components.end() || accessor.contains("sparse"))
                refuse(where, accessor.dump().substr(0, 80) + " was found", "a plain list of numbers");
            const std::uint64_t count = whole(accessor, "count", where, 100'000'000);
            counts_.push_back(count);
            if (!accessor.contains("bufferView") || count == 0) continue;
            const View& view = views_[whole(accessor, "bufferView", where, views_.size())];
            const std::uint64_t offset = whole(accessor, "byteOffset", where, view.length + 1, 0),
                                one = size->second * parts->second;
            const std::uint64_t end = offset + (count - 1) * std::max(view.stride, one) + one;
            if (end > view.length)
                refuse(where, fmt::format("it needs {} bytes of a view of {}", end, view.length),
                       "a whole file");
        }
    }
    void check_meshes() {
        const json& meshes = list("meshes");
        double corners = 0;
        for (std::size_t i = 0; i < meshes.size(); ++i) {
            const std::string where = fmt::format("mesh {}", i);
            const json primitives = meshes[i].value("primitives", json::array());
            for (const json& part : primitives) {
                if (!part.is_object()) refuse(where, "a primitive is no object", "an object");
                const json attributes = part.value("attributes", json::object());
                if (!attributes.is_object()) refuse(where, "'attributes' is no object", "an object");
                for (const auto& [name, accessor] : attributes.items()) {
                    const std::uint64_t at = whole(attributes, name.c_str(), where, counts_.size());
                    if (name != "POSITION") continue;
                    const json& places = root_["accessors"][at];
                    if (places["type"] != "VEC3" || places["componentType"] != 5126)
                        refuse(where, "POSITION is not of three floats", "a list of three floats");
                    if (!part.contains("indices")) corners += static_cast<double>(counts_[at]);
                }
                whole(part, "mode", where, 7, 4);
                if (!part.contains("indices")) continue;
                const std::uint64_t at = whole(part, "indices", where, counts_.size());
                if (root_["accessors"][at]["type"] != "SCALAR")
                    refuse(where, "indices are no list of numbers", "one");
                corners += static_cast<double>(counts_[at]);
            }
        }
        if (corners > 3 * most_triangles)
            refuse("meshes", fmt::format("{:.0f} corners of triangles were found", corners),
                   fmt::format("up to {:.0f}", 3 * most_triangles));
    }
    /// Nodes form trees: each has one parent at most, so that a circle has no root, and none is too deep.
    void check_nodes() {
        constexpr int deepest = 200;
        const json& nodes = list("nodes");
        const std::size_t meshes = list("meshes").size();
        std::vector<int> parent(nodes.size(), -1);
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const std::string where = fmt::format("node {}", i);
            if (nodes[i].contains("mesh")) whole(nodes[i], "mesh", where, meshes);
            const json children = nodes[i].value("children", json::array());
            for (const json& child : children) {
                const bool fits = child.is_number_integer() && child.get<std::int64_t>() >= 0 &&
                                  child.get<std::uint64_t>() < nodes.size();
                if (!fits || parent[child.get<std::size_t>()] >= 0)
                    refuse(where, fmt::format("child {} was found", child.dump().substr(0, 20)),
                           "a node that is no other's child");
                parent[child.get<std::size_t>()] = static_cast<int>(i);
            }
        }
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            int depth = 0;
            for (int at = static_cast<int>(i); at >= 0; at = parent[static_cast<std::size_t>(at)])
                if (++depth > deepest)
                    refuse(fmt::format("node {}", i), "its parents form a circle or go too deep",
                           fmt::format("a tree up to {} deep", deepest));
        }
    }

    struct View {
        std::uint64_t length, stride;
    };
    const std::filesystem::path& path_;
    const std::string& text_;
    json root_;
    std::uint64_t binary_ = 0;  // bytes of the container's own buffer
    std::vector<std::uint64_t> buffers_, counts_;
    std::vector<View> views_;
};

/// Throws InputError unless the file's buffers, views, accessors, meshes and nodes fit one another, and its
/// triangles are not too many. `text` is the file: JSON, or a binary container of it (.glb).
void check_gltf(const std::string& text, const std::filesystem::path& path) {
    GltfCheck(text, path).run();
}

// Text is read by ourselves so that an error names its line: assimp takes half a number for a whole one, and
// the nearest corner for one that does not exist.

double coordinate(TextScanner& words, std::string_view what) {
    const double number = words.number(what);
    if (std::abs(number) > 1e30) words.refuse("a number up to 1e30");
    return static_cast<float>(number);
}
Vec3 corner(TextScanner& words) {
    const double x = coordinate(words, "x of a corner"), y = coordinate(words, "y of a corner");
    return {x, y, coordinate(words, "z of a corner")};
}

void expect(TextScanner& words, std::string_view word, std::string_view where) {
    if (words.take(word)) return;
    words.word();
    words.refuse(fmt::format("'{}' {}", word, where));
}

/// Throws InputError "FILE:LINE: found; expected". Coordinates are of single precision, as those of a binary
/// file are.
TriangleMesh parse_text_stl(const std::string& text, const std::string& file) {
    TextScanner words(text, file);
    TriangleMesh mesh;
    expect(words, "solid", "at the start of a text STL");
    while (true) {
        words.rest_of_line();  // the solid's name
        while (words.take("facet")) {
            words.rest_of_line();  // a normal, which follows from the corners
            expect(words, "outer", "behind the normal of a facet");
            expect(words, "loop", "behind 'outer'");
            const int first = static_cast<int>(mesh.vertices.size());
            for (int k = 0; k < 3; ++k) {
                expect(words, "vertex", fmt::format("{} of 3 of a facet", k + 1));
                mesh.vertices.push_back(corner(words));
            }
            expect(words, "endloop", "behind three vertices");
            expect(words, "endfacet", "behind 'endloop'");
            mesh.triangles.push_back({first, first + 1, first + 2});
        }
        expect(words, "endsolid", "or 'facet' behind a facet");
        words.rest_of_line();
        if (words.at_end()) return mesh;
        expect(words, "solid", "or the end of the file behind 'endsolid'");
    }
}

/// Also with colours or normals (COFF, NOFF, CNOFF). Polygons are cut into triangles.
TriangleMesh parse_off(const std::string& text, const std::string& file) {
    TextScanner words(text, file);
    words.comments = true;
    const bool plain = words.take("OFF");
    if (!plain && !words.take("COFF") && !words.take("NOFF") && !words.take("CNOFF")) {
        words.word();
        words.refuse("'OFF', 'COFF', 'NOFF' or 'CNOFF' at the start of the file");
    }
    // A line of an OFF file has 6 bytes at least for a corner and 8 for a triangle.
    const auto corners =
        words.whole("the number of corners", 3, static_cast<std::int64_t>(3 * most_triangles));
    if (static_cast<std::size_t>(6 * corners) > words.left())
        words.refuse(fmt::format("as many corners as fit in the {} bytes that are left", words.left()));
    const auto faces = words.whole("the number of faces", 1, static_cast<std::int64_t>(most_triangles));
    if (static_cast<std::size_t>(8 * faces) > words.left())
        words.refuse(fmt::format("as many faces as fit in the {} bytes that are left", words.left()));
    words.whole("the number of edges, which may be 0", 0, std::int64_t{1} << 40);
    TriangleMesh mesh;
    for (std::int64_t i = 0; i < corners; ++i) {
        mesh.vertices.push_back(corner(words));
        if (!plain) words.rest_of_line();
    }
    const auto index = [&] { return static_cast<int>(words.whole("a corner's index", 0, corners - 1)); };
    for (std::int64_t i = 0; i < faces; ++i) {
        const auto count = words.whole("the number of a face's corners", 1, 1000);
        const int first = index();
        int before = count > 1 ? index() : first;
        for (std::int64_t k = 2; k < count; ++k) {
            const int next = index();
            mesh.triangles.push_back({first, before, next});
            before = next;
        }
        words.rest_of_line();  // a colour
        if (static_cast<double>(mesh.triangles.size()) > most_triangles)
            words.refuse(fmt::format("up to {:.0f} million triangles", most_triangles / 1e6));
    }
    return mesh;
}

namespace fs = std::filesystem;

/// A triangle needs about this much memory while it is read and welded, as measured [bytes].
constexpr double bytes_per_triangle = 450;
/// Least bytes per triangle in files of each kind; for PLY, whose header has the counts, most.
constexpr double binary_stl = 50, text_stl = 100, off = 8, gltf = 6, obj = 32, ply = 100;
constexpr const char* kinds = "expected an STL, OBJ, PLY, OFF, VTP, VTK, GLB or glTF file";

[[noreturn]] void refuse(const fs::path& path, const std::string& found) {
    throw io::InputError(path.string() + ": " + found);
}

void check_count(const fs::path& path, double triangles) {
    if (triangles <= most_triangles) return;
    refuse(path, fmt::format("up to {:.3g} million triangles would need {:.1f} GB of memory; expected {:.0f} "
                             "million: make the mesh coarser in a mesh editor",
                             triangles / 1e6, triangles * bytes_per_triangle / 1e9, most_triangles / 1e6));
}

std::string text_at(std::ifstream& stream, std::uintmax_t from, std::size_t count) {
    std::string text(count, '\0');
    stream.clear();
    stream.seekg(static_cast<std::streamoff>(from));
    stream.read(text.data(), static_cast<std::streamsize>(count));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

/// Whether this is a text STL. A binary one's triangle count is compared with the file's size before anything
/// else is read.
bool is_text_stl(const fs::path& path, std::ifstream& stream, std::uintmax_t size) {
    const std::string head = text_at(stream, 0, 1024);
    std::uint32_t count = 0;
    if (head.size() >= 84) std::memcpy(&count, head.data() + 80, sizeof count);
    const std::uintmax_t promised = 84 + std::uintmax_t{50} * count;
    if (head.size() >= 84 && count > 0 && promised == size) {
        check_count(path, static_cast<double>(size) / binary_stl);
        return false;
    }
    if (head.size() == 84 && count == 0)
        refuse(path, "a binary STL of 0 triangles was found; expected the surface of a lumen");
    const std::size_t word = std::min(head.find_first_not_of(" \t\r\n"), head.size());
    if (same_word(std::string_view(head).substr(word, 5), "solid") && head.find('\0') == std::string::npos) {
        check_count(path, static_cast<double>(size) / text_stl);
        return true;
    }
    refuse(path, fmt::format("{} bytes were found where the header of a binary STL promises {} triangles, {} "
                             "bytes; expected a whole binary STL, or a text STL from 'solid' to 'endsolid'",
                             size, count, promised));
}

StatedMesh from_polydata(const fs::path& path) {
    PolyData data = load_polydata(path);
    if (data.triangles.empty())
        refuse(path, fmt::format(
                         "it has {} points and {} lines, but no triangles; expected the surface of a lumen{}",
                         data.points.size(), data.lines.size(),
                         data.lines.empty() ? "" : ", and lines by --centrelines"));
    return {{std::move(data.points), std::move(data.triangles)}, std::move(data.axes)};
}

/// Opens regular files beside the mesh alone: it may name others, such as materials. Assimp 6 lets nothing
/// derive from its own files.
class FilesBeside final : public Assimp::IOSystem {
public:
    explicit FilesBeside(const fs::path& mesh) : mesh_(fs::absolute(mesh)) {}
    Assimp::IOStream* Open(const char* file, const char* mode) override {
        std::error_code ignored;
        const bool beside = io::lies_beside(mesh_, fs::absolute(file, ignored).string());
        return beside && fs::is_regular_file(file, ignored) ? files_.Open(file, mode) : nullptr;
    }
    void Close(Assimp::IOStream* stream) override { files_.Close(stream); }
    bool Exists(const char* file) const override { return files_.Exists(file); }
    bool ComparePaths(const char* one, const char* other) const override {
        return files_.ComparePaths(one, other);
    }
    char getOsSeparator() const override { return files_.getOsSeparator(); }

private:
    fs::path mesh_;
    Assimp::DefaultIOSystem files_;
};

// Normals are not needed, and STL's would keep its corners apart: the corners are welded below. Nodes of a
// glTF file place its meshes; what they scale is left to the unit that the user gives.
constexpr unsigned as_triangles = aiProcess_Triangulate | aiProcess_PreTransformVertices;

geometry::TriangleMesh taken(const aiScene* scene, const fs::path& path) {
    // The library's own words speak of its insides.
    if (!scene) refuse(path, fmt::format("not a whole {} file; {}", extension_of(path).substr(1), kinds));

    geometry::TriangleMesh mesh;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        const int first = static_cast<int>(mesh.vertices.size());
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            mesh.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
            if (!mesh.vertices.back().allFinite())
                refuse(path, fmt::format("corner {} is not a finite number; expected finite numbers", v));
        }
        for (unsigned f = 0; f < part.mNumFaces; ++f) {
            const aiFace& face = part.mFaces[f];
            if (face.mNumIndices != 3) continue;  // points and lines
            for (unsigned k = 0; k < 3; ++k)
                if (face.mIndices[k] >= part.mNumVertices)
                    refuse(path, fmt::format("face {} names corner {}; expected 0 to {}", f, face.mIndices[k],
                                             static_cast<int>(part.mNumVertices) - 1));
            mesh.triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                      first + static_cast<int>(face.mIndices[1]),
                                      first + static_cast<int>(face.mIndices[2])});
        }
    }
    return mesh;
}

geometry::TriangleMesh by_assimp(const fs::path& path) {
    Assimp::Importer importer;
    importer.SetIOHandler(new FilesBeside(path));  // which the importer deletes
    return taken(importer.ReadFile(path.string(), as_triangles), path);
}

/// Assimp's time for a face, or a line, grows with the square of its corners. A backslash at the end of a
/// line continues it.
void check_obj_faces(std::string_view text, const fs::path& path) {
    constexpr std::string_view blank = " \t\r\f\v";
    int line = 1, first_line = 0, words = 0;
    bool in_word = false, continues = false;
    char kind = 0;  // first letter of the line
    for (const char c : text) {
        if (c == '\n') {
            ++line;
            in_word = false;
            if (!std::exchange(continues, false)) words = kind = 0;
        } else if (blank.find(c) != std::string_view::npos) {
            in_word = false;
        } else {
            continues = c == '\\';
            if (std::exchange(in_word, true)) continue;
            if (words++ == 0) kind = c, first_line = line;
            if (words > most_corners_of_face + 1 && (kind == 'f' || kind == 'l' || kind == 'p'))
                refuse(path, fmt::format("line {}: found more than {} corners, expected a face of at most so "
                                         "many; a mesh editor makes triangles of it",
                                         first_line, most_corners_of_face));
        }
    }
}

/// What the comments of a text state: lines that begin with one of the marks, up to a line that is `end`.
std::optional<StatedAxes> axes_in_comments(std::string_view text,
                                           std::initializer_list<std::string_view> marks,
                                           std::string_view end = {}) {
    while (!text.empty()) {
        const std::size_t next = std::min(text.find('\n'), text.size() - 1) + 1;
        std::string_view line = text.substr(0, next);
        text.remove_prefix(next);
        line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
        if (!end.empty() && line.starts_with(end)) break;
        if (std::ranges::none_of(marks, [&](std::string_view mark) { return line.starts_with(mark); }))
            continue;
        if (std::optional<StatedAxes> found = axes_in_line(line, "a comment")) return found;
    }
    return std::nullopt;
}

geometry::TriangleMesh joined(const geometry::TriangleMesh& mesh, const fs::path& path) {
    if (mesh.triangles.empty()) refuse(path, "the mesh has no triangles; expected a surface of triangles");
    return geometry::welded(mesh);
}

StatedMesh read_by_kind(const fs::path& path) {
    std::error_code ignored;
    std::ifstream stream = io::open_to_read(path, "mesh", kinds);
    const std::string extension = extension_of(path);
    const std::uintmax_t size = fs::file_size(path, ignored);
    const auto whole_text = [&](double least_per_triangle) {
        check_count(path, static_cast<double>(size) / least_per_triangle);
        return io::read_text(path, "mesh", kinds);
    };
    if (extension == ".vtp" || extension == ".vtk") return from_polydata(path);
    std::optional<StatedAxes> axes;
    if (extension == ".ply") {
        const std::string text = whole_text(ply);
        axes = axes_in_comments(text, {"comment", "obj_info"}, "end_header");
        return {parse_ply(text, path.string()), axes};
    }
    if (extension == ".off") {
        const std::string text = whole_text(off);
        return {parse_off(text, path.string()), axes_in_comments(text, {"#"})};
    }
    if (extension == ".stl") {
        const bool as_text = is_text_stl(path, stream, size);
        const std::string head = text_at(stream, 0, as_text ? 1024 : 80);
        axes = axes_in_line(std::string_view(head).substr(0, head.find_first_of(std::string_view("\0\n", 2))),
                            "the header");
        if (as_text) return {parse_text_stl(whole_text(text_stl), path.string()), axes};
    } else if (extension == ".glb" || extension == ".gltf") {
        check_gltf(whole_text(gltf), path);
    } else if (extension == ".obj") {
        check_count(path, static_cast<double>(size) / obj);
        if (text_at(stream, 0, 4096).find('\0') != std::string::npos)
            refuse(path, fmt::format("this is not text, as an OBJ file is; {}", kinds));
        const std::string text = io::read_text(path, "mesh", kinds);
        check_obj_faces(text, path);
        axes = axes_in_comments(text, {"#"});
    } else {
        refuse(path, fmt::format("a mesh named '{}' is not read; {}", extension, kinds));
    }
    return {by_assimp(path), axes};
}

}  // namespace

geometry::TriangleMesh load_mesh(const fs::path& path) {
    return load_stated_mesh(path).mesh;
}

StatedMesh load_stated_mesh(const fs::path& path) {
    const auto read = [&](const io::Progress&) {
        StatedMesh found = read_by_kind(path);
        found.mesh = joined(found.mesh, path);
        return found;
    };
    StatedMesh found = io::read_behind_wall(path, {}, read, [](geometry::StateStream& s, StatedMesh& stated) {
        s(stated.mesh.vertices, stated.mesh.triangles, stated.axes);
    });
    const auto corners = static_cast<int>(found.mesh.vertices.size());
    const auto is_corner = [&](int corner) { return corner >= 0 && corner < corners; };
    for (const auto& triangle : found.mesh.triangles)
        if (!std::ranges::all_of(triangle, is_corner))
            throw std::logic_error("a reader returned a triangle of corners that are not there");
    return found;
}

geometry::TriangleMesh parse_stl(const std::string& bytes, const std::string& name) {
    const io::NoChildMeanwhile here;
    Assimp::Importer importer;
    return joined(
        taken(importer.ReadFileFromMemory(bytes.data(), bytes.size(), as_triangles, "stl"), name + ".stl"),
        name);
}

}  // namespace anatomy
