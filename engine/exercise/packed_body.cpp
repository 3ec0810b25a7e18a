#include "engine/exercise/packed_body.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "physics/geometry/maths.h"
#include "physics/geometry/range_coder.h"

namespace exercise {
namespace {

using geometry::BitModel;
using geometry::NumberModel;
using geometry::RangeCoder;
using Steps = std::array<std::int32_t, 3>;
using Triangle = std::array<int, 3>;

constexpr std::int32_t farthest = 1 << 20;  // steps from the origin

[[noreturn]] void damaged() {
    throw std::runtime_error("the packed body is damaged");
}

std::int32_t in_steps(double value, double step) {
    const double steps = std::floor(value / step + 0.5);
    if (!(std::abs(steps) <= farthest)) throw std::runtime_error("a body that is too large to be packed");
    return static_cast<std::int32_t>(steps);
}

std::int32_t near(RangeCoder& coder, NumberModel& model, std::int32_t expected, std::int32_t value) {
    const std::int64_t found = std::int64_t{expected} + coder.number(model, value - expected);
    if (std::abs(found) > farthest) damaged();
    return static_cast<std::int32_t>(found);
}

/// What may still be unpacked, in bytes as the cache keeps them.
struct Allowance {
    std::size_t left;

    std::size_t count(RangeCoder& coder, NumberModel& model, std::size_t count, std::size_t bytes) {
        const std::int32_t told = coder.number(model, static_cast<std::int32_t>(count));
        if (told < 0 || static_cast<std::size_t>(told) > left / bytes) damaged();
        left -= static_cast<std::size_t>(told) * bytes;
        return static_cast<std::size_t>(told);
    }
};

/// Triangles one after another, each across an edge of one before it where there is one. Directed edges that
/// wait for their triangle are gates; of closed meshes that are turned alike, each edge has two triangles,
/// and one of each direction.
class MeshCoder {
public:
    MeshCoder(RangeCoder& coder, Allowance& allowance) : coder_(coder), allowance_(allowance) {}

    void mesh(geometry::TriangleMesh& mesh) {
        const std::size_t vertices = allowance_.count(coder_, models_.count, mesh.vertices.size(), 24);
        const std::size_t triangles = allowance_.count(coder_, models_.count, mesh.triangles.size(), 12);
        if (vertices > 3 * triangles) damaged();
        forget(vertices);
        Given given(coder_.reads() ? geometry::TriangleMesh{} : mesh);
        std::vector<Triangle> made;
        made.reserve(triangles);
        while (made.size() < triangles) {
            Gate gate;
            bool open = false;
            while (!open && !waiting_.empty()) {
                gate = waiting_.back();
                waiting_.pop_back();
                open = waits(gate.from, gate.to);
            }
            Triangle corners{};
            if (open) {
                const int third = given.across(gate.from, gate.to);
                if (!coder_.bit(models_.there, third >= 0)) {
                    close(gate.from, gate.to);
                    continue;
                }
                corners = {gate.from, gate.to, corner(given, third, gate)};
            } else {
                Triangle first = given.next();
                for (std::size_t k = 0; k < 3; ++k)
                    corners[k] = seed(given, first[k], k > 0 ? corners[k - 1] : -1);
            }
            made.push_back(corners);
            for (std::size_t k = 0; k < 3; ++k) {
                const int a = corners[k], b = corners[(k + 1) % 3];
                if (waits(a, b))
                    close(a, b);
                else
                    opened(b, a, corners[(k + 2) % 3]);
            }
        }
        if (!coder_.reads()) return;
        mesh.vertices.clear();
        for (const Steps& place : places_)
            mesh.vertices.emplace_back(body_step * place[0], body_step * place[1], body_step * place[2]);
        mesh.triangles = std::move(made);
    }

private:
    struct Gate {
        int from = -1, to = -1, behind = -1;  // corner of the triangle on the other side
    };
    /// The mesh that is packed, in the numbers that its corners get; -1 throughout while one is unpacked.
    class Given {
    public:
        explicit Given(const geometry::TriangleMesh& mesh)
            : mesh_(mesh), number_(mesh.vertices.size(), -1), done_(mesh.triangles.size()) {
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
                for (std::size_t k = 0; k < 3; ++k)
                    edges_.push_back({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3],
                                      static_cast<int>(t), static_cast<int>(k)});
            std::ranges::sort(edges_);
        }
        /// The corner opposite of an edge in a triangle that is not done, and is now.
        int across(int from, int to) {
            if (mesh_.vertices.empty()) return -1;
            const std::array<int, 4> wanted{old_[static_cast<std::size_t>(from)],
                                            old_[static_cast<std::size_t>(to)], 0, 0};
            for (auto e = std::ranges::lower_bound(edges_, wanted);
                 e != edges_.end() && (*e)[0] == wanted[0] && (*e)[1] == wanted[1]; ++e) {
                const auto t = static_cast<std::size_t>((*e)[2]);
                if (done_[t]) continue;
                done_[t] = true;
                return mesh_.triangles[t][static_cast<std::size_t>((*e)[3] + 2) % 3];
            }
            return -1;
        }
        Triangle next() {
            while (first_ < done_.size() && done_[first_]) ++first_;
            if (first_ == done_.size()) return {0, 0, 0};
            done_[first_] = true;
            return mesh_.triangles[first_];
        }
        int number(int old) const { return number_.empty() ? -1 : number_[static_cast<std::size_t>(old)]; }
        void give(int old, int number) {
            if (number_.empty()) return;
            number_[static_cast<std::size_t>(old)] = number;
            old_.push_back(old);
        }
        Steps place(int old) const {
            Steps steps{};
            if (!mesh_.vertices.empty())
                for (int k = 0; k < 3; ++k)
                    steps[static_cast<std::size_t>(k)] =
                        in_steps(mesh_.vertices[static_cast<std::size_t>(old)][k], body_step);
            return steps;
        }

    private:
        const geometry::TriangleMesh mesh_;
        std::vector<int> number_, old_;
        std::vector<char> done_;
        std::vector<std::array<int, 4>> edges_;
        std::size_t first_ = 0;
    };
    struct Models {
        NumberModel count;
        BitModel there;
        std::array<std::array<BitModel, 4>, 4 * 8 * 8> kind;
        NumberModel back;
        std::array<NumberModel, 3 * 12> residual;
        BitModel seed_is_new;
    };

    void forget(std::size_t vertices) {
        vertices_ = vertices;
        places_.clear();
        around_.clear();
        waiting_.clear();
        after_.clear();
        before_.clear();
    }

    enum Kind { New, Right, Left, Other };

    int corner(Given& given, int old, const Gate& gate) {
        const int right = beside(after_[static_cast<std::size_t>(gate.to)], gate.from),
                  left = beside(before_[static_cast<std::size_t>(gate.from)], gate.to);
        const int number = given.number(old < 0 ? 0 : old);
        int kind = number < 0 ? New : number == right ? Right : number == left ? Left : Other;
        const std::size_t context =
            static_cast<std::size_t>(last_kind_) * 64 + busy(gate.from) * 8 + busy(gate.to);
        kind = coder_.symbol(models_.kind[context], 2, kind);
        last_kind_ = kind;
        if (kind == Right || kind == Left) {
            const int found = kind == Right ? right : left;
            if (found < 0) damaged();
            return found;
        }
        if (kind == Other) return earlier(number);
        Steps expected{};
        const auto at = [&](int v) { return places_[static_cast<std::size_t>(v)]; };
        for (std::size_t k = 0; k < 3; ++k)
            expected[k] =
                std::clamp(at(gate.from)[k] + at(gate.to)[k] - at(gate.behind)[k], -farthest, farthest);
        return added(given, old, expected);
    }
    int seed(Given& given, int old, int last) {
        const int number = given.number(old);
        if (!coder_.bit(models_.seed_is_new, number < 0)) return earlier(number);
        return added(given, old, last < 0 ? Steps{} : places_[static_cast<std::size_t>(last)]);
    }
    int earlier(int number) {
        const auto count = static_cast<std::int64_t>(places_.size());
        const std::int64_t found =
            count - coder_.number(models_.back, static_cast<std::int32_t>(count) - number);
        if (found < 0 || found >= count) damaged();
        return static_cast<int>(found);
    }
    int added(Given& given, int old, const Steps& expected) {
        if (places_.size() >= vertices_) damaged();
        const Steps value = given.place(old);
        Steps place{};
        int widest = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            place[k] =
                near(coder_, models_.residual[k * 12 + static_cast<std::size_t>(k > 0 ? widest : widest_)],
                     expected[k], value[k]);
            widest = std::max(widest, std::min(11, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(
                                                       std::abs(place[k] - expected[k]))))));
        }
        widest_ = widest;
        given.give(old, static_cast<int>(places_.size()));
        places_.push_back(place);
        around_.push_back(0);
        after_.emplace_back();
        before_.emplace_back();
        return static_cast<int>(places_.size()) - 1;
    }

    std::size_t busy(int vertex) const {
        return static_cast<std::size_t>(std::min(7, around_[static_cast<std::size_t>(vertex)]));
    }
    bool waits(int from, int to) const {
        const std::vector<int>& ends = after_[static_cast<std::size_t>(from)];
        return std::ranges::find(ends, to) != ends.end();
    }
    /// The other end of the gate that was opened last of those at a corner.
    static int beside(const std::vector<int>& ends, int other) {
        for (auto end = ends.rbegin(); end != ends.rend(); ++end)
            if (*end != other) return *end;
        return -1;
    }
    void opened(int from, int to, int behind) {
        after_[static_cast<std::size_t>(from)].push_back(to);
        before_[static_cast<std::size_t>(to)].push_back(from);
        waiting_.push_back({from, to, behind});
        ++around_[static_cast<std::size_t>(from)];
        ++around_[static_cast<std::size_t>(to)];
    }
    void close(int from, int to) {
        const auto take = [](std::vector<int>& ends, int end) {
            const auto last = std::find(ends.rbegin(), ends.rend(), end);
            if (last != ends.rend()) ends.erase(std::next(last).base());
        };
        take(after_[static_cast<std::size_t>(from)], to);
        take(before_[static_cast<std::size_t>(to)], from);
    }

    RangeCoder& coder_;
    Allowance& allowance_;
    std::size_t vertices_ = 0;
    Models models_;
    std::vector<Steps> places_;
    std::vector<int> around_;  // gates that were ever opened at a corner
    std::vector<Gate> waiting_;
    std::vector<std::vector<int>> after_,
        before_;  // of each corner: ends of open gates from it, starts of those to it
    int last_kind_ = 0, widest_ = 0;
};

/// Bits of three numbers of 21 bits, those of each in turn.
std::uint64_t interleaved(const Steps& place) {
    std::uint64_t all = 0;
    for (int bit = 20; bit >= 0; --bit)
        for (const std::int32_t p : place)
            all = all << 1 | (static_cast<std::uint32_t>(p + farthest) >> bit & 1);
    return all;
}
Steps apart(std::uint64_t all) {
    Steps place{};
    for (int bit = 0; bit < 63; ++bit)
        place[static_cast<std::size_t>(2 - bit % 3)] |= static_cast<std::int32_t>(all >> bit & 1)
                                                        << (bit / 3);
    for (std::int32_t& p : place) p -= farthest;
    return place;
}

constexpr double size_step = 0.03;  // of a logarithm
constexpr double fraction_step = 1.0 / 64;

struct RoundBlob {
    std::uint64_t place = 0;
    std::int32_t radius = 0, elongation = 0, fraction = 0;
    std::array<std::int32_t, 2> axis{};  // on an octahedron, unfolded
};

/// Places in each direction along the unfolded octahedron.
int axis_bits(std::int32_t elongation) {
    const double size = std::abs(elongation * size_step);
    return size < 0.1 ? 3 : size < 0.7 ? 5 : size < 1.4 ? 6 : 7;
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

/// The texture of a layer; models are its own.
void blobs(RangeCoder& coder, Allowance& allowance, NumberModel& count_model,
           std::vector<render::TextureBlob>& of) {
    const std::size_t count = allowance.count(coder, count_model, of.size(), 36);
    double smallest = 1e3;
    for (const render::TextureBlob& blob : of)
        smallest = std::min(smallest, static_cast<double>(blob.radius));
    // 0.1 to 0.2 mm in steps of 0.01.
    NumberModel step_model;
    const int hundredths = std::clamp(coder.number(step_model, static_cast<int>(20 * smallest)), 10, 20);
    const double step = 0.01 * hundredths;
    std::vector<RoundBlob> round;
    if (!coder.reads()) {
        for (const render::TextureBlob& blob : of) {
            RoundBlob r;
            r.place = interleaved({in_steps(blob.middle.x(), step), in_steps(blob.middle.y(), step),
                                   in_steps(blob.middle.z(), step)});
            r.radius = in_steps(geometry::log(std::max(1e-3, static_cast<double>(blob.radius))), size_step);
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
        blob.radius = static_cast<float>(geometry::exp(radius * size_step));
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
    MeshCoder meshes(coder, allowance);
    for (render::TissueLayer& layer : body.layers) {
        text(coder, allowance, count, layer.name);
        for (render::Material* material : {&layer.material, &layer.inside}) {
            const int of = coder.number(small, static_cast<int>(*material));
            if (of < 0 || of >= render::material_count) damaged();
            *material = static_cast<render::Material>(of);
        }
        meshes.mesh(layer.mesh);
        blobs(coder, allowance, count, layer.texture_blobs);
        if (coder.reads()) layer.closed = true;
    }
}

}  // namespace

std::string packed_body(const Body& body) {
    RangeCoder coder;
    // Packing changes nothing.
    go_through(coder, const_cast<Body&>(body), std::size_t{1} << 40);
    return coder.take();
}

Body unpacked_body(std::span<const std::byte> packed, std::size_t largest) {
    RangeCoder coder(packed);
    Body body;
    go_through(coder, body, largest);
    return body;
}

}  // namespace exercise
