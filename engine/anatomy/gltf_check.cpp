#include "engine/anatomy/gltf_check.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/anatomy/mesh_file.h"
#include "engine/io/depth.h"
#include "engine/io/error.h"

namespace anatomy {
namespace {

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
        throw io::InputError("{}: {}{}{}; {} is accepted", path_.string(), where, where.empty() ? "" : ": ",
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
                            : std::filesystem::file_size(path_.parent_path() / name, unknown);
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

}  // namespace

void check_gltf(const std::string& text, const std::filesystem::path& path) {
    GltfCheck(text, path).run();
}

}  // namespace anatomy
