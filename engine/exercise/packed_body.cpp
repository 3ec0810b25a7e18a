#include "engine/exercise/packed_body.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "physics/geometry/maths.h"
#include "physics/geometry/packed_mesh.h"
#include "physics/geometry/range_coder.h"

namespace exercise {
namespace {

using geometry::Allowance;
using geometry::BitModel;
using geometry::in_steps;
using geometry::most_steps;
using geometry::near;
using geometry::NumberModel;
using geometry::RangeCoder;
using Steps = std::array<std::int32_t, 3>;

[[noreturn]] void damaged() {
    throw std::runtime_error("the packed body is damaged");
}

/// Bits of three numbers of 21 bits, those of each in turn.
std::uint64_t interleaved(const Steps& place) {
    std::uint64_t all = 0;
    for (int bit = 20; bit >= 0; --bit)
        for (const std::int32_t p : place)
            all = all << 1 | (static_cast<std::uint32_t>(p + most_steps) >> bit & 1);
    return all;
}
Steps apart(std::uint64_t all) {
    Steps place{};
    for (int bit = 0; bit < 63; ++bit)
        place[static_cast<std::size_t>(2 - bit % 3)] |= static_cast<std::int32_t>(all >> bit & 1)
                                                        << (bit / 3);
    for (std::int32_t& p : place) p -= most_steps;
    return place;
}

constexpr double size_step = 0.06;  // of a logarithm
constexpr double fraction_step = 1.0 / 64;

struct RoundBlob {
    std::uint64_t place = 0;
    std::int32_t radius = 0, elongation = 0, fraction = 0;
    std::array<std::int32_t, 2> axis{};  // on an octahedron, unfolded
};

/// Places in each direction along the unfolded octahedron.
int axis_bits(std::int32_t elongation) {
    const double size = std::abs(elongation * size_step);
    return size < 0.1 ? 2 : size < 0.7 ? 4 : size < 1.4 ? 5 : 6;
}

std::array<std::int32_t, 2> folded(const Eigen::Vector3f& axis, int bits) {
    Eigen::Vector3d a = axis.cast<double>();
    if (a.z() < 0) a = -a;  // of revolution: both ways are one
    a /= std::abs(a.x()) + std::abs(a.y()) + a.z();
    // The upper half is a square, turned by an eighth.
    const std::array<double, 2> uv{a.x() + a.y(), a.x() - a.y()};
    std::array<std::int32_t, 2> steps{};
    const double half = 0.5 * (1 << bits);
    for (std::size_t k = 0; k < 2; ++k)
        steps[k] = std::clamp(static_cast<std::int32_t>(std::floor((uv[k] + 1) * half)), 0, (1 << bits) - 1);
    return steps;
}
Eigen::Vector3f unfolded(const std::array<std::int32_t, 2>& steps, int bits) {
    const double half = 0.5 * (1 << bits);
    const double u = (steps[0] + 0.5) / half - 1, v = (steps[1] + 0.5) / half - 1;
    const double x = 0.5 * (u + v), y = 0.5 * (u - v);
    Eigen::Vector3d axis(x, y, std::max(0.0, 1 - std::abs(x) - std::abs(y)));
    return axis.normalized().cast<float>();
}

std::int32_t rounded_radius(const render::TextureBlob& blob) {
    return in_steps(geometry::log(std::max(1e-3, static_cast<double>(blob.radius))), size_step);
}
float radius_of(std::int32_t rounded) {
    return static_cast<float>(geometry::exp(rounded * size_step));
}

/// Blobs one by one; models are their own.
void blobs(RangeCoder& coder, Allowance& allowance, NumberModel& count_model,
           std::vector<render::TextureBlob>& of) {
    const std::size_t count = allowance.count(coder, count_model, of.size(), render::blob_bytes);
    double smallest = 1e3;
    for (const render::TextureBlob& blob : of)
        smallest = std::min(smallest, static_cast<double>(radius_of(rounded_radius(blob))));
    // 0.1 to 0.4 mm in steps of 0.01.
    NumberModel step_model;
    const int hundredths = std::clamp(coder.number(step_model, static_cast<int>(50 * smallest)), 10, 40);
    const double step = 0.01 * hundredths;
    std::vector<RoundBlob> round;
    if (!coder.reads()) {
        for (const render::TextureBlob& blob : of) {
            RoundBlob r;
            r.place = interleaved({in_steps(blob.middle.x(), step), in_steps(blob.middle.y(), step),
                                   in_steps(blob.middle.z(), step)});
            r.radius = rounded_radius(blob);
            r.elongation =
                in_steps(geometry::log(std::max(1e-3, static_cast<double>(blob.elongation))), size_step);
            r.fraction = in_steps(blob.fraction, fraction_step);
            r.axis = folded(blob.axis, axis_bits(r.elongation));
            round.push_back(r);
        }
        std::stable_sort(round.begin(), round.end(),
                         [](const RoundBlob& a, const RoundBlob& b) { return a.place < b.place; });
    }
    struct Models {
        std::array<NumberModel, 64> high;
        NumberModel radius;
        std::array<NumberModel, 16> elongation, fraction;
        std::array<std::array<BitModel, 256>, 2> axis[8];
    };
    const auto models = std::make_unique<Models>();
    std::vector<render::TextureBlob> made;
    std::uint64_t place = 0;
    int last_width = 0;
    for (std::size_t b = 0; b < count; ++b) {
        const RoundBlob given = coder.reads() ? RoundBlob() : round[b];
        // The way from the last place: its width, then its bits.
        const std::uint64_t way = given.place - place;
        const int width = coder.number(models->high[static_cast<std::size_t>(last_width)],
                                       static_cast<int>(std::bit_width(way)));
        if (width < 0 || width > 63) damaged();
        std::uint64_t found = width > 0 ? 1 : 0;
        for (int left = width - 1; left > 0;) {
            const int part = std::min(left, 16);
            left -= part;
            found = found << part |
                    coder.plain(part, static_cast<std::uint32_t>(way >> left & ((1u << part) - 1)));
        }
        place += found;
        if (place >> 63) damaged();
        last_width = width;
        const std::int32_t radius = near(coder, models->radius, 0, given.radius);
        const auto bucket = static_cast<std::size_t>(std::clamp(radius / 8 + 6, 0, 15));
        const std::int32_t elongation = near(coder, models->elongation[bucket], 0, given.elongation);
        const std::int32_t fraction = near(coder, models->fraction[bucket], 0, given.fraction);
        if (std::abs(radius) > 1000 || std::abs(elongation) > 1000) damaged();
        const int bits = axis_bits(elongation);
        std::array<std::int32_t, 2> axis{};
        for (std::size_t k = 0; k < 2; ++k)
            axis[k] = coder.symbol(models->axis[bits][k], bits, given.axis[k]);
        if (!coder.reads()) continue;
        render::TextureBlob blob;
        const Steps at = apart(place);
        blob.middle = Eigen::Vector3d(step * at[0], step * at[1], step * at[2]).cast<float>();
        blob.axis = unfolded(axis, bits);
        blob.radius = radius_of(radius);
        blob.elongation = static_cast<float>(geometry::exp(elongation * size_step));
        blob.fraction = static_cast<float>(fraction * fraction_step);
        made.push_back(blob);
    }
    if (coder.reads()) of = std::move(made);
}

void text(RangeCoder& coder, Allowance& allowance, NumberModel& model, std::string& value) {
    const std::size_t size = allowance.count(coder, model, value.size(), 1);
    value.resize(size);
    for (char& c : value) c = static_cast<char>(coder.plain(8, static_cast<std::uint8_t>(c)));
}

void go_through(RangeCoder& coder, Body& body, std::size_t largest) {
    Allowance allowance{largest};
    NumberModel count, small;
    for (int k = 0; k < 3; ++k) {
        auto bits = std::bit_cast<std::uint64_t>(body.origin[k]);
        const std::uint64_t high = coder.plain(32, static_cast<std::uint32_t>(bits >> 32));
        const std::uint64_t low = coder.plain(32, static_cast<std::uint32_t>(bits));
        body.origin[k] = std::bit_cast<double>(high << 32 | low);
    }
    const std::size_t layers = allowance.count(coder, count, body.layers.size(), 1);
    if (coder.reads()) body.layers.resize(layers);
    // What nobody says is one by one.
    for (std::size_t l = coder.reads() ? 0 : body.textures.size(); l < layers; ++l)
        body.textures.push_back({body.layers[l].texture_blobs.size(), {}});
    geometry::MeshCoder meshes(coder, allowance, render::corner_step);
    for (std::size_t l = 0; l < layers; ++l) {
        render::TissueLayer& layer = body.layers[l];
        render::LayerTexture& texture = body.textures[l];
        text(coder, allowance, count, layer.name);
        for (render::Material* material : {&layer.material, &layer.inside}) {
            const int of = coder.number(small, static_cast<int>(*material));
            if (of < 0 || of >= render::material_count) damaged();
            *material = static_cast<render::Material>(of);
        }
        // What is packed is what comes back: patterns see the mesh in its order and on its grid.
        geometry::TriangleMesh mesh = meshes.mesh(layer.mesh);
        if (coder.reads()) mesh = layer.mesh;
        for (geometry::Vec3& v : mesh.vertices) v = geometry::on_grid(v, render::corner_step);
        std::vector<render::TextureBlob> singles = layer.texture_blobs;
        singles.resize(std::min<std::size_t>(singles.size(), texture.singles));
        blobs(coder, allowance, count, singles);
        texture.singles = singles.size();
        if (coder.reads()) layer.texture_blobs = std::move(singles);
        texture.patterns.resize(allowance.count(coder, count, texture.patterns.size(), 1));
        for (render::TexturePattern& pattern : texture.patterns) {
            pattern.code(coder, mesh, allowance);
            if (coder.reads()) pattern.draw(mesh, layer.texture_blobs, allowance);
        }
        if (coder.reads()) layer.closed = true;
    }
}

}  // namespace

std::string packed_body(const Body& body) {
    RangeCoder coder;
    Body copy = body;
    go_through(coder, copy, std::numeric_limits<std::size_t>::max());
    return coder.take();
}

Body rounded_body(const Body& body) {
    const std::string packed = packed_body(body);
    return unpacked_body(std::as_bytes(std::span(packed)), std::numeric_limits<std::size_t>::max());
}

Body unpacked_body(std::span<const std::byte> packed, std::size_t largest) {
    RangeCoder coder(packed);
    Body body;
    go_through(coder, body, largest);
    return body;
}

}  // namespace exercise
