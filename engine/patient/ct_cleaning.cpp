#include "engine/patient/ct_cleaning.h"

#include <algorithm>
#include <cmath>

#include "engine/patient/ct_image.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/voxelise.h"

namespace patient {
namespace {

constexpr int air_hu = -1000;
constexpr int tissue_hu = -400;

/// Cells of several voxels, one byte each.
struct Cells {
    std::array<int, 3> size{}, factor{};  // cells, and voxels in a cell, along each axis
    std::vector<char> set;

    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(k) * size[1] + j) * size[0] + i;
    }
    /// Calls visit(neighbour's index) for the neighbours across the six faces.
    template <class Visit>
    void for_neighbours(int i, int j, int k, const Visit& visit) const {
        const std::size_t at = index(i, j, k);
        const std::size_t row = size[0], layer = static_cast<std::size_t>(size[0]) * size[1];
        if (i > 0) visit(at - 1);
        if (i + 1 < size[0]) visit(at + 1);
        if (j > 0) visit(at - row);
        if (j + 1 < size[1]) visit(at + row);
        if (k > 0) visit(at - layer);
        if (k + 1 < size[2]) visit(at + layer);
    }
};

/// A cell is set when its mean is denser than tissue's least.
Cells tissue_cells(const CtImage& ct) {
    constexpr double cell = 2.0;  // [mm]
    Cells cells;
    for (int a = 0; a < 3; ++a) {
        cells.factor[a] = std::max(1, static_cast<int>(std::lround(cell / ct.grid.steps[a].norm())));
        cells.size[a] = (ct.grid.size[a] + cells.factor[a] - 1) / cells.factor[a];
    }
    cells.set.resize(static_cast<std::size_t>(cells.size[0]) * cells.size[1] * cells.size[2]);
    on_all_processors(cells.size[2], 2, [&](int ck) {
        std::vector<long long> sums(static_cast<std::size_t>(cells.size[0]) * cells.size[1]);
        std::vector<int> counts(sums.size());
        for (int k = ck * cells.factor[2]; k < std::min((ck + 1) * cells.factor[2], ct.grid.size[2]); ++k)
            for (int j = 0; j < ct.grid.size[1]; ++j) {
                const std::int16_t* row = ct.hu.data() + ct.grid.index(0, j, k);
                const std::size_t to = static_cast<std::size_t>(j / cells.factor[1]) * cells.size[0];
                for (int i = 0; i < ct.grid.size[0]; ++i) {
                    sums[to + i / cells.factor[0]] += row[i];
                    ++counts[to + i / cells.factor[0]];
                }
            }
        for (std::size_t c = 0; c < sums.size(); ++c)
            cells.set[cells.index(0, 0, ck) + c] = sums[c] > static_cast<long long>(tissue_hu) * counts[c];
    });
    return cells;
}

/// Unsets (or sets) cells beside one that is not (is) set. Cells beyond the grid count as the cell itself.
void spread(Cells& cells, char value, const Cells* within = nullptr) {
    const std::vector<char> before = cells.set;
    on_all_processors(cells.size[2], 2, [&](int k) {
        for (int j = 0; j < cells.size[1]; ++j)
            for (int i = 0; i < cells.size[0]; ++i) {
                const std::size_t at = cells.index(i, j, k);
                if (before[at] == value || (within && !within->set[at])) continue;
                bool beside = false;
                cells.for_neighbours(i, j, k, [&](std::size_t n) { beside = beside || before[n] == value; });
                if (beside) cells.set[at] = value;
            }
    });
}

/// Leaves the pieces that hang together across faces and are at least `fraction` as large as the largest.
void keep_large_pieces(Cells& cells, double fraction) {
    std::vector<int> piece(cells.set.size(), 0);
    std::vector<std::size_t> sizes{0}, waiting;
    const std::size_t row = cells.size[0], layer = row * cells.size[1];
    for (std::size_t seed = 0; seed < cells.set.size(); ++seed) {
        if (!cells.set[seed] || piece[seed] != 0) continue;
        const int number = static_cast<int>(sizes.size());
        std::size_t count = 0;
        piece[seed] = number;
        waiting.assign(1, seed);
        while (!waiting.empty()) {
            const std::size_t at = waiting.back();
            waiting.pop_back();
            ++count;
            cells.for_neighbours(static_cast<int>(at % row), static_cast<int>(at / row % cells.size[1]),
                                 static_cast<int>(at / layer), [&](std::size_t n) {
                                     if (!cells.set[n] || piece[n] != 0) return;
                                     piece[n] = number;
                                     waiting.push_back(n);
                                 });
        }
        sizes.push_back(count);
    }
    const double least = fraction * static_cast<double>(*std::ranges::max_element(sizes));
    for (std::size_t c = 0; c < cells.set.size(); ++c)
        cells.set[c] =
            piece[c] != 0 && static_cast<double>(sizes[static_cast<std::size_t>(piece[c])]) >= least;
}

/// Sets what the set cells enclose in each layer across `axis`.
void fill_layers(Cells& cells, int axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    on_all_processors(cells.size[axis], 2, [&](int n) {
        const auto at = [&](int u, int v) {
            std::array<int, 3> place{};
            place[axis] = n, place[b] = u, place[c] = v;
            return cells.index(place[0], place[1], place[2]);
        };
        std::vector<char> outside(static_cast<std::size_t>(cells.size[b]) * cells.size[c], 0);
        std::vector<std::pair<int, int>> waiting;
        const auto reach = [&](int u, int v) {
            if (u < 0 || v < 0 || u >= cells.size[b] || v >= cells.size[c]) return;
            char& seen = outside[static_cast<std::size_t>(v) * cells.size[b] + u];
            if (seen || cells.set[at(u, v)]) return;
            seen = 1;
            waiting.emplace_back(u, v);
        };
        for (int u = 0; u < cells.size[b]; ++u) reach(u, 0), reach(u, cells.size[c] - 1);
        for (int v = 0; v < cells.size[c]; ++v) reach(0, v), reach(cells.size[b] - 1, v);
        while (!waiting.empty()) {
            const auto [u, v] = waiting.back();
            waiting.pop_back();
            reach(u - 1, v), reach(u + 1, v), reach(u, v - 1), reach(u, v + 1);
        }
        for (int v = 0; v < cells.size[c]; ++v)
            for (int u = 0; u < cells.size[b]; ++u)
                if (!outside[static_cast<std::size_t>(v) * cells.size[b] + u]) cells.set[at(u, v)] = 1;
    });
}

}  // namespace

std::size_t remove_surroundings(CtImage& ct, const std::filesystem::path& file) {
    const Cells tissue = tissue_cells(ct);
    Cells body = tissue;
    constexpr int thinned = 2;
    for (int n = 0; n < thinned; ++n) spread(body, 0);
    if (std::ranges::none_of(body.set, [](char c) { return c != 0; }))
        refuse_ct(file, "no body was found: nothing thicker than 8 mm is denser than -400 HU",
                  "expected a CT in Hounsfield units");
    constexpr double large = 0.25;
    keep_large_pieces(body, large);
    for (int n = 0; n < thinned + 1; ++n) spread(body, 1, &tissue);
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::abs(ct.grid.steps[a].normalized().z()) > std::abs(ct.grid.steps[axis].normalized().z()))
            axis = a;
    fill_layers(body, axis);
    spread(body, 1);
    std::vector<std::size_t> removed(static_cast<std::size_t>(ct.grid.size[2]), 0);
    on_all_processors(ct.grid.size[2], 4, [&](int k) {
        for (int j = 0; j < ct.grid.size[1]; ++j) {
            std::int16_t* row = ct.hu.data() + ct.grid.index(0, j, k);
            const char* keep = body.set.data() + body.index(0, j / body.factor[1], k / body.factor[2]);
            for (int i = 0; i < ct.grid.size[0]; ++i) {
                if (keep[i / body.factor[0]]) continue;
                removed[static_cast<std::size_t>(k)] += row[i] > tissue_hu;
                row[i] = air_hu;
            }
        }
    });
    std::size_t sum = 0;
    for (const std::size_t n : removed) sum += n;
    return sum;
}

namespace {

/// Means of what contrast adds to blood in blocks of voxels.
class Excess {
public:
    Excess(const CtImage& ct, int blood) : blood_(blood) {
        constexpr double block = 12.0;  // [mm]
        for (int a = 0; a < 3; ++a) {
            voxels_[a] = std::max(1, static_cast<int>(std::lround(block / ct.grid.steps[a].norm())));
            size_[a] = ct.grid.size[a] / voxels_[a] + 1;
        }
        sums_.resize(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
    }
    void add(int i, int j, int k, int hu) {
        for (Sum* sum : {&sums_[index(i / voxels_[0], j / voxels_[1], k / voxels_[2])], &all_}) {
            sum->hu += hu - blood_;
            ++sum->count;
        }
    }
    /// Averages each block with those around it; blocks without any lumen get the mean of all.
    void finish() {
        means_.resize(sums_.size());
        const auto mean = [](const Sum& sum) {
            return std::max(0.0f,
                            static_cast<float>(static_cast<double>(sum.hu) / static_cast<double>(sum.count)));
        };
        for (int k = 0; k < size_[2]; ++k)
            for (int j = 0; j < size_[1]; ++j)
                for (int i = 0; i < size_[0]; ++i) {
                    Sum around;
                    for (int z = std::max(k - 1, 0); z <= std::min(k + 1, size_[2] - 1); ++z)
                        for (int y = std::max(j - 1, 0); y <= std::min(j + 1, size_[1] - 1); ++y)
                            for (int x = std::max(i - 1, 0); x <= std::min(i + 1, size_[0] - 1); ++x) {
                                around.hu += sums_[index(x, y, z)].hu;
                                around.count += sums_[index(x, y, z)].count;
                            }
                    means_[index(i, j, k)] = around.count > 0 ? mean(around)
                                             : all_.count > 0 ? mean(all_)
                                                              : 0.0f;
                }
    }
    float at(int i, int j, int k) const {
        return means_[index(i / voxels_[0], j / voxels_[1], k / voxels_[2])];
    }

private:
    struct Sum {
        long long hu = 0, count = 0;
    };
    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(k) * size_[1] + j) * size_[0] + i;
    }
    int blood_;
    std::array<int, 3> voxels_{}, size_{};
    std::vector<Sum> sums_;
    Sum all_;
    std::vector<float> means_;
};

/// Sums of three neighbours along one axis of a layer; beyond its edge counts as 0.
void add_neighbours(std::vector<float>& values, int count, int stride, int lines, int line_stride) {
    for (int line = 0; line < lines; ++line) {
        float* at = values.data() + static_cast<std::ptrdiff_t>(line) * line_stride;
        float before = 0.0f;
        for (int i = 0; i < count; ++i, at += stride) {
            const float own = *at, after = i + 1 < count ? at[stride] : 0.0f;
            *at = before + own + after;
            before = own;
        }
    }
}

}  // namespace

void replace_contrast(CtImage& ct, const geometry::TriangleMesh& lumen) {
    const MeshCoverage coverage(lumen, ct.grid);
    const auto blood = static_cast<std::int16_t>(std::lround(hounsfield(render::Material::Blood)));
    constexpr float whole = 0.999f;
    const int nx = ct.grid.size[0], ny = ct.grid.size[1];
    Excess excess(ct, blood);
    std::vector<float> fractions;
    for (int k = coverage.first_layer(); k < coverage.end_layer(); ++k) {
        coverage.layer(k, fractions);
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i)
                if (fractions[static_cast<std::size_t>(j) * nx + i] > whole)
                    excess.add(i, j, k, ct.hu[ct.grid.index(i, j, k)]);
    }
    excess.finish();
    const int first = std::max(coverage.first_layer() - 1, 0);
    const int end = std::min(coverage.end_layer() + 1, ct.grid.size[2]);
    on_all_processors(end - first, 4, [&](int n) {
        const int k = first + n;
        std::vector<float> own, near, other;
        coverage.layer(k, own);
        near = own;
        for (const int beside : {k - 1, k + 1}) {
            coverage.layer(beside, other);
            for (std::size_t i = 0; i < near.size(); ++i) near[i] += other[i];
        }
        add_neighbours(near, nx, 1, ny, nx);
        add_neighbours(near, ny, nx, nx, 1);
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const std::size_t at = static_cast<std::size_t>(j) * nx + i;
                const float part = std::min(1.0f, 2.0f / 27.0f * near[at]);
                if (!(part > 1e-3f)) continue;
                std::int16_t& hu = ct.hu[ct.grid.index(i, j, k)];
                if (own[at] > whole) {
                    hu = blood;
                } else if (hu > blood) {
                    const float left = static_cast<float>(hu) - part * excess.at(i, j, k);
                    hu = std::max(blood, static_cast<std::int16_t>(std::lround(left)));
                }
            }
    });
}

}  // namespace patient
