#pragma once
/// Small meshes and lines written in the formats that are read, by hand.

#include <bit>
#include <cstdint>
#include <fmt/format.h>
#include <string>
#include <vector>
#include <zlib.h>

#include "engine/anatomy/polydata.h"
#include "physics/geometry/vec.h"

namespace test {

template <class Number>
void put(std::string& bytes, Number number, bool big_endian = false) {
    std::string one(reinterpret_cast<const char*>(&number), sizeof number);
    if (big_endian) one = std::string(one.rbegin(), one.rend());
    bytes += one;
}

inline std::string base64(const std::string& bytes) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k > bytes.size() ? '=' : letters[bits >> (18 - 6 * k) & 63];
    }
    return text;
}

/// A VTP file as VTK would write it.
struct VtpStyle {
    const char* format = "ascii";  // ascii, binary, appended
    bool raw = false;              // appended data, else in base64
    bool compressed = false, wide = false, big_endian = false, doubles = false;
    bool wide_cells = false;  // Int64
};

class VtpText {
public:
    explicit VtpText(const VtpStyle& style) : style_(style) {}

    std::string of(const anatomy::PolyData& data, bool strips = false) {
        std::vector<double> places;
        for (const geometry::Vec3& p : data.points) places.insert(places.end(), {p.x(), p.y(), p.z()});
        std::vector<double> lines, line_ends, polys, poly_ends;
        for (const auto& line : data.lines) {
            lines.insert(lines.end(), line.points.begin(), line.points.end());
            line_ends.push_back(static_cast<double>(lines.size()));
        }
        for (const auto& t : data.triangles) {
            polys.insert(polys.end(), t.begin(), t.end());
            poly_ends.push_back(static_cast<double>(polys.size()));
        }
        const char* cells = style_.wide_cells ? "Int64" : "Int32";
        std::string text = fmt::format(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"{}\" "
            "header_type=\"{}\"{}>\n<PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" "
            "NumberOfLines=\"{}\" NumberOfStrips=\"{}\" NumberOfPolys=\"{}\">\n",
            style_.big_endian ? "BigEndian" : "LittleEndian", style_.wide ? "UInt64" : "UInt32",
            style_.compressed ? " compressor=\"vtkZLibDataCompressor\"" : "", data.points.size(),
            data.lines.size(), strips ? data.triangles.size() : 0, strips ? 0 : data.triangles.size());
        text += "<PointData>\n" + arrays(data.of_points) + "</PointData>\n<CellData>\n" +
                arrays(data.of_cells) + "</CellData>\n<Points>\n" +
                array(style_.doubles ? "Float64" : "Float32", "Points", places, 3) + "</Points>\n<Lines>\n" +
                array(cells, "connectivity", lines) + array(cells, "offsets", line_ends) + "</Lines>\n<" +
                (strips ? "Strips" : "Polys") + ">\n" + array(cells, "connectivity", polys) +
                array(cells, "offsets", poly_ends) + "</" + (strips ? "Strips" : "Polys") +
                ">\n</Piece>\n</PolyData>\n";
        if (std::string(style_.format) == "appended")
            text += fmt::format("<AppendedData encoding=\"{}\">\n_{}\n</AppendedData>\n",
                                style_.raw ? "raw" : "base64", appended_);
        return text + "</VTKFile>\n";
    }

private:
    std::string arrays(const std::vector<anatomy::PolyData::Array>& all) {
        std::string text;
        for (const auto& a : all) {
            if (a.texts.empty()) {
                text += array("Float64", a.name, a.numbers);
                continue;
            }
            std::vector<double> codes;
            for (const std::string& one : a.texts) {
                for (const char c : one) codes.push_back(static_cast<unsigned char>(c));
                codes.push_back(0);
            }
            text += array("String", a.name, codes);
        }
        return text;
    }
    std::string array(const std::string& type, const std::string& name, const std::vector<double>& numbers,
                      int components = 1) {
        const std::string head =
            fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"{}\"", type,
                        name, components, style_.format);
        if (std::string(style_.format) == "ascii") {
            std::string text = head + ">\n";
            for (const double number : numbers) text += fmt::format("{} ", number);
            return text + "\n</DataArray>\n";
        }
        const std::string coded = encoded(bytes_of(type, numbers));
        if (std::string(style_.format) == "binary") return head + ">\n" + coded + "\n</DataArray>\n";
        const std::size_t offset = appended_.size();
        appended_ += coded;
        return head + fmt::format(" offset=\"{}\"/>\n", offset);
    }
    std::string bytes_of(const std::string& type, const std::vector<double>& numbers) const {
        std::string bytes;
        for (const double number : numbers) {
            if (type == "Float64") put(bytes, number, style_.big_endian);
            if (type == "Float32") put(bytes, static_cast<float>(number), style_.big_endian);
            if (type == "Int32") put(bytes, static_cast<std::int32_t>(number), style_.big_endian);
            if (type == "Int64") put(bytes, static_cast<std::int64_t>(number), style_.big_endian);
            if (type == "String") bytes += static_cast<char>(number);
        }
        return bytes;
    }
    void put_length(std::string& bytes, std::size_t length) const {
        if (style_.wide)
            put(bytes, static_cast<std::uint64_t>(length), style_.big_endian);
        else
            put(bytes, static_cast<std::uint32_t>(length), style_.big_endian);
    }
    std::string coded(const std::string& bytes) const {
        return style_.raw && std::string(style_.format) == "appended" ? bytes : base64(bytes);
    }
    std::string encoded(const std::string& bytes) const {
        std::string head;
        if (!style_.compressed) {
            put_length(head, bytes.size());
            return coded(head + bytes);
        }
        constexpr std::size_t block = 700;  // some arrays have several, some a part of one
        std::vector<std::string> packed;
        for (std::size_t at = 0; at < bytes.size(); at += block) {
            const std::string one = bytes.substr(at, block);
            uLongf size = compressBound(one.size());
            packed.emplace_back(size, '\0');
            compress(reinterpret_cast<Bytef*>(packed.back().data()), &size,
                     reinterpret_cast<const Bytef*>(one.data()), one.size());
            packed.back().resize(size);
        }
        put_length(head, packed.size());
        put_length(head, block);
        put_length(head, bytes.size() % block);
        std::string all;
        for (const std::string& one : packed) {
            put_length(head, one.size());
            all += one;
        }
        return coded(head) + coded(all);
    }

    VtpStyle style_;
    std::string appended_;
};

/// Legacy VTK: ASCII or binary, with counts before each cell's indices or, as from version 5, offsets.
inline std::string legacy_vtk(const anatomy::PolyData& data, bool binary, bool offsets) {
    std::string text = fmt::format("# vtk DataFile Version {}\ntest\n{}\nDATASET POLYDATA\nPOINTS {} float\n",
                                   offsets ? "5.1" : "3.0", binary ? "BINARY" : "ASCII", data.points.size());
    const auto number = [&]<class Number>(Number n) {
        if (binary)
            put(text, n, true);
        else
            text += fmt::format("{} ", n);
    };
    for (const geometry::Vec3& p : data.points)
        for (int k = 0; k < 3; ++k) number(static_cast<float>(p[k]));
    text += "\nMETADATA\nINFORMATION 0\n\n";
    const auto cells = [&](const char* name, const std::vector<std::vector<int>>& all) {
        if (all.empty()) return;
        std::size_t indices = 0;
        for (const auto& cell : all) indices += cell.size();
        if (offsets) {
            text += fmt::format("{} {} {}\nOFFSETS vtktypeint64\n", name, all.size() + 1, indices);
            std::int64_t at = 0;
            number(at);
            for (const auto& cell : all) number(at += std::ssize(cell));
            text += "\nCONNECTIVITY vtktypeint64\n";
            for (const auto& cell : all)
                for (const int i : cell) number(static_cast<std::int64_t>(i));
        } else {
            text += fmt::format("{} {} {}\n", name, all.size(), all.size() + indices);
            for (const auto& cell : all) {
                number(static_cast<std::int32_t>(cell.size()));
                for (const int i : cell) number(static_cast<std::int32_t>(i));
            }
        }
        text += "\n";
    };
    std::vector<std::vector<int>> lines, polygons;
    for (const auto& line : data.lines) lines.push_back(line.points);
    for (const auto& t : data.triangles) polygons.emplace_back(t.begin(), t.end());
    cells("LINES", lines);
    cells("POLYGONS", polygons);
    if (!data.of_points.empty()) {
        text +=
            fmt::format("POINT_DATA {}\nFIELD FieldData {}\n", data.points.size(), data.of_points.size() + 1);
        for (const auto& array : data.of_points) {
            text += fmt::format("{} 1 {} double\n", array.name, array.numbers.size());
            for (const double n : array.numbers) number(n);
            text += "\n";
        }
        text += fmt::format("Normals 3 {} float\n", data.points.size());
        for (std::size_t i = 0; i < 3 * data.points.size(); ++i) number(0.5f);
        text += "\n";
    }
    if (!data.of_cells.empty()) {
        text += fmt::format("CELL_DATA {}\nFIELD FieldData {}\n", data.cells, data.of_cells.size());
        for (const auto& array : data.of_cells) {
            text += fmt::format("{} 1 {} string\n", array.name, array.texts.size());
            for (const std::string& one : array.texts) {
                if (binary) text += static_cast<char>(0xc0 | one.size());
                text += one + (binary ? "" : "\n");
            }
            text += "\n";
        }
    }
    return text;
}

inline std::string off(const geometry::TriangleMesh& mesh) {
    std::string text = fmt::format("OFF # a comment\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
    for (const geometry::Vec3& p : mesh.vertices) text += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
    for (const auto& t : mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    return text;
}

inline std::string text_stl(const geometry::TriangleMesh& mesh) {
    std::string text = "solid a tube\n";
    for (const auto& t : mesh.triangles) {
        text += "facet normal 0 0 1\n  outer loop\n";
        for (const int i : t) {
            const geometry::Vec3& p = mesh.vertices[i];
            text += fmt::format("    vertex {} {} {}\n", p.x(), p.y(), p.z());
        }
        text += "  endloop\nendfacet\n";
    }
    return text + "endsolid a tube\n";
}

/// `head` is what a program says of itself.
inline std::string binary_stl(const geometry::TriangleMesh& mesh, std::string head) {
    head.resize(80, ' ');
    put(head, static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const auto& t : mesh.triangles) {
        head.append(12, '\0');
        for (const int v : t)
            for (int k = 0; k < 3; ++k)
                put(head, static_cast<float>(mesh.vertices[static_cast<std::size_t>(v)][k]));
        head.append(2, '\0');
    }
    return head;
}

/// A binary glTF whose node scales by two and shifts by (1, 2, 3).
inline std::string glb(const geometry::TriangleMesh& mesh) {
    std::string bytes;
    for (const geometry::Vec3& p : mesh.vertices)
        for (int k = 0; k < 3; ++k) put(bytes, static_cast<float>(p[k]));
    const std::size_t places = bytes.size();
    for (const auto& t : mesh.triangles)
        for (const int i : t) put(bytes, static_cast<std::uint32_t>(i));
    std::string json = fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],)"
        R"("nodes":[{{"children":[1],"scale":[2,2,2],"translation":[1,2,3]}},{{"mesh":0}}],)"
        R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":4}}]}}],)"
        R"("accessors":[{{"bufferView":0,"componentType":5126,"count":{0},"type":"VEC3","min":[-99,-99,-99],)"
        R"("max":[99,99,99]}},{{"bufferView":1,"componentType":5125,"count":{1},"type":"SCALAR"}}],)"
        R"("bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":{2}}},)"
        R"({{"buffer":0,"byteOffset":{2},"byteLength":{3}}}],"buffers":[{{"byteLength":{4}}}]}})",
        mesh.vertices.size(), 3 * mesh.triangles.size(), places, bytes.size() - places, bytes.size());
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    put(file, std::uint32_t{2});
    put(file, static_cast<std::uint32_t>(28 + json.size() + bytes.size()));
    put(file, static_cast<std::uint32_t>(json.size()));
    file += "JSON" + json;
    put(file, static_cast<std::uint32_t>(bytes.size()));
    return file + std::string("BIN\0", 4) + bytes;
}

}  // namespace test
