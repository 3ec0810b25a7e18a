#include "engine/anatomy/import/mask_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numeric>
#include <utility>

#include "engine/anatomy/import/mesh_cut.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/surface_net.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using Index = std::array<int, 3>;

/// Layers around the mask, and those of them into which a vessel that the border cuts is carried on.
constexpr int pad = 14, carried = 10;
/// Pieces of at least this part of the largest are vessels of their own.
constexpr double large_piece = 0.25;
/// A patch on the border is a vessel cut across, not its side, when it has this part of the section behind.
constexpr double least_cut = 0.7;

/// Voxels in rows along the first axis.
struct Voxels {
    Index size{};
    std::vector<std::uint8_t> at;

    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(k) * size[1] + j) * static_cast<std::size_t>(size[0]) + i;
    }
    const std::uint8_t* row(int j, int k) const { return at.data() + index(0, j, k); }
};

/// Runs of equal voxels along rows, joined into connected pieces.
class Pieces {
public:
    struct Run {
        int j, k, from, to;  // the last exclusive
    };

    /// Neighbours across corners count for `value` 1; for 0 only those across faces.
    Pieces(const Voxels& voxels, std::uint8_t value) : size_(voxels.size), diagonal_(value == 1) {
        for (int k = 0; k < size_[2]; ++k)
            for (int j = 0; j < size_[1]; ++j) {
                first_.push_back(static_cast<int>(runs.size()));
                const std::uint8_t* row = voxels.row(j, k);
                for (int i = 0; i < size_[0];) {
                    const auto* from = std::find(row + i, row + size_[0], value);
                    const auto* to = std::find(from, row + size_[0], static_cast<std::uint8_t>(1 - value));
                    if (from != to)
                        runs.push_back({j, k, static_cast<int>(from - row), static_cast<int>(to - row)});
                    i = static_cast<int>(to - row);
                }
            }
        first_.push_back(static_cast<int>(runs.size()));
        piece.resize(runs.size());
        std::iota(piece.begin(), piece.end(), 0);
        for (int k = 0; k < size_[2]; ++k)
            for (int j = 0; j < size_[1]; ++j) {
                join(j, k, j - 1, k);
                join(j, k, j, k - 1);
                if (!diagonal_) continue;
                join(j, k, j - 1, k - 1);
                join(j, k, j + 1, k - 1);
            }
        for (std::size_t r = 0; r < runs.size(); ++r) piece[r] = root(static_cast<int>(r));
    }

    std::vector<Run> runs;
    std::vector<int> piece;  // of each run: the number of one of its runs

    std::map<int, std::int64_t> sizes() const {
        std::map<int, std::int64_t> all;
        for (std::size_t r = 0; r < runs.size(); ++r) all[piece[r]] += runs[r].to - runs[r].from;
        return all;
    }

private:
    int root(int r) {
        while (piece[r] != r) r = piece[r] = piece[piece[r]];
        return r;
    }
    void join(int j, int k, int other_j, int other_k) {
        if (other_j < 0 || other_k < 0 || other_j >= size_[1]) return;
        const auto row = static_cast<std::size_t>(k) * size_[1] + j,
                   other = static_cast<std::size_t>(other_k) * size_[1] + other_j;
        const int reach = diagonal_ ? 1 : 0;
        int b = first_[other];
        for (int a = first_[row]; a < first_[row + 1]; ++a) {
            while (b < first_[other + 1] && runs[b].to + reach <= runs[a].from) ++b;
            for (int c = b; c < first_[other + 1] && runs[c].from < runs[a].to + reach; ++c) {
                const int p = root(a), q = root(c);
                piece[std::max(p, q)] = std::min(p, q);
            }
        }
    }

    Index size_;
    bool diagonal_;
    std::vector<int> first_;  // run of each row, and past the last
};

/// A patch of the mask in a layer at the border where the vessel is cut across.
struct BorderCut {
    int axis, side;       // 0 low, 1 high
    Vec3 centre;          // in voxels
    double farthest = 0;  // voxel from the centre [voxels]
};

/// Smoothed values about the level 0, positive inside, of each voxel.
class SmoothField {
public:
    static constexpr float scale = 20000;

    SmoothField(const Voxels& mask, const std::function<void(double)>& progress)
        : size(mask.size), values(mask.at.size(), static_cast<std::int16_t>(-0.5f * scale)) {
        constexpr int thick = 64;
        for (int k = 0; k < size[2]; k += thick) {
            slab(mask, k, std::min(k + thick, size[2]));
            if (progress) progress(static_cast<double>(k) / size[2]);
        }
        compose();
        drop_bubbles();
    }

    Index size;
    std::vector<std::int16_t> values;

    std::int16_t at(int i, int j, int k) const {
        return values[(static_cast<std::size_t>(k) * size[1] + j) * static_cast<std::size_t>(size[0]) + i];
    }

    struct Sample {
        double value;
        Vec3 gradient;
    };
    /// By cubic interpolation (Catmull and Rom).
    Sample sample(const Vec3& p) const {
        Index base;
        std::array<std::array<double, 4>, 3> w, dw;
        for (int a = 0; a < 3; ++a) {
            const double x = std::clamp(p[a], 1.0, size[a] - 2.001);
            base[a] = static_cast<int>(x) - 1;
            const double t = x - static_cast<int>(x), tt = t * t, ttt = tt * t;
            w[a] = {-0.5 * t + tt - 0.5 * ttt, 1 - 2.5 * tt + 1.5 * ttt, 0.5 * t + 2 * tt - 1.5 * ttt,
                    -0.5 * tt + 0.5 * ttt};
            dw[a] = {-0.5 + 2 * t - 1.5 * tt, -5 * t + 4.5 * tt, 0.5 + 4 * t - 4.5 * tt, -t + 1.5 * tt};
        }
        Sample s{0, Vec3::Zero()};
        for (int c = 0; c < 4; ++c)
            for (int b = 0; b < 4; ++b) {
                double row = 0, slope = 0;
                for (int a = 0; a < 4; ++a) {
                    const double v = at(base[0] + a, base[1] + b, base[2] + c);
                    row += w[0][a] * v;
                    slope += dw[0][a] * v;
                }
                s.value += w[1][b] * w[2][c] * row;
                s.gradient +=
                    Vec3(w[1][b] * w[2][c] * slope, dw[1][b] * w[2][c] * row, w[1][b] * dw[2][c] * row);
            }
        return s;
    }

private:
    /// What the rows of a slab hold; rows without anything near are left out of the work.
    struct Slab {
        int i0 = 0, j0 = 0, k0 = 0, ni = 0, nj = 0, nk = 0;
        std::size_t row(int j, int k) const { return (static_cast<std::size_t>(k) * nj + j) * ni; }
    };

    /// A Gaussian by its weights.
    struct Kernel {
        int reach, rounds;  // [voxels]; that undo its shrinking
        std::vector<float> weights;

        Kernel(double sigma, int of, int undone) : reach(of), rounds(undone) {
            float sum = 0;
            for (int d = -reach; d <= reach; ++d) {
                weights.push_back(static_cast<float>(geometry::exp(-d * d / (2 * sigma * sigma))));
                sum += weights.back();
            }
            for (float& w : weights) w /= sum;
        }
    };
    static constexpr int wide_reach = 8;
    static constexpr float just = 0.05f;  // what is taken in, or left out, whatever its value

    /// The mask smoothed, and what that takes from convex parts given back: the field whose inside, smoothed
    /// in turn, is the smoothed mask.
    static std::vector<float> restored(const Slab& box, const std::vector<float>& blurred,
                                       const Kernel& kernel, std::vector<float>& inside,
                                       std::vector<float>& scratch) {
        std::vector<float> value = blurred;
        for (int round = 0; round < kernel.rounds; ++round) {
            occupied(box, value, inside);
            blur(box, inside, kernel, scratch);
            for (std::size_t n = 0; n < value.size(); ++n) value[n] += blurred[n] - inside[n];
        }
        return value;
    }

    void slab(const Voxels& mask, int from, int to) {
        constexpr int halo = 3 * wide_reach + 2;
        Slab box;
        const int low_k = std::max(0, from - halo), high_k = std::min(size[2], to + halo);
        Index low = {size[0], size[1], 0}, high = {0, 0, 0};
        for (int k = low_k; k < high_k; ++k)
            for (int j = 0; j < size[1]; ++j) {
                const std::uint8_t *row = mask.row(j, k), *end = row + size[0];
                const auto* first = std::find(row, end, std::uint8_t{1});
                if (first == end) continue;
                const auto* last = end - 1;
                while (*last == 0) --last;
                low[0] = std::min(low[0], static_cast<int>(first - row));
                high[0] = std::max(high[0], static_cast<int>(last - row));
                low[1] = std::min(low[1], j), high[1] = std::max(high[1], j);
            }
        if (low[0] > high[0]) return;
        constexpr int margin = wide_reach + 2;
        box.i0 = std::max(0, low[0] - margin), box.ni = std::min(size[0], high[0] + margin + 1) - box.i0;
        box.j0 = std::max(0, low[1] - margin), box.nj = std::min(size[1], high[1] + margin + 1) - box.j0;
        box.k0 = low_k, box.nk = high_k - low_k;
        const std::size_t count = static_cast<std::size_t>(box.ni) * box.nj * box.nk;
        std::vector<float> given(count), inside(count), scratch(count);
        for (int k = 0; k < box.nk; ++k)
            for (int j = 0; j < box.nj; ++j)
                std::copy_n(mask.row(box.j0 + j, box.k0 + k) + box.i0, box.ni, given.data() + box.row(j, k));
        std::vector<float> blurred = given;
        blur(box, blurred, narrow_, scratch);
        std::vector<float> value = restored(box, blurred, narrow_, inside, scratch);
        blurred = given;
        blur(box, blurred, wide_, scratch);
        {
            const std::vector<float> wide = restored(box, blurred, wide_, inside, scratch);
            // On the surface of a tube the wide Gaussian leaves the less of the mask the thinner it is.
            constexpr float thin = 0.2f, thick = 0.35f;
            for (std::size_t n = 0; n < count; ++n) {
                const float t = std::clamp((blurred[n] - thin) / (thick - thin), 0.0f, 1.0f);
                value[n] += t * t * (3 - 2 * t) * (wide[n] - value[n]);
            }
        }
        for (int k = from; k < to; ++k)
            for (int j = 0; j < box.nj; ++j)
                for (int i = 0; i < box.ni; ++i) {
                    const std::size_t n = box.row(j, k - box.k0) + i;
                    float v = value[n] - 0.5f;
                    // No voxel is given up, or added, that lies clearly on one side: a thin vessel stays
                    // whole, and a gap stays open.
                    constexpr float clearly = 0.6f;
                    if ((v > 0) != (given[n] > 0.5f)) {
                        const float way = std::abs(v) / std::max(slope(box, value, i, j, k - box.k0), 1e-4f);
                        if (way > clearly) v = given[n] > 0.5f ? just : -just;
                    }
                    values[(static_cast<std::size_t>(k) * size[1] + box.j0 + j) *
                               static_cast<std::size_t>(size[0]) +
                           box.i0 + i] =
                        static_cast<std::int16_t>(std::lround(std::clamp(v, -1.5f, 1.5f) * scale));
                }
    }

    /// Takes in more until parts of the vessel that touch along an edge or in a corner touch across a face,
    /// as does what lies around it (well-composed sets, Latecki 1997): only then is the surface net, which
    /// has one vertex in a cell, a manifold.
    void compose() {
        const auto rows = static_cast<std::ptrdiff_t>(size[0]);
        const std::array<std::ptrdiff_t, 3> steps = {1, rows, rows * size[1]};
        std::int16_t* v = values.data();
        const auto take_in = [&](std::initializer_list<std::ptrdiff_t> some) {
            const auto nearest = std::ranges::max_element(some, {}, [&](std::ptrdiff_t n) { return v[n]; });
            v[*nearest] = static_cast<std::int16_t>(just * scale);
        };
        for (bool changed = true; std::exchange(changed, false);)
            for (int k = 1; k + 1 < size[2]; ++k)
                for (int j = 1; j + 1 < size[1]; ++j)
                    for (std::ptrdiff_t n = k * steps[2] + j * steps[1] + 1, i = 1; i + 1 < size[0];
                         ++i, ++n) {
                        const bool in = v[n] > 0;
                        for (int a = 0; in && a < 3; ++a)
                            for (const std::ptrdiff_t side : {steps[a], -steps[a]}) {
                                const std::ptrdiff_t on = steps[(a + 1) % 3], p = n + side, q = n + on;
                                if (v[q + side] <= 0 || v[p] > 0 || v[q] > 0) continue;
                                take_in({p, q});
                                changed = true;
                            }
                        for (int corner = 0; corner < 4; ++corner) {
                            const std::ptrdiff_t x = corner & 1 ? 1 : -1,
                                                 y = corner & 2 ? steps[1] : -steps[1], z = steps[2];
                            const std::array others = {n + x, n + y, n + z, n + x + y, n + y + z, n + x + z};
                            const std::ptrdiff_t opposite = n + x + y + z;
                            if ((v[opposite] > 0) != in ||
                                std::ranges::any_of(others, [&](auto m) { return (v[m] > 0) == in; }))
                                continue;
                            if (in)
                                take_in({n + x, n + y, n + z});
                            else
                                take_in({n, opposite});
                            changed = true;
                        }
                    }
    }

    /// What was left out below the surface, as in a fork's crotch, or taken in beside it.
    void drop_bubbles() {
        Voxels signs{size, {}};
        signs.at.resize(values.size());
        std::ranges::transform(values, signs.at.begin(), [](std::int16_t v) { return v > 0 ? 1 : 0; });
        for (const std::uint8_t kind : {0, 1}) {
            const Pieces pieces(signs, kind);
            const auto sizes = pieces.sizes();
            if (sizes.size() < 2) continue;
            const int largest =
                std::ranges::max_element(sizes, {}, [](const auto& piece) { return piece.second; })->first;
            for (std::size_t r = 0; r < pieces.runs.size(); ++r) {
                const Pieces::Run& run = pieces.runs[r];
                if (pieces.piece[r] != largest)
                    std::fill_n(
                        values.begin() + static_cast<std::ptrdiff_t>(signs.index(run.from, run.j, run.k)),
                        run.to - run.from, static_cast<std::int16_t>((kind == 0 ? just : -just) * scale));
            }
        }
    }

    static float slope(const Slab& box, const std::vector<float>& v, int i, int j, int k) {
        const std::size_t n = box.row(j, k) + i;
        const auto along = [&](int at, int count, std::size_t step) {
            if (at == 0 || at + 1 == count) return 0.0f;
            return 0.5f * (v[n + step] - v[n - step]);
        };
        const auto row = static_cast<std::size_t>(box.ni);
        const float x = along(i, box.ni, 1), y = along(j, box.nj, row), z = along(k, box.nk, row * box.nj);
        return std::sqrt(x * x + y * y + z * z);
    }

    /// Which part of each voxel lies where the value is above a half.
    static void occupied(const Slab& box, const std::vector<float>& v, std::vector<float>& part) {
        for (int k = 0; k < box.nk; ++k)
            for (int j = 0; j < box.nj; ++j)
                for (int i = 0; i < box.ni; ++i) {
                    const std::size_t n = box.row(j, k) + i;
                    const float above = v[n] - 0.5f;
                    // A value changes by less than a half from one voxel to the next.
                    if (std::abs(above) > 0.45f)
                        part[n] = above > 0 ? 1.0f : 0.0f;
                    else
                        part[n] =
                            std::clamp(0.5f + above / std::max(slope(box, v, i, j, k), 1e-6f), 0.0f, 1.0f);
                }
    }

    /// Along all axes; beyond the slab there is nothing.
    static void blur(const Slab& box, std::vector<float>& v, const Kernel& kernel,
                     std::vector<float>& scratch) {
        const int reach = kernel.reach;
        const std::vector<float>& weights = kernel.weights;
        const int ni = box.ni, nj = box.nj, nk = box.nk;
        std::vector<float> line(static_cast<std::size_t>(ni) + 2 * reach, 0.0f);
        std::vector<char> used(static_cast<std::size_t>(nj) * nk, 0);
        for (int k = 0; k < nk; ++k)
            for (int j = 0; j < nj; ++j) {
                float* row = v.data() + box.row(j, k);
                if (std::all_of(row, row + ni, [](float x) { return x == 0; })) continue;
                used[static_cast<std::size_t>(k) * nj + j] = 1;
                std::copy_n(row, ni, line.begin() + reach);
                std::fill(row, row + ni, 0.0f);
                for (int d = 0; d <= 2 * reach; ++d)
                    for (int i = 0; i < ni; ++i)
                        row[i] +=
                            weights[static_cast<std::size_t>(d)] * line[static_cast<std::size_t>(i + d)];
            }
        const auto along = [&](const std::vector<float>& in, std::vector<float>& out, bool third) {
            std::vector<char> next(used.size(), 0);
            for (int k = 0; k < nk; ++k)
                for (int j = 0; j < nj; ++j) {
                    float* to = out.data() + box.row(j, k);
                    std::fill(to, to + ni, 0.0f);
                    for (int d = -reach; d <= reach; ++d) {
                        const int jj = third ? j : j + d, kk = third ? k + d : k;
                        if (jj < 0 || jj >= nj || kk < 0 || kk >= nk) continue;
                        if (!used[static_cast<std::size_t>(kk) * nj + jj]) continue;
                        next[static_cast<std::size_t>(k) * nj + j] = 1;
                        const float* from = in.data() + box.row(jj, kk);
                        const float w = weights[static_cast<std::size_t>(d + reach)];
                        for (int i = 0; i < ni; ++i) to[i] += w * from[i];
                    }
                }
            used = std::move(next);
        };
        along(v, scratch, false);
        along(scratch, v, true);
    }

    const Kernel narrow_{1.5, 5, 2}, wide_{2.5, wide_reach, 4};
};

/// From the surface net of the field: corners on the level, in voxels.
class Net {
public:
    explicit Net(const SmoothField& field) : field_(field) {
        const Index size = field.size;
        const auto layer = static_cast<std::size_t>(size[0]) * size[1];
        std::vector<int> below(layer, -1), here(layer, -1);
        const auto inside = [&](int i, int j, int k) { return field.at(i, j, k) > 0; };
        for (int k = 0; k + 1 < size[2]; ++k) {
            std::ranges::fill(here, -1);
            for (int j = 0; j + 1 < size[1]; ++j)
                for (int i = 0; i + 1 < size[0]; ++i) {
                    int mask = 0;
                    for (int c = 0; c < 8; ++c)
                        mask |= inside(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) << c;
                    if (mask == 0 || mask == 255) continue;
                    const geometry::Crossings crossings = geometry::crossings_of([&](int c) {
                        const auto v = field.at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                        return v > 0 ? -static_cast<double>(v) : 1.0 - static_cast<double>(v);
                    });
                    here[static_cast<std::size_t>(j) * size[0] + i] = static_cast<int>(mesh.vertices.size());
                    mesh.vertices.push_back(Vec3(i, j, k) + crossings.sum / crossings.count);
                }
            quads(below, here, k);
            std::swap(below, here);
        }
    }

    TriangleMesh mesh;

    /// Each corner in four triangles: finer, and as smooth as the field.
    void subdivide() {
        std::map<std::pair<int, int>, int> middles;
        std::vector<std::array<int, 3>> finer;
        finer.reserve(4 * mesh.triangles.size());
        const auto middle = [&](int a, int b) {
            const auto [found, fresh] =
                middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
            if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
            return found->second;
        };
        for (const auto [a, b, c] : mesh.triangles) {
            const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
        for (Vec3& p : mesh.vertices) p = onto_level(p);
    }

    /// Spaces corners evenly along the surface.
    void relax(int rounds) {
        for (int round = 0; round < rounds; ++round) {
            std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
            std::vector<int> counts(mesh.vertices.size(), 0);
            for (const auto& t : mesh.triangles)
                for (int k = 0; k < 3; ++k) {
                    sums[t[k]] += mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]];
                    counts[t[k]] += 2;
                }
            for (std::size_t v = 0; v < sums.size(); ++v)
                if (counts[v] > 0)
                    mesh.vertices[v] = onto_level(0.5 * (mesh.vertices[v] + sums[v] / counts[v]));
        }
    }

private:
    Vec3 onto_level(Vec3 p) const {
        const Vec3 given = p;
        for (int round = 0; round < 3; ++round) {
            const SmoothField::Sample s = field_.sample(p);
            const double square = s.gradient.squaredNorm();
            if (!(square > 1)) return given;
            const Vec3 step = s.value / square * s.gradient;
            if (step.norm() > 0.7) return given;
            p -= step;
        }
        return p;
    }
    void quads(const std::vector<int>& below, const std::vector<int>& here, int k) {
        const Index size = field_.size;
        const auto at = [&](const std::vector<int>& layer, int i, int j) {
            return layer[static_cast<std::size_t>(j) * size[0] + i];
        };
        for (int j = 1; j + 1 < size[1]; ++j)
            for (int i = 1; i + 1 < size[0]; ++i) {
                const bool inside = field_.at(i, j, k) > 0;
                if (inside != (field_.at(i, j, k + 1) > 0))
                    geometry::add_quad(
                        mesh,
                        {at(here, i - 1, j - 1), at(here, i, j - 1), at(here, i, j), at(here, i - 1, j)},
                        inside);
                if (k == 0) continue;
                if (inside != (field_.at(i + 1, j, k) > 0))
                    geometry::add_quad(
                        mesh, {at(below, i, j - 1), at(below, i, j), at(here, i, j), at(here, i, j - 1)},
                        inside);
                if (inside != (field_.at(i, j + 1, k) > 0))
                    geometry::add_quad(
                        mesh, {at(below, i - 1, j), at(here, i - 1, j), at(here, i, j), at(below, i, j)},
                        inside);
            }
    }

    const SmoothField& field_;
};

class SurfaceMaker {
public:
    explicit SurfaceMaker(VesselMask mask) : grid_(mask.grid) { cut_out(mask); }

    MaskSurface make(const std::function<void(double)>& progress) {
        keep_one_piece();
        fill_cavities();
        carry_on();
        const auto part = [&](double from, double to) {
            return [&progress, from, to](double p) {
                if (progress) progress(from + p * (to - from));
            };
        };
        const SmoothField field(voxels_, part(0, 0.7));
        Net net(field);
        voxels_.at = {};
        net.relax(3);
        // On thin vessels the voxels' own corners would be seen as facets.
        if (static_cast<double>(net.mesh.triangles.size()) < most_subdivided) net.subdivide();
        for (Vec3& v : net.mesh.vertices) v = at(v);
        if (grid_.axes().determinant() < 0)
            for (auto& t : net.mesh.triangles) std::swap(t[1], t[2]);
        result_.mesh = std::move(net.mesh);
        cut_at_border();
        Vec3 step;
        for (int a = 0; a < 3; ++a) step[a] = grid_.steps[a].norm();
        result_.findings.push_back({Finding::Kind::Mended,
                                    fmt::format("the steps of voxels of {:.3g} × {:.3g} × {:.3g} mm, by "
                                                "Gaussians of 1.5 voxels where the vessel is "
                                                "thin, to 2.5 where it is wide, whose shrinking is undone",
                                                step[0], step[1], step[2]),
                                    Finding::Topic::Smoothed});
        return std::move(result_);
    }

private:
    static constexpr double most_subdivided = 1.2e5;

    Vec3 at(const Vec3& voxel) const {
        const Vec3 v = voxel - Vec3::Constant(pad) + Vec3(low_[0], low_[1], low_[2]);
        return grid_.at(v.x(), v.y(), v.z());
    }
    double voxel_volume() const { return std::abs(grid_.axes().determinant()); }

    /// The box of the mask, with room around it.
    void cut_out(VesselMask& mask) {
        low_ = grid_.size;
        Index high = {-1, -1, -1};
        for (int k = 0; k < grid_.size[2]; ++k)
            for (int j = 0; j < grid_.size[1]; ++j) {
                const std::uint8_t *row = mask.inside.data() + grid_.index(0, j, k),
                                   *end = row + grid_.size[0];
                const auto* first = std::find(row, end, std::uint8_t{1});
                if (first == end) continue;
                const auto* last = end - 1;
                while (*last == 0) --last;
                const Index from = {static_cast<int>(first - row), j, k},
                            to = {static_cast<int>(last - row), j, k};
                for (int a = 0; a < 3; ++a)
                    low_[a] = std::min(low_[a], from[a]), high[a] = std::max(high[a], to[a]);
            }
        if (high[0] < 0)
            throw io::InputError("the mask is empty; expected the voxels of a vessel marked in it");
        for (int a = 0; a < 3; ++a) {
            inner_[a] = high[a] - low_[a] + 1;
            voxels_.size[a] = inner_[a] + 2 * pad;
            at_border_[a] = {low_[a] == 0, high[a] + 1 == grid_.size[a]};
        }
        voxels_.at.assign(static_cast<std::size_t>(voxels_.size[0]) * voxels_.size[1] * voxels_.size[2], 0);
        for (int k = 0; k < inner_[2]; ++k)
            for (int j = 0; j < inner_[1]; ++j)
                std::copy_n(mask.inside.data() + grid_.index(low_[0], low_[1] + j, low_[2] + k), inner_[0],
                            voxels_.at.data() + voxels_.index(pad, j + pad, k + pad));
        mask.inside = {};
    }

    Vec3 middle_of(const Pieces& pieces, int piece) const {
        Vec3 sum = Vec3::Zero();
        double count = 0;
        for (std::size_t r = 0; r < pieces.runs.size(); ++r) {
            if (pieces.piece[r] != piece) continue;
            const Pieces::Run& run = pieces.runs[r];
            const double length = run.to - run.from;
            sum += length * Vec3(0.5 * (run.from + run.to - 1), run.j, run.k);
            count += length;
        }
        return at(sum / count);
    }
    std::string volume_text(std::int64_t voxels) const {
        return fmt::format("{:.3g} ml", static_cast<double>(voxels) * voxel_volume() / 1000);
    }

    void keep_one_piece() {
        const Pieces pieces(voxels_, 1);
        std::vector<std::pair<std::int64_t, int>> order;
        for (const auto& [piece, size] : pieces.sizes()) order.emplace_back(-size, piece);
        std::ranges::sort(order);
        if (order.size() == 1) return;
        std::string list;
        std::int64_t lost = 0;
        for (std::size_t p = 1; p < order.size(); ++p) {
            lost -= order[p].first;
            if (p <= 5)
                list += fmt::format("{}{} at {}", p > 1 ? ", " : "", volume_text(-order[p].first),
                                    io::place_text(middle_of(pieces, order[p].second)));
        }
        if (order.size() > 6) list += fmt::format(" and {} more", order.size() - 6);
        if (-order[1].first >= large_piece * static_cast<double>(-order[0].first))
            throw io::InputError(
                "the mask is in {} pieces that do not touch, the largest of {} at {}, then {} [mm]; expected "
                "one "
                "vessel: close the gap in the segmentation, or give the pieces one by one",
                order.size(), volume_text(-order[0].first),
                io::place_text(middle_of(pieces, order[0].second)), list);
        for (std::size_t r = 0; r < pieces.runs.size(); ++r) {
            const Pieces::Run& run = pieces.runs[r];
            if (pieces.piece[r] == order[0].second) continue;
            std::fill_n(voxels_.at.data() + voxels_.index(run.from, run.j, run.k), run.to - run.from,
                        std::uint8_t{0});
        }
        result_.findings.push_back(
            {Finding::Kind::Mended,
             fmt::format("{} piece{} apart from the vessel, {:.2g} % of the mask [mm]: {}", order.size() - 1,
                         order.size() == 2 ? "" : "s",
                         100.0 * static_cast<double>(lost) / static_cast<double>(lost - order[0].first),
                         list),
             Finding::Topic::Removed});
    }

    /// Nothing within a vessel is without blood.
    void fill_cavities() {
        const Pieces outside(voxels_, 0);
        int count = 0;
        std::int64_t filled = 0;
        for (const auto& [piece, size] : outside.sizes())
            if (piece != outside.piece[0]) ++count, filled += size;
        if (count == 0) return;
        for (std::size_t r = 0; r < outside.runs.size(); ++r) {
            const Pieces::Run& run = outside.runs[r];
            if (outside.piece[r] == outside.piece[0]) continue;
            std::fill_n(voxels_.at.data() + voxels_.index(run.from, run.j, run.k), run.to - run.from,
                        std::uint8_t{1});
        }
        result_.findings.push_back(
            {Finding::Kind::Mended,
             fmt::format("{} hole{} inside the mask, {} in all, {} filled", count, count == 1 ? "" : "s",
                         volume_text(filled), count == 1 ? "was" : "were")});
    }

    /// Lets a vessel that the border of the volume cuts across go on beyond it.
    void carry_on() {
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side)
                if (at_border_[axis][side]) carry_on(axis, side);
    }
    void carry_on(int axis, int side) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const int layer = side == 0 ? pad : pad + inner_[axis] - 1, inward = side == 0 ? 1 : -1;
        const auto voxel = [&](int depth, int a, int b) -> std::uint8_t& {
            Index at;
            at[axis] = layer + depth * inward, at[u] = a, at[v] = b;
            return voxels_.at[voxels_.index(at[0], at[1], at[2])];
        };
        const int nu = voxels_.size[u], nv = voxels_.size[v];
        std::vector<char> seen(static_cast<std::size_t>(nu) * nv, 0);
        std::vector<std::vector<std::array<int, 2>>> patches;
        for (int b = 0; b < nv; ++b)
            for (int a = 0; a < nu; ++a) {
                if (!voxel(0, a, b) || seen[static_cast<std::size_t>(b) * nu + a]) continue;
                patches.push_back({{a, b}});
                auto& patch = patches.back();
                seen[static_cast<std::size_t>(b) * nu + a] = 1;
                for (std::size_t next = 0; next < patch.size(); ++next)
                    for (int n = 0; n < 9; ++n) {
                        const int x = patch[next][0] + n % 3 - 1, y = patch[next][1] + n / 3 - 1;
                        char& mark = seen[static_cast<std::size_t>(y) * nu + x];
                        if (voxel(0, x, y) && !std::exchange(mark, 1)) patch.push_back({x, y});
                    }
            }
        for (const auto& patch : patches) {
            std::array<int, 2> low = patch[0], high = low;
            Vec3 sum = Vec3::Zero();
            for (const auto& p : patch) {
                for (int c = 0; c < 2; ++c)
                    low[c] = std::min(low[c], p[c]), high[c] = std::max(high[c], p[c]);
                sum[u] += p[0], sum[v] += p[1];
            }
            constexpr int deep = 2;
            std::size_t behind = 0;
            for (int b = low[1] - deep; b <= high[1] + deep; ++b)
                for (int a = low[0] - deep; a <= high[0] + deep; ++a) behind += voxel(deep, a, b);
            const bool across = patch.size() >= 4 && inner_[axis] > deep &&
                                static_cast<double>(patch.size()) >= least_cut * static_cast<double>(behind);
            if (!across) continue;
            BorderCut cut{axis, side, sum / static_cast<double>(patch.size())};
            cut.centre[axis] = layer;
            for (const auto& p : patch) {
                cut.farthest =
                    std::max(cut.farthest, geometry::hypot(p[0] - cut.centre[u], p[1] - cut.centre[v]));
                for (int depth = 1; depth <= carried; ++depth) voxel(-depth, p[0], p[1]) = 1;
            }
            cuts_.push_back(cut);
        }
    }

    void cut_at_border() {
        if (cuts_.empty()) return;
        MeshCut work(result_.mesh);
        std::string list;
        int done = 0;
        for (const BorderCut& cut : cuts_) {
            const int u = (cut.axis + 1) % 3, v = (cut.axis + 2) % 3;
            Vec3 outward = grid_.steps[u].cross(grid_.steps[v]).normalized();
            if ((outward.dot(grid_.steps[cut.axis]) > 0) != (cut.side == 1)) outward = -outward;
            const double widest = std::max(grid_.steps[u].norm(), grid_.steps[v].norm());
            const double beyond = (carried + 2) * grid_.steps[cut.axis].norm();
            Vec3 apex = cut.centre;
            apex[cut.axis] += (cut.side == 1 ? 1 : -1) * (carried + 0.5);
            const double rim = (cut.farthest + 3) * widest;
            if (!work.beyond(at(cut.centre), outward, at(apex), rim + beyond, rim)) continue;
            list += fmt::format("{}{}", done++ > 0 ? ", " : "", io::place_text(at(cut.centre)));
        }
        if (done == 0) return;
        result_.mesh = work.result();
        result_.findings.push_back(
            {Finding::Kind::Noted,
             fmt::format("the vessel is cut by the border of the volume and open there [mm]: {}", list),
             Finding::Topic::Ends});
    }

    render::VolumeGrid grid_;
    Voxels voxels_;
    Index low_{}, inner_{};  // first voxel of the mask's box, and the box's size
    std::array<std::array<bool, 2>, 3> at_border_{};
    std::vector<BorderCut> cuts_;
    MaskSurface result_;
};

}  // namespace

MaskSurface surface_of(VesselMask mask, const std::function<void(double)>& progress) {
    return SurfaceMaker(std::move(mask)).make(progress);
}

}  // namespace anatomy
