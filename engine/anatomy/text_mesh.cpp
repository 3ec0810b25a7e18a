#include "engine/anatomy/text_mesh.h"

#include <cmath>
#include <fmt/format.h>

#include "engine/anatomy/mesh_file.h"
#include "engine/anatomy/text_scanner.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

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

}  // namespace

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

}  // namespace anatomy
