#include "physics/geometry/packed_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

namespace geometry {
namespace {

using Steps = std::array<std::int32_t, 3>;
using Triangle = std::array<int, 3>;

[[noreturn]] void damaged() {
    throw std::runtime_error("the packed mesh is damaged");
}

}  // namespace

std::int32_t in_steps(double value, double step) {
    const double steps = std::floor(value / step + 0.5);
    if (!(std::abs(steps) <= most_steps)) throw std::runtime_error("too large to be packed");
    return static_cast<std::int32_t>(steps);
}

std::int32_t near(RangeCoder& coder, NumberModel& model, std::int32_t expected, std::int32_t value) {
    const std::int64_t found = std::int64_t{expected} + coder.number(model, value - expected);
    if (std::abs(found) > most_steps) damaged();
    return static_cast<std::int32_t>(found);
}

void Allowance::take(std::size_t count, std::size_t bytes) {
    if (count > left / bytes) throw std::runtime_error("it would be too large");
    left -= count * bytes;
}
std::size_t Allowance::count(RangeCoder& coder, NumberModel& model, std::size_t count, std::size_t bytes) {
    const std::int32_t told = coder.number(model, static_cast<std::int32_t>(count));
    if (told < 0) throw std::runtime_error("a negative count");
    take(static_cast<std::size_t>(told), bytes);
    return static_cast<std::size_t>(told);
}

/// Triangles one after another, each across an edge of one before it where there is one. Directed edges that
/// wait for their triangle are gates; of closed meshes that are turned alike, each edge has two triangles,
/// and one of each direction.
class MeshCoder::Traversal {
public:
    Traversal(RangeCoder& coder, Allowance& allowance, double step)
        : coder_(coder), allowance_(allowance), step_(step) {}

    /// The mesh in order, while one is packed.
    TriangleMesh mesh(TriangleMesh& mesh) {
        const std::size_t vertices = allowance_.count(coder_, models_.count, mesh.vertices.size(), 24);
        const std::size_t triangles = allowance_.count(coder_, models_.count, mesh.triangles.size(), 12);
        if (vertices > 3 * triangles) damaged();
        forget(vertices);
        Given given(coder_.reads() ? TriangleMesh{} : mesh, step_);
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
        if (!coder_.reads()) return {given.ordered(), std::move(made)};
        mesh.vertices.clear();
        for (const Steps& place : places_)
            mesh.vertices.emplace_back(step_ * place[0], step_ * place[1], step_ * place[2]);
        mesh.triangles = std::move(made);
        return {};
    }

private:
    struct Gate {
        int from = -1, to = -1, behind = -1;  // corner of the triangle on the other side
    };
    /// The mesh that is packed, in the numbers that its corners get; -1 throughout while one is unpacked.
    class Given {
    public:
        Given(const TriangleMesh& mesh, double step)
            : mesh_(mesh), step_(step), number_(mesh.vertices.size(), -1), done_(mesh.triangles.size()) {
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
                        in_steps(mesh_.vertices[static_cast<std::size_t>(old)][k], step_);
            return steps;
        }
        std::vector<Vec3> ordered() const {
            std::vector<Vec3> all;
            for (const int old : old_) all.push_back(mesh_.vertices[static_cast<std::size_t>(old)]);
            return all;
        }

    private:
        const TriangleMesh mesh_;
        const double step_;
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
                std::clamp(at(gate.from)[k] + at(gate.to)[k] - at(gate.behind)[k], -most_steps, most_steps);
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
    double step_;
    std::size_t vertices_ = 0;
    Models models_;
    std::vector<Steps> places_;
    std::vector<int> around_;  // gates that were ever opened at a corner
    std::vector<Gate> waiting_;
    std::vector<std::vector<int>> after_,
        before_;  // of each corner: ends of open gates from it, starts of those to it
    int last_kind_ = 0, widest_ = 0;
};

MeshCoder::MeshCoder(RangeCoder& coder, Allowance& allowance, double step)
    : traversal_(std::make_unique<Traversal>(coder, allowance, step)) {}
MeshCoder::~MeshCoder() = default;

TriangleMesh MeshCoder::mesh(TriangleMesh& mesh) {
    return traversal_->mesh(mesh);
}

TriangleMesh ordered(const TriangleMesh& mesh) {
    RangeCoder coder;
    Allowance allowance{std::numeric_limits<std::size_t>::max()};
    TriangleMesh given = mesh;
    return MeshCoder(coder, allowance, 1.0).mesh(given);
}

Vec3 on_grid(const Vec3& p, double step) {
    Vec3 rounded;
    for (int k = 0; k < 3; ++k) rounded[k] = step * in_steps(p[k], step);
    return rounded;
}

}  // namespace geometry
