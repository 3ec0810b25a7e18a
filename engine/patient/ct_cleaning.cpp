#include "engine/patient/ct_cleaning.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/patient/ct_image.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/voxelise.h"

namespace patient {
namespace {

constexpr int tissue_hu = -400;

/// Cells of several voxels, one byte each.
struct Cells {
    std::array<int, 3> size{}, factor{};  // cells, and voxels in a cell, along each axis
    std::vector<char> set;
    std::vector<std::int16_t> mean;  // of their voxels

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
    cells.mean.resize(cells.set.size());
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
        for (std::size_t c = 0; c < sums.size(); ++c) {
            cells.set[cells.index(0, 0, ck) + c] = sums[c] > static_cast<long long>(tissue_hu) * counts[c];
            cells.mean[cells.index(0, 0, ck) + c] = static_cast<std::int16_t>(sums[c] / counts[c]);
        }
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

/// Cells that hang together across faces.
struct Piece {
    std::size_t cells = 0, bone = 0, soft = 0;  // how many, and of what density
    geometry::Vec3 sum{0, 0, 0};                // of their places [mm]

    geometry::Vec3 middle() const { return sum / static_cast<double>(cells); }
    double fraction(std::size_t of) const { return static_cast<double>(of) / static_cast<double>(cells); }
};

/// The pieces of the set cells, and which one each cell is of; 0 is none.
struct Pieces {
    std::vector<int> of;
    std::vector<Piece> all{Piece{}};

    Pieces(const Cells& cells, const std::vector<std::int16_t>& mean, const render::VolumeGrid& grid)
        : of(cells.set.size(), 0) {
        constexpr int bone = 180, softest = -60, hardest = 120;  // [HU]
        const std::size_t row = cells.size[0], layer = row * cells.size[1];
        std::vector<std::size_t> waiting;
        for (std::size_t seed = 0; seed < cells.set.size(); ++seed) {
            if (!cells.set[seed] || of[seed] != 0) continue;
            const int number = static_cast<int>(all.size());
            Piece& piece = all.emplace_back();
            of[seed] = number;
            waiting.assign(1, seed);
            while (!waiting.empty()) {
                const std::size_t at = waiting.back();
                waiting.pop_back();
                const std::array<int, 3> place = {static_cast<int>(at % row),
                                                  static_cast<int>(at / row % cells.size[1]),
                                                  static_cast<int>(at / layer)};
                ++piece.cells;
                piece.bone += mean[at] >= bone;
                piece.soft += mean[at] >= softest && mean[at] <= hardest;
                piece.sum += place_of(cells, grid, place);
                cells.for_neighbours(place[0], place[1], place[2], [&](std::size_t n) {
                    if (!cells.set[n] || of[n] != 0) return;
                    of[n] = number;
                    waiting.push_back(n);
                });
            }
        }
    }
    static geometry::Vec3 place_of(const Cells& cells, const render::VolumeGrid& grid,
                                   const std::array<int, 3>& cell) {
        geometry::Vec3 x = grid.origin;
        for (int a = 0; a < 3; ++a) x += (cell[a] + 0.5) * cells.factor[a] * grid.steps[a];
        return x;
    }
};

/// From front to back: what lies between is beside the body, not before or behind it [mm].
struct Depths {
    double front = 0, back = 0;

    bool hold(const Piece& piece) const { return piece.middle().y() >= front && piece.middle().y() <= back; }
};

/// Parts of the body: pieces of a quarter of the largest one or more, and others that have bone in soft
/// tissue, as an arm has and no table.
std::vector<char> parts_of_body(const Pieces& cores, double cell_volume) {
    constexpr double large = 0.25, least = 10e3;                             // [mm³]
    constexpr double least_bone = 0.005, most_bone = 0.7, least_soft = 0.2;  // of a piece
    std::size_t largest = 0;
    for (const Piece& piece : cores.all) largest = std::max(largest, piece.cells);
    std::vector<char> kept{0};
    for (std::size_t k = 1; k < cores.all.size(); ++k) {
        const Piece& piece = cores.all[k];
        const double bone = piece.fraction(piece.bone);
        const bool limb = static_cast<double>(piece.cells) * cell_volume >= least && bone >= least_bone &&
                          bone <= most_bone && piece.fraction(piece.soft) >= least_soft;
        kept.push_back(static_cast<double>(piece.cells) >= large * static_cast<double>(largest) || limb);
    }
    return kept;
}

/// A shell of bone around air, as of a skull's vault, is thinner than a body; rails of a table lie behind.
bool is_shell_of_bone(const Piece& piece, const Depths& body, double cell_volume) {
    constexpr double least = 5e3, least_bone = 0.3;  // [mm³]; of the piece
    return static_cast<double>(piece.bone) * cell_volume >= least &&
           piece.fraction(piece.bone) >= least_bone && body.hold(piece);
}

Depths depths_of(const Cells& body, const render::VolumeGrid& grid) {
    constexpr std::size_t every = 7;
    std::vector<double> depths;
    const std::size_t row = body.size[0], layer = row * body.size[1];
    for (std::size_t at = 0; at < body.set.size(); at += every)
        if (body.set[at])
            depths.push_back(
                Pieces::place_of(body, grid,
                                 {static_cast<int>(at % row), static_cast<int>(at / row % body.size[1]),
                                  static_cast<int>(at / layer)})
                    .y());
    if (depths.empty()) return {};
    std::ranges::sort(depths);
    return {depths[depths.size() / 20], depths[depths.size() - 1 - depths.size() / 20]};
}

/// "812 ml in 3 pieces outside the body were removed: 790 ml around (2, 140, 800) mm, behind it; …"
std::string removal_note(const Pieces& removed, const Depths& body, double cell_volume) {
    constexpr double worth_a_word = 1e3;  // [mm³]
    constexpr std::size_t listed = 4;
    std::vector<const Piece*> pieces;
    double sum = 0;
    for (std::size_t k = 1; k < removed.all.size(); ++k) {
        const double volume = static_cast<double>(removed.all[k].cells) * cell_volume;
        sum += volume;
        if (volume >= worth_a_word) pieces.push_back(&removed.all[k]);
    }
    if (pieces.empty()) return {};
    std::ranges::sort(pieces, [](const Piece* a, const Piece* b) { return a->cells > b->cells; });
    std::string text = fmt::format("{:.0f} ml outside the body of the CT were removed:", 1e-3 * sum);
    for (std::size_t k = 0; k < std::min(pieces.size(), listed); ++k) {
        const geometry::Vec3 x = pieces[k]->middle();
        text += fmt::format("{} {:.0f} ml around ({:.0f}, {:.0f}, {:.0f}) mm{}", k == 0 ? "" : ",",
                            1e-3 * static_cast<double>(pieces[k]->cells) * cell_volume, x.x(), x.y(), x.z(),
                            x.y() > body.back    ? " behind it"
                            : x.y() < body.front ? " before it"
                                                 : " beside it");
    }
    if (pieces.size() > listed) text += fmt::format(", and {} smaller pieces", pieces.size() - listed);
    return text + "; keep_table = true keeps them";
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

void remove_surroundings(CtImage& ct, const std::filesystem::path& file) {
    const Cells tissue = tissue_cells(ct);
    const double cell_volume =
        std::abs(ct.grid.axes().determinant()) * tissue.factor[0] * tissue.factor[1] * tissue.factor[2];
    Cells body = tissue;
    constexpr int thinned = 2;
    for (int n = 0; n < thinned; ++n) spread(body, 0);
    if (std::ranges::none_of(body.set, [](char c) { return c != 0; }))
        refuse_ct(file, "no body was found: nothing thicker than 8 mm is denser than -400 HU",
                  "expected a CT in Hounsfield units");
    const Pieces cores(body, tissue.mean, ct.grid);
    const std::vector<char> parts = parts_of_body(cores, cell_volume);
    for (std::size_t c = 0; c < body.set.size(); ++c)
        body.set[c] = parts[static_cast<std::size_t>(cores.of[c])];
    const Depths depths = depths_of(body, ct.grid);
    for (int n = 0; n < thinned + 1; ++n) spread(body, 1, &tissue);
    Cells rest = tissue;
    for (std::size_t c = 0; c < rest.set.size(); ++c) rest.set[c] = rest.set[c] && !body.set[c];
    const Pieces others(rest, tissue.mean, ct.grid);
    for (std::size_t c = 0; c < rest.set.size(); ++c)
        if (others.of[c] > 0 &&
            is_shell_of_bone(others.all[static_cast<std::size_t>(others.of[c])], depths, cell_volume))
            body.set[c] = 1;
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::abs(ct.grid.steps[a].normalized().z()) > std::abs(ct.grid.steps[axis].normalized().z()))
            axis = a;
    fill_layers(body, axis);
    spread(body, 1);
    for (std::size_t c = 0; c < rest.set.size(); ++c) rest.set[c] = tissue.set[c] && !body.set[c];
    if (const std::string note = removal_note(Pieces(rest, tissue.mean, ct.grid), depths, cell_volume);
        !note.empty())
        ct.notes.push_back(note);
    on_all_processors(ct.grid.size[2], 4, [&](int k) {
        for (int j = 0; j < ct.grid.size[1]; ++j) {
            std::int16_t* row = ct.hu.data() + ct.grid.index(0, j, k);
            const char* keep = body.set.data() + body.index(0, j / body.factor[1], k / body.factor[2]);
            for (int i = 0; i < ct.grid.size[0]; ++i)
                if (!keep[i / body.factor[0]]) row[i] = air_hu;
        }
    });
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
